#include "dyxel/body/nodes.h"

#include <gtest/gtest.h>

namespace dyxel {
namespace {

const Actor& Bones() {
  static const Actor actor = MakeBuiltInTemplate();
  return actor;
}
const Actor& Noded() {
  static const Actor actor = WithNodes(Bones());
  return actor;
}

Pose Bent() {
  Pose pose = Bones().skeleton.RestPose();
  pose.root_translation += Vec3d(0.3, -0.2, 0.1);
  pose.root_rotation = Quatd(Eigen::AngleAxisd(0.8, Vec3d(0.2, 0.3, 1).normalized()));
  for (std::size_t d = 0; d < pose.angles.size(); ++d) pose.angles[d] = 0.1 + 0.02 * (d % 7);
  return ClampToLimits(Bones().skeleton, pose);
}

TEST(WithNodes, CoversTheSkinWithAFewHundredNodes) {
  const int nodes = Noded().skeleton.NumNodes();
  EXPECT_GT(nodes, 200);
  EXPECT_LT(nodes, 700);
  for (std::size_t v = 0; v < Noded().joint_weights.size(); ++v) {
    float sum = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      sum += Noded().joint_weights[v][k];
      if (k > 0) {
        ASSERT_LE(Noded().joint_weights[v][k], Noded().joint_weights[v][k - 1]);
      }
    }
    ASSERT_NEAR(sum, 1, 1e-5F);
  }
}

TEST(WithNodes, MovesRigidlyWithARigidBody) {
  Pose pose = Noded().skeleton.RestPose();
  pose.root_rotation = Quatd(Eigen::AngleAxisd(2.0, Vec3d(1, 2, 3).normalized()));
  pose.root_translation = Vec3d(4, -5, 6);
  const std::vector<Vec3f> a = SkinPositions(Bones(), pose);
  const std::vector<Vec3f> b = SkinPositions(Noded(), pose);
  for (std::size_t v = 0; v < a.size(); ++v) ASSERT_LT((a[v] - b[v]).norm(), 1e-5F);
}

TEST(WithNodes, BendsNearlyAsTheBonesDo) {
  const std::vector<Vec3f> a = SkinPositions(Bones(), Bent());
  const std::vector<Vec3f> b = SkinPositions(Noded(), Bent());
  float sum = 0, most = 0;
  for (std::size_t v = 0; v < a.size(); ++v) {
    sum += (a[v] - b[v]).norm();
    most = std::max(most, (a[v] - b[v]).norm());
  }
  EXPECT_LT(sum / static_cast<float>(a.size()), 0.0015F);
  EXPECT_LT(most, 0.016F);
}

TEST(WithNodes, OneShiftForAllMovesAll) {
  Pose pose = Bent();
  const std::vector<Vec3f> a = SkinPositions(Noded(), pose);
  const std::vector<Rigid> frames = Noded().skeleton.Forward(pose);
  const Vec3d shift(0.01, 0.02, -0.03);
  for (std::size_t j = 0; j < frames.size(); ++j) {
    if (!Noded().skeleton.joints[j].IsNode()) continue;
    pose.shifts.push_back(frames[j].rotation.transpose() * shift);
  }
  const std::vector<Vec3f> b = SkinPositions(Noded(), pose);
  for (std::size_t v = 0; v < a.size(); ++v) {
    ASSERT_LT((b[v] - a[v] - shift.cast<float>()).norm(), 1e-5F);
  }
}

TEST(WithNodes, AShiftFadesSmoothly) {
  // One node shifted: no two neighbouring vertices move much differently.
  Pose pose = Noded().skeleton.RestPose();
  pose.shifts.assign(static_cast<std::size_t>(Noded().skeleton.NumNodes()), Vec3d::Zero());
  const std::vector<Vec3f> a = SkinPositions(Noded(), pose);
  pose.shifts[pose.shifts.size() / 2] = Vec3d(0, 0, 0.02);
  const std::vector<Vec3f> b = SkinPositions(Noded(), pose);
  float most = 0;
  for (const Triangle& t : Noded().skin.triangles) {
    for (std::size_t e = 0; e < 3; ++e) {
      const auto u = static_cast<std::size_t>(t[e]);
      const auto v = static_cast<std::size_t>(t[(e + 1) % 3]);
      most = std::max(most,
                      std::abs((b[u] - a[u]).norm() - (b[v] - a[v]).norm()) / (a[u] - a[v]).norm());
    }
  }
  EXPECT_GT(most, 0.05F);
  EXPECT_LT(most, 0.02F / 0.02F);  // no steeper than over a quarter of the nodes' spacing
}

TEST(NodeEdges, TieNeighboursOnly) {
  const auto edges = NodeEdges(Noded());
  const auto nodes = static_cast<std::size_t>(Noded().skeleton.NumNodes());
  EXPECT_GT(edges.size(), 2 * nodes);
  EXPECT_LT(edges.size(), 8 * nodes);
  const std::vector<Vec3d> rest = Noded().skeleton.RestPositions();
  const std::size_t first = rest.size() - nodes;
  for (const auto& e : edges) {
    EXPECT_LT(e[0], e[1]);
    EXPECT_LT((rest[first + static_cast<std::size_t>(e[0])] -
               rest[first + static_cast<std::size_t>(e[1])])
                  .norm(),
              0.3);
  }
}

}  // namespace
}  // namespace dyxel
