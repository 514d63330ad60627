#include "dyxel/capture/rig_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include <Eigen/Dense>

#include "dyxel/base/error.h"

namespace dyxel::internal {
namespace {

// A person's room: an upright cylinder about the point where the cameras look.
constexpr double kRadius = 0.6;
constexpr double kHalfHeight = 1.1;

void Warn(CheckReport& report, std::string what, std::string mend) {
  report.items.push_back({Severity::kWarning, "capture.json", std::move(what), std::move(mend)});
}

bool InsidePerson(const CheckReport& report, const Vec3d& x) {
  const Vec3d offset = x - report.centre;
  const double height = offset.dot(report.capture.up);
  return std::abs(height) < kHalfHeight && (offset - height * report.capture.up).norm() < kRadius;
}

void CheckCamera(CheckReport& report, const Camera& camera, bool has_centre) {
  if (camera.fx <= 0 || camera.fy <= 0 || camera.width <= 0 || camera.height <= 0) return;
  if (camera.cx < 0 || camera.cx > camera.width || camera.cy < 0 || camera.cy > camera.height) {
    Warn(report,
         fmt::format("the principal point ({:.0f}, {:.0f}) of camera {} lies outside its picture",
                     camera.cx,
                     camera.cy,
                     camera.name),
         "Check that the calibration belongs to this picture size");
  }
  if (camera.fx / camera.fy > 1.25 || camera.fy / camera.fx > 1.25) {
    Warn(
        report,
        fmt::format("camera {} has fx = {:.0f} and fy = {:.0f}", camera.name, camera.fx, camera.fy),
        "Focal lengths are in pixels, both nearly the same");
  }
  if (!has_centre) return;
  const double depth = camera.Depth(report.centre);
  const double distance = (camera.Center() - report.centre).norm();
  if (depth <= 0) {
    Warn(report,
         fmt::format("camera {} looks away from where the others look", camera.name),
         "Check its rotation: x_cam = R·x_world + t, z forward");
    return;
  }
  const Vec2d pixel = camera.Project(report.centre);
  if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() > camera.width || pixel.y() > camera.height) {
    Warn(report,
         fmt::format("camera {} does not see the point where the axes meet", camera.name),
         "Check its rotation and translation: x_cam = R·x_world + t");
  }
  if (InsidePerson(report, camera.Center())) {
    report.items.push_back(
        {Severity::kError,
         "capture.json",
         fmt::format("camera {} is inside the person: {:.2f} m from where the axes meet",
                     camera.name,
                     distance),
         "Check its translation: metres, x_cam = R·x_world + t"});
  }
}

void CheckLight(CheckReport& report, const Light& light, bool has_centre) {
  if (!has_centre || light.type == LightType::kDirectional) return;
  if (InsidePerson(report, light.position)) {
    report.items.push_back(
        {Severity::kError,
         "capture.json",
         fmt::format("the light {} is inside the person, at ({:.2f}, {:.2f}, {:.2f})",
                     light.name,
                     light.position.x(),
                     light.position.y(),
                     light.position.z()),
         "Check its position: metres, in the cameras' world"});
    return;
  }
  if (light.type == LightType::kSpot &&
      !(Illuminate(light, report.centre.cast<float>()).cone > 0)) {
    Warn(report,
         fmt::format("the cone of {} misses the person", light.name),
         "Check its direction (the way the light travels) and cone_outer (radians)");
  }
}

}  // namespace

bool MeetingPoint(const std::vector<Camera>& cameras, Vec3d& point) {
  // min Σ |(I − d dᵀ)(x − c)|² over the axes (c, d).
  Mat3d sum = Mat3d::Zero();
  Vec3d right = Vec3d::Zero();
  for (const Camera& camera : cameras) {
    const Vec3d axis = camera.cam_from_world.rotation.row(2).transpose();
    const Mat3d across = Mat3d::Identity() - axis * axis.transpose();
    sum += across;
    right += across * camera.Center();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3d> solver(sum);
  // Parallel axes have no such point.
  if (cameras.size() < 2 || !(solver.eigenvalues()[0] > 1e-3)) return false;
  point = sum.ldlt().solve(right);
  return point.allFinite();
}

void CheckRig(const std::vector<bool>& good_cameras,
              const std::vector<bool>& good_lights,
              CheckReport& report) {
  const Capture& capture = report.capture;
  if (capture.cameras.empty()) return;
  // A bad rotation is an item already, and its axis would spoil the point.
  std::vector<Camera> cameras;
  for (std::size_t i = 0; i < capture.cameras.size(); ++i) {
    if (good_cameras[i]) cameras.push_back(capture.cameras[i]);
  }
  Vec3d point = Vec3d::Constant(std::numeric_limits<double>::quiet_NaN());
  const bool has_centre = MeetingPoint(cameras, point);
  report.centre = point;
  if (has_centre) {
    std::vector<double> distances;
    for (const Camera& camera : cameras) {
      distances.push_back((camera.Center() - point).norm());
    }
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    if (*middle > 50 || *middle < 0.1) {
      Warn(report,
           fmt::format("the cameras are {:.3g} m away from where they look", *middle),
           "Translations are in metres, not millimetres");
    }
  }
  for (const Camera& camera : cameras) CheckCamera(report, camera, has_centre);
  for (std::size_t i = 0; i < capture.lights.size(); ++i) {
    if (good_lights[i]) CheckLight(report, capture.lights[i], has_centre);
  }
  const std::size_t estimation = capture.EstimationCameras().size();
  if (estimation < 2) {
    Warn(report,
         fmt::format(
             "{} of {} cameras may be used for estimation", estimation, capture.cameras.size()),
         "A body needs at least two (holdout: false); six or more all around are good");
  }
  // The same place twice is a copied entry.
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    for (std::size_t j = i + 1; j < cameras.size(); ++j) {
      const Rigid& a = cameras[i].cam_from_world;
      const Rigid& b = cameras[j].cam_from_world;
      if ((a.rotation - b.rotation).norm() < 1e-9 &&
          (a.translation - b.translation).norm() < 1e-9) {
        Warn(report,
             fmt::format("cameras {} and {} stand at the same place and look the same way",
                         cameras[i].name,
                         cameras[j].name),
             "Check that one is not a copy of the other");
      }
    }
  }
  const bool has_res =
      std::any_of(capture.sequences.begin(), capture.sequences.end(), [](const Sequence& s) {
        return s.kind == SequenceKind::kReflectance;
      });
  if (!has_res && !capture.sequences.empty()) {
    Warn(report,
         "no sequence is of kind \"reflectance\"",
         "Without one it can be tracked, and no more");
  }
}

}  // namespace dyxel::internal
