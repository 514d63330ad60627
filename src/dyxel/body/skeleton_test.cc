#include "dyxel/body/skeleton.h"

#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/random.h"
#include "dyxel/body/actor.h"

namespace dyxel {
namespace {

// A trunk with two branching limbs.
Skeleton MakeSkeleton() {
  Skeleton s;
  s.joints = {
      {"root", -1, {0.1, 0.2, 1.0}, {}},
      {"spine",
       0,
       {0, 0, 0.3},
       {{"sx", Vec3d::UnitX(), -1, 1}, {"sy", Vec3d::UnitY(), -0.5, 1}, {"sz", Vec3d::UnitZ()}}},
      {"arm", 1, {0, 0.2, 0.1}, {{"ax", Vec3d(1, 2, -1).normalized(), -2, 2}}},
      {"hand", 2, {0, 0.3, 0}, {{"hz", Vec3d::UnitZ(), -1, 1}, {"hy", Vec3d::UnitY(), -1, 1}}},
      {"leg", 0, {0, 0.1, -0.1}, {{"ly", Vec3d::UnitY(), -2, 0.3}}}};
  return s;
}

Pose RandomPose(const Skeleton& skeleton, std::uint64_t seed) {
  Random random(seed);
  Pose pose = skeleton.RestPose();
  auto next = [&] { return static_cast<double>(random.Normal()); };
  pose.root_translation = {next(), next(), next()};
  pose.root_rotation = Quatd(next(), next(), next(), next()).normalized();
  for (double& angle : pose.angles) angle = 0.7 * next();
  return pose;
}

// One vertex a joint and some blended between any four.
Actor MakeActor() {
  Actor actor;
  actor.skeleton = MakeSkeleton();
  Random random(3);
  for (int v = 0; v < 40; ++v) {
    actor.skin.positions.emplace_back(random.Normal(), random.Normal(), random.Normal());
    if (v < 5) {
      actor.joint_indices.push_back({v, 0, 0, 0});
      actor.joint_weights.push_back({1, 0, 0, 0});
      continue;
    }
    std::array<int, 4> joints{v % 5, (v + 1) % 5, (v + 2) % 5, (v + 3) % 5};
    actor.joint_indices.push_back(joints);
    actor.joint_weights.push_back({0.5F, 0.25F, 0.125F, 0.125F});
  }
  return actor;
}

TEST(Skeleton, RestPoseIsTheRestPositions) {
  const Skeleton s = MakeSkeleton();
  EXPECT_EQ(s.NumDofs(), 7);
  EXPECT_EQ(s.FirstDof(), (std::vector<int>{0, 0, 3, 4, 6}));
  const std::vector<Rigid> frames = s.Forward(s.RestPose());
  const std::vector<Vec3d> rest = s.RestPositions();
  EXPECT_LT((rest[3] - Vec3d(0.1, 0.7, 1.4)).norm(), 1e-15);
  for (std::size_t j = 0; j < rest.size(); ++j) {
    EXPECT_LT((frames[j].translation - rest[j]).norm(), 1e-15);
    EXPECT_TRUE(frames[j].rotation.isIdentity(1e-15));
  }
  EXPECT_EQ(s.FindJoint("hand"), 3);
  EXPECT_EQ(s.FindJoint("tail"), -1);
}

// The first hinge is the outermost: R = Rx Ry Rz, in the parent's frame.
TEST(Skeleton, HingesMultiplyInTheirOrder) {
  const Skeleton s = MakeSkeleton();
  Pose pose = s.RestPose();
  pose.angles = {0.3, -0.4, 0.5, 0, 0, 0, 0};
  pose.root_rotation = Quatd(Eigen::AngleAxisd(kPiD / 2, Vec3d::UnitZ()));
  const std::vector<Rigid> frames = s.Forward(pose);
  const Mat3d expected =
      (Eigen::AngleAxisd(kPiD / 2, Vec3d::UnitZ()) * Eigen::AngleAxisd(0.3, Vec3d::UnitX()) *
       Eigen::AngleAxisd(-0.4, Vec3d::UnitY()) * Eigen::AngleAxisd(0.5, Vec3d::UnitZ()))
          .toRotationMatrix();
  EXPECT_TRUE(frames[1].rotation.isApprox(expected, 1e-14));
  EXPECT_LT((frames[2].translation - frames[1] * Vec3d(0, 0.2, 0.1)).norm(), 1e-14);
}

TEST(Skeleton, BonesKeepTheirLengths) {
  const Skeleton s = MakeSkeleton();
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    const std::vector<Rigid> frames = s.Forward(RandomPose(s, seed));
    for (std::size_t j = 1; j < frames.size(); ++j) {
      const auto parent = static_cast<std::size_t>(s.joints[j].parent);
      EXPECT_NEAR((frames[j].translation - frames[parent].translation).norm(),
                  s.joints[j].offset.norm(),
                  1e-13);
      EXPECT_NEAR(frames[j].rotation.determinant(), 1, 1e-13);
    }
  }
}

TEST(Skeleton, ClampKeepsToTheLimits) {
  const Skeleton s = MakeSkeleton();
  Pose pose = s.RestPose();
  pose.angles = {-3, 3, 0, 0.2, 0, -2, 1};
  EXPECT_EQ(ClampToLimits(s, pose).angles, (std::vector<double>{-1, 1, 0, 0.2, 0, -1, 0.3}));
}

// Central differences of MovePose() against the analytic Jacobians.
TEST(Skeleton, JacobiansAgreeWithDifferences) {
  const Actor actor = MakeActor();
  const Skeleton& s = actor.skeleton;
  const Pose pose = RandomPose(s, 7);
  const PoseDerivatives derivatives = ComputePoseDerivatives(s, pose);
  ASSERT_EQ(derivatives.NumUnknowns(), 13);
  constexpr double kStep = 1e-5;
  PointJacobian jacobian;
  PointJacobian unused;
  for (int column = 0; column < 13; ++column) {
    std::vector<double> step(13, 0.0);
    step[static_cast<std::size_t>(column)] = kStep;
    const PoseDerivatives up = ComputePoseDerivatives(s, MovePose(pose, step));
    step[static_cast<std::size_t>(column)] = -kStep;
    const PoseDerivatives down = ComputePoseDerivatives(s, MovePose(pose, step));
    for (int v = 0; v < 40; ++v) {
      const Vec3d difference =
          (SkinVertexJacobian(actor, up, v, unused) - SkinVertexJacobian(actor, down, v, unused)) /
          (2 * kStep);
      SkinVertexJacobian(actor, derivatives, v, jacobian);
      EXPECT_LT((difference - jacobian.col(column)).norm(), 1e-8) << v << " " << column;
    }
    const Vec3d in_joint(0.1, -0.2, 0.3);
    for (std::size_t j = 0; j < 5; ++j) {
      const Vec3d difference =
          (up.world_from_joint[j] * in_joint - down.world_from_joint[j] * in_joint) / (2 * kStep);
      JointPointJacobian(
          derivatives, static_cast<int>(j), derivatives.world_from_joint[j] * in_joint, jacobian);
      EXPECT_LT((difference - jacobian.col(column)).norm(), 1e-8) << j << " " << column;
    }
  }
}

TEST(Skeleton, SkinFollowsItsJointsAndBlends) {
  const Actor actor = MakeActor();
  const Pose pose = RandomPose(actor.skeleton, 11);
  const std::vector<Vec3f> skin = SkinPositions(actor, pose);
  const std::vector<Rigid> frames = actor.skeleton.Forward(pose);
  const std::vector<Vec3d> rest = actor.skeleton.RestPositions();
  const PoseDerivatives derivatives = ComputePoseDerivatives(actor.skeleton, pose);
  PointJacobian jacobian;
  for (std::size_t v = 0; v < skin.size(); ++v) {
    const Vec3d x = SkinVertexJacobian(actor, derivatives, static_cast<int>(v), jacobian);
    EXPECT_LT((skin[v].cast<double>() - x).norm(), 2e-6);
    if (v < 5) {  // rigid with joint v
      EXPECT_LT((frames[v] * (actor.skin.positions[v].cast<double>() - rest[v]) - x).norm(), 1e-12);
    }
  }
  const std::vector<Vec3f> at_rest = SkinPositions(actor, actor.skeleton.RestPose());
  for (std::size_t v = 0; v < skin.size(); ++v) {
    EXPECT_LT((at_rest[v] - actor.skin.positions[v]).norm(), 2e-6F);
  }
}

}  // namespace
}  // namespace dyxel
