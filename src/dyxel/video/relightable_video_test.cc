#include "dyxel/video/relightable_video.h"

#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/error.h"

namespace dyxel {
namespace {

ImageF Constant(const Vec3f& n) {
  ImageF map(4, 4, 3);
  for (std::size_t i = 0; i < map.data.size(); ++i) map.data[i] = n[static_cast<int>(i % 3)];
  return map;
}

// A unit vector in the xz plane at `angle` from z.
Vec3f At(float angle) { return {std::sin(angle), 0, std::cos(angle)}; }

TEST(NormalMapAtTest, KeysAreExactAndBetweenThemTheAngleGrowsEvenly) {
  RelightableVideo video;
  video.maps.normal = Constant({0, 0, 1});
  EXPECT_EQ(NormalMapAt(video, 3).data, video.maps.normal.data);
  video.normals = {{2, Constant(At(0.1F))}, {7, Constant(At(0.9F))}, {12, Constant(At(0.9001F))}};
  const auto expect = [&](double frame, float angle) {
    const ImageF map = NormalMapAt(video, frame);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(map.At(1, 2, c), At(angle)[c], 1e-5) << frame;
  };
  expect(0, 0.1F);
  expect(2, 0.1F);
  expect(3, 0.1F + 0.16F);
  expect(4.5, 0.5F);
  expect(7, 0.9F);
  expect(9.5, 0.90005F);
  expect(100, 0.9001F);
}

TEST(SkinPositionsAtTest, GivenSurfacesMoveLinearlyAndClamp) {
  RelightableVideo video;
  EXPECT_THROW((void)SkinPositionsAt(video, 0), Error);
  video.positions = {{{0, 0, 0}}, {{1, 2, 4}}, {{3, 2, 4}}};
  EXPECT_TRUE(SkinPositionsAt(video, 0.25)[0].isApprox(Vec3f(0.25F, 0.5F, 1)));
  EXPECT_TRUE(SkinPositionsAt(video, 1.5)[0].isApprox(Vec3f(2, 2, 4)));
  EXPECT_TRUE(SkinPositionsAt(video, 9)[0].isApprox(Vec3f(3, 2, 4)));
  EXPECT_TRUE(SkinPositionsAt(video, -1)[0].isZero());
  EXPECT_TRUE(NormalPositionsAt(video, 1).empty());
}

TEST(SkinPositionsAtTest, PosesTurnOnTheGreatCircle) {
  RelightableVideo video;
  video.actor.emplace();
  video.actor->skeleton.joints = {Joint{.name = "pelvis", .parent = -1, .offset = Vec3d(0, 0, 1)}};
  video.actor->skin.positions = {{1, 0, 1}};
  video.actor->joint_indices = {{0, 0, 0, 0}};
  video.actor->joint_weights = {{1, 0, 0, 0}};
  Pose a;
  a.root_translation = Vec3d(0, 0, 1);
  Pose b = a;
  b.root_translation = Vec3d(0, 0, 2);
  b.root_rotation = Quatd(Eigen::AngleAxisd(1.2, Vec3d::UnitZ()));
  video.motion.poses = {a, b};
  const Vec3f x = SkinPositionsAt(video, 0.25)[0];
  EXPECT_NEAR(x.x(), std::cos(0.3), 1e-6);
  EXPECT_NEAR(x.y(), std::sin(0.3), 1e-6);
  EXPECT_NEAR(x.z(), 1.25, 1e-6);
}

}  // namespace
}  // namespace dyxel
