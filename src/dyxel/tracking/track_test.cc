#include "dyxel/tracking/track.h"

#include <gtest/gtest.h>

#include "dyxel/base/error.h"
#include "dyxel/tracking/silhouettes.h"
#include "dyxel/tracking/synthetic_rig.h"

namespace dyxel {
namespace {

using internal::Angle;
using internal::CompareJoints;
using internal::JointError;
using internal::SmallBody;

// Turned to some direction, an arm swings by 50° from frame to frame and the person walks on.
std::vector<Pose> Swing(const Skeleton& skeleton, double facing, int frames) {
  std::vector<Pose> poses;
  for (int t = 0; t < frames; ++t) {
    Pose pose = skeleton.RestPose();
    pose.root_translation += Vec3d(0.06 * t - 0.1, 0.05, 0.02 * (t % 2));
    pose.root_rotation = Quatd(Eigen::AngleAxisd(facing + 0.1 * t, Vec3d::UnitZ()));
    Angle(skeleton, pose, "l_shoulder_elevation") = t % 2 == 0 ? -0.1 : 0.77;
    Angle(skeleton, pose, "r_elbow_flexion") = 0.3 + 0.4 * (t % 2);
    Angle(skeleton, pose, "l_hip_flexion") = 0.4 - 0.2 * t;
    Angle(skeleton, pose, "l_knee_flexion") = 0.5;
    poses.push_back(pose);
  }
  return poses;
}

TEST(TrackMotion, FollowsAFastSwingFromAnyFacing) {
  const Actor& body = SmallBody();
  for (const double facing : {0.9, -2.5}) {
    const std::vector<Pose> truth = Swing(body.skeleton, facing, 4);
    const SilhouetteSet set =
        internal::DrawSilhouettes(internal::RingOfCameras(7, 200), body, truth);
    const Motion motion = TrackMotion(set, body);
    ASSERT_EQ(motion.poses.size(), truth.size());
    for (std::size_t t = 0; t < truth.size(); ++t) {
      const JointError error =
          CompareJoints(body.skeleton, truth[t], body.skeleton, motion.poses[t]);
      EXPECT_LT(error.mean, 0.02) << "facing " << facing << " frame " << t;
      EXPECT_LT(error.most, 0.06) << "facing " << facing << " frame " << t;
      EXPECT_GT(motion.confidence[t], 0.93);
    }
  }
}

TEST(TrackMotion, BridgesAFrameWithoutPictures) {
  const Actor& body = SmallBody();
  const std::vector<Pose> truth = Swing(body.skeleton, 0.3, 3);
  SilhouetteSet set = internal::DrawSilhouettes(internal::RingOfCameras(7, 160), body, truth);
  for (ImageU8& mask : set.masks[1]) mask = {};
  const Motion motion = TrackMotion(set, body);
  EXPECT_EQ(motion.confidence[1], 0);
  EXPECT_LT(CompareJoints(body.skeleton, truth[2], body.skeleton, motion.poses[2]).mean, 0.03);
}

TEST(TrackMotion, FollowsAPersonHalfInTheDark) {
  // Three of seven cameras see no more than a few rows of the person; the rest of their pictures is
  // too dark to tell.
  const Actor& body = SmallBody();
  const std::vector<Pose> truth = Swing(body.skeleton, 1.7, 3);
  SilhouetteSet set = internal::DrawSilhouettes(internal::RingOfCameras(7, 200), body, truth);
  for (auto& masks : set.masks) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (int y = 0; y < masks[c].height; ++y) {
        for (int x = 0; x < masks[c].width; ++x) {
          std::uint8_t& v = masks[c].At(x, y);
          if (v == 0 || y > 90) v = kMaskUnknown;
        }
      }
    }
  }
  const Motion motion = TrackMotion(set, body);
  for (std::size_t t = 0; t < truth.size(); ++t) {
    EXPECT_LT(CompareJoints(body.skeleton, truth[t], body.skeleton, motion.poses[t]).mean, 0.03);
  }
}

TEST(TrackMotion, SaysThatThereIsNobody) {
  SilhouetteSet set;
  set.cameras = internal::RingOfCameras(3, 64);
  set.masks = {std::vector<ImageU8>(3, ImageU8(64, 64, 1))};
  EXPECT_THROW((void)TrackMotion(set, SmallBody()), Error);
  set.masks[0].resize(2);
  EXPECT_THROW((void)TrackMotion(set, SmallBody()), Error);
}

TEST(FitActor, FindsProportionsAndWearsTheSkin) {
  const Actor& body = SmallBody();
  Proportions truth = TemplateProportions();
  truth.height = 1.07;
  truth.lengths[7] = 1.06;  // thighs
  truth.girths[7] = 1.25;
  truth.girths[2] = 1.15;  // chest
  const Actor person = ApplyProportions(body, truth);
  std::vector<Pose> poses;
  for (int t = 0; t < 4; ++t) {
    Pose pose = person.skeleton.RestPose();
    pose.root_rotation = Quatd(Eigen::AngleAxisd(1.3 + 0.4 * t, Vec3d::UnitZ()));
    Angle(person.skeleton, pose, "l_elbow_flexion") = 0.4;
    poses.push_back(pose);
  }
  const SilhouetteSet set =
      internal::DrawSilhouettes(internal::RingOfCameras(7, 200), person, poses);
  const ActorFit fit = FitActor(set, body, {.rounds = 2, .refine = 2});
  EXPECT_NEAR(fit.proportions.height, 1.07, 0.05);
  EXPECT_GT(fit.proportions.girths[7], 1.12);
  for (std::size_t t = 0; t < poses.size(); ++t) {
    EXPECT_GT(fit.motion.confidence[t], 0.95);
    EXPECT_LT(
        CompareJoints(person.skeleton, poses[t], fit.actor.skeleton, fit.motion.poses[t]).mean,
        0.03);
  }
  EXPECT_EQ(fit.actor.skin.triangles, body.skin.triangles);
}

}  // namespace
}  // namespace dyxel
