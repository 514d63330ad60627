// For tests: a ring of cameras, and silhouettes of posed bodies drawn by the mesh rasterizer, which
// the tracker itself does not use.
#pragma once

#include <cmath>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "dyxel/body/actor.h"
#include "dyxel/body/nodes.h"
#include "dyxel/mesh/rasterizer.h"
#include "dyxel/tracking/reduced_body.h"
#include "dyxel/tracking/track.h"

namespace dyxel::internal {

// `count` cameras in a circle of 3.5 m about (0, 0, 0.9), at changing heights, the last overhead.
inline std::vector<Camera> RingOfCameras(int count, int size) {
  std::vector<Camera> cameras;
  for (int k = 0; k < count; ++k) {
    const bool overhead = k == count - 1;
    const double turn = 2 * kPiD * k / (count - 1) + 0.2;
    const Vec3d center =
        overhead ? Vec3d(0.1, 0.05, 4.6)
                 : Vec3d(3.5 * std::cos(turn), 3.5 * std::sin(turn), 1.2 + 0.3 * (k % 2));
    const Vec3d z = (Vec3d(0, 0, 0.9) - center).normalized();
    const Vec3d up = overhead ? Vec3d(0, 1, 0) : Vec3d(0, 0, 1);
    const Vec3d x = z.cross(up).normalized();
    Camera camera;
    camera.name = "cam" + std::to_string(k);
    camera.width = camera.height = size;
    camera.fx = camera.fy = 1.25 * size;
    camera.cx = camera.cy = 0.5 * size;
    camera.cam_from_world.rotation.row(0) = x;
    camera.cam_from_world.rotation.row(1) = z.cross(x);
    camera.cam_from_world.rotation.row(2) = z;
    camera.cam_from_world.translation = -(camera.cam_from_world.rotation * center);
    cameras.push_back(camera);
  }
  return cameras;
}

// World positions (V) as the mesh rasterizer takes them.
inline std::vector<ScreenVertex> ToScreen(const Camera& camera, std::span<const Vec3f> positions) {
  std::vector<ScreenVertex> vertices;
  vertices.reserve(positions.size());
  for (const Vec3f& x : positions) {
    const Vec3d world = x.cast<double>();
    const Vec2d pixel = camera.Project(world);
    vertices.push_back({static_cast<float>(pixel.x()),
                        static_cast<float>(pixel.y()),
                        static_cast<float>(1 / camera.Depth(world))});
  }
  return vertices;
}

inline ImageU8 DrawMask(const Camera& camera, const Actor& actor, const Pose& pose) {
  const std::vector<ScreenVertex> vertices = ToScreen(camera, SkinPositions(actor, pose));
  const VisibilityBuffer buffer =
      Rasterize(vertices, actor.skin.triangles, camera.width, camera.height);
  ImageU8 mask(camera.width, camera.height, 1);
  for (std::size_t i = 0; i < mask.data.size(); ++i)
    mask.data[i] = buffer.triangle[i] >= 0 ? 255 : 0;
  return mask;
}

inline SilhouetteSet DrawSilhouettes(const std::vector<Camera>& cameras,
                                     const Actor& actor,
                                     const std::vector<Pose>& poses) {
  SilhouetteSet set{cameras, {}, Vec3d::UnitZ()};
  for (const Pose& pose : poses) {
    std::vector<ImageU8> masks;
    masks.reserve(cameras.size());
    for (const Camera& camera : cameras) masks.push_back(DrawMask(camera, actor, pose));
    set.masks.push_back(std::move(masks));
  }
  return set;
}

// The built-in template with few enough triangles for quick tests.
inline const Actor& SmallBody() {
  static const Actor body = ReduceBody(MakeBuiltInTemplate(), 3000);
  return body;
}

// The same on nodes.
inline const Actor& SmallNodedBody() {
  static const Actor body = WithNodes(SmallBody(), 0.09);
  return body;
}

inline double& Angle(const Skeleton& skeleton, Pose& pose, const std::string& dof) {
  std::size_t d = 0;
  for (const Joint& joint : skeleton.joints) {
    for (const Dof& each : joint.dofs) {
      if (each.name == dof) return pose.angles[d];
      ++d;
    }
  }
  throw std::out_of_range(dof);
}

// The largest and mean distance of the joints of two poses, metres.
struct JointError {
  double most = 0, mean = 0;
};
inline JointError CompareJoints(const Skeleton& a,
                                const Pose& pose_a,
                                const Skeleton& b,
                                const Pose& pose_b) {
  JointError error;
  const auto frames_a = a.Forward(pose_a);
  const auto frames_b = b.Forward(pose_b);
  for (std::size_t j = 0; j < frames_a.size(); ++j) {
    const double d = (frames_a[j].translation - frames_b[j].translation).norm();
    error.most = std::max(error.most, d);
    error.mean += d / static_cast<double>(frames_a.size());
  }
  return error;
}

}  // namespace dyxel::internal
