#include "dyxel/tracking/node_fit.h"

#include <gtest/gtest.h>

#include "dyxel/mesh/closest_point.h"
#include "dyxel/tracking/sequence_tracker.h"
#include "dyxel/tracking/synthetic_rig.h"
#include "dyxel/tracking/track.h"

namespace dyxel {
namespace {

using internal::DrawSilhouettes;
using internal::RingOfCameras;
using internal::SmallNodedBody;

// Cloth that stands off the trunk by up to `most` metres, farther on one side and lower down.
std::vector<Vec3d> Flared(double most) {
  std::vector<Vec3d> shifts;
  const std::vector<Vec3d> rest = SmallNodedBody().skeleton.RestPositions();
  for (std::size_t j = 0; j < rest.size(); ++j) {
    if (!SmallNodedBody().skeleton.joints[j].IsNode()) continue;
    const Vec3d& x = rest[j];
    const bool trunk = std::abs(x.y()) < 0.25 && x.z() > 0.75 && x.z() < 1.3;
    const double amount =
        trunk ? most * std::sin((x.z() - 0.75) / 0.55 * kPiD) * (0.7 + x.y()) : 0.0;
    shifts.push_back(amount * Vec3d(x.x(), x.y(), 0).normalized());
  }
  return shifts;
}

std::vector<Pose> Poses(std::size_t count) {
  std::vector<Pose> poses;
  for (std::size_t t = 0; t < count; ++t) {
    Pose pose = SmallNodedBody().skeleton.RestPose();
    pose.root_rotation =
        Quatd(Eigen::AngleAxisd(0.4 + 0.5 * static_cast<double>(t), Vec3d::UnitZ()));
    internal::Angle(SmallNodedBody().skeleton, pose, "l_elbow_flexion") = 0.6;
    poses.push_back(pose);
  }
  return poses;
}

// From the skin of `a` to the surface of `b`: silhouettes don't see what moves along it.
double MeanDistance(const Pose& a, const Pose& b) {
  const ClosestPointTree surface(SkinPositions(SmallNodedBody(), b),
                                 SmallNodedBody().skin.triangles);
  const std::vector<Vec3f> x = SkinPositions(SmallNodedBody(), a);
  double sum = 0;
  for (const Vec3f& v : x) sum += static_cast<double>(surface.Find(v).distance);
  return sum / static_cast<double>(x.size());
}

TEST(FitShifts, FindsFlaredCloth) {
  const std::vector<Pose> poses = Poses(2);
  std::vector<Pose> truth = poses;
  for (Pose& pose : truth) pose.shifts = Flared(0.06);
  const SilhouetteSet set = DrawSilhouettes(RingOfCameras(8, 400), SmallNodedBody(), truth);
  Motion motion{poses, {1, 1}};
  motion = FitShifts(set, SmallNodedBody(), motion);
  for (std::size_t t = 0; t < poses.size(); ++t) {
    ASSERT_FALSE(motion.poses[t].shifts.empty());
    EXPECT_LT(MeanDistance(motion.poses[t], truth[t]), 0.5 * MeanDistance(poses[t], truth[t]));
    for (const Vec3d& shift : motion.poses[t].shifts) {
      for (int a = 0; a < 3; ++a) {
        EXPECT_NEAR(std::remainder(shift[a], kShiftUnit), 0, 1e-12);  // as they are stored
      }
    }
  }
}

TEST(FitShifts, LeavesASkinThatFits) {
  const std::vector<Pose> poses = Poses(2);
  const SilhouetteSet set = DrawSilhouettes(RingOfCameras(8, 400), SmallNodedBody(), poses);
  Motion motion{poses, {1, 1}};
  motion = FitShifts(set, SmallNodedBody(), motion);
  for (std::size_t t = 0; t < poses.size(); ++t) {
    EXPECT_LT(MeanDistance(motion.poses[t], poses[t]), 0.002);
  }
}

TEST(FitShifts, IsSteadiedByTheStepsBesideIt) {
  // The middle step is seen by one camera alone: along its rays the neighbours decide.
  const std::vector<Pose> poses = Poses(3);
  std::vector<Pose> truth = poses;
  for (Pose& pose : truth) pose.shifts = Flared(0.06);
  SilhouetteSet set = DrawSilhouettes(RingOfCameras(8, 400), SmallNodedBody(), truth);
  for (std::size_t c = 1; c < 8; ++c) set.masks[1][c] = {};
  const Motion motion{poses, {1, 1, 1}};
  const Motion loose = FitShifts(set, SmallNodedBody(), motion, {.node_inertia = 0});
  const Motion held = FitShifts(set, SmallNodedBody(), motion, {.node_inertia = 1});
  EXPECT_LT(MeanDistance(held.poses[1], truth[1]), MeanDistance(loose.poses[1], truth[1]));
}

TEST(FitShifts, InertiaHoldsAStepThatItsSilhouettesPullAway) {
  const std::vector<Pose> poses = Poses(3);
  std::vector<Pose> truth = poses;
  truth[0].shifts = truth[2].shifts = Flared(0.06);
  const SilhouetteSet set = DrawSilhouettes(RingOfCameras(8, 400), SmallNodedBody(), truth);
  const Motion motion{poses, {1, 1, 1}};
  const Motion loose = FitShifts(set, SmallNodedBody(), motion, {.node_inertia = 0});
  const Motion held = FitShifts(set, SmallNodedBody(), motion, {.node_inertia = 1});
  Pose beside = poses[1];
  beside.shifts = truth[0].shifts;
  EXPECT_LT(MeanDistance(held.poses[1], beside), 0.85 * MeanDistance(loose.poses[1], beside));
}

}  // namespace
}  // namespace dyxel
