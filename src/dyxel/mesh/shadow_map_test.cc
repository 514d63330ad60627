#include "dyxel/mesh/shadow_map.h"

#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/random.h"
#include "dyxel/mesh/test_meshes.h"

namespace dyxel {
namespace {

const Vec3f kBall(0.1F, -0.2F, 1.0F);
constexpr float kRadius = 0.3F;

TriangleMesh BallOverFloor() {
  TriangleMesh mesh = MakeSquare(0, 2, 40);
  Append(mesh, MakeSphere(kBall, kRadius, 128));
  return mesh;
}

// Distance of the ball's centre from the ray from x along d, or infinity where it lies behind.
float Clearance(const Vec3f& x, const Vec3f& d) {
  const float along = (kBall - x).dot(d);
  return along > 0 ? (kBall - x - along * d).norm() : 1e9F;
}

template <class ToLight>
void CheckBallOverFloor(const ShadowMap& map, const ToLight& to_light) {
  Random random(1);
  int lit = 0;
  int dark = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3f x(4 * random.Uniform() - 2, 4 * random.Uniform() - 2, 0);
    const float clearance = Clearance(x, to_light(x));
    if (std::abs(clearance - kRadius) < 0.015F) continue;  // the penumbra of the filter
    const bool expected = clearance > kRadius;
    ASSERT_EQ(map.Visible(x, Vec3f::UnitZ()), expected ? 1.0F : 0.0F) << x.transpose();
    (expected ? lit : dark) += 1;
  }
  EXPECT_GT(lit, 5000);
  EXPECT_GT(dark, 200);
  // The ball itself: its day side is lit, without acne, its night side dark.
  for (int i = 0; i < 20000; ++i) {
    const Vec3f n = Vec3f(random.Normal(), random.Normal(), random.Normal()).normalized();
    const Vec3f x = kBall + kRadius * n;
    const float cosine = n.dot(to_light(x));
    if (std::abs(cosine) < 0.15F) continue;
    ASSERT_EQ(map.Visible(x, n), cosine > 0 ? 1.0F : 0.0F) << n.transpose();
  }
}

TEST(ShadowMapTest, BallOverFloorFromAPoint) {
  const TriangleMesh mesh = BallOverFloor();
  const Vec3f eye(1.5F, 2, 4);
  const ShadowMap map = ShadowMap::FromPoint(eye, mesh.positions, mesh.triangles, 1024);
  CheckBallOverFloor(map, [&](const Vec3f& x) { return Vec3f((eye - x).normalized()); });
}

TEST(ShadowMapTest, BallOverFloorFromADirection) {
  const TriangleMesh mesh = BallOverFloor();
  const Vec3f to_light = Vec3f(-0.5F, 0.3F, 0.8F).normalized();
  const ShadowMap map = ShadowMap::FromDirection(to_light, mesh.positions, mesh.triangles, 1024);
  CheckBallOverFloor(map, [&](const Vec3f&) { return to_light; });
}

TEST(ShadowMapTest, SlantedFloorHasNoAcneAndEdgesArePartial) {
  const TriangleMesh mesh = BallOverFloor();
  const Vec3f low(4, 0, 0.4F);  // 6° to 10° above the floor
  const ShadowMap map = ShadowMap::FromPoint(low, mesh.positions, mesh.triangles, 1024);
  Random random(2);
  for (int i = 0; i < 5000; ++i) {
    const Vec3f x(3.8F * random.Uniform() - 1.9F, 3.8F * random.Uniform() - 1.9F, 0);
    EXPECT_EQ(map.Visible(x, Vec3f::UnitZ()), 1.0F) << x.transpose();  // the ball hangs above
  }
  const ShadowMap above =
      ShadowMap::FromDirection(Vec3f::UnitZ(), mesh.positions, mesh.triangles, 1024);
  int partial = 0;
  for (int i = 0; i < 5000; ++i) {
    const float angle = 2 * kPi * random.Uniform();
    const Vec3f x(kBall.x() + kRadius * std::cos(angle), kBall.y() + kRadius * std::sin(angle), 0);
    const float share = above.Visible(x, Vec3f::UnitZ());
    partial += share > 0 && share < 1 ? 1 : 0;
  }
  EXPECT_GT(partial, 2500);
}

TEST(ShadowMapTest, NoSurfaceLetsAllLightThrough) {
  const ShadowMap map = ShadowMap::FromPoint(Vec3f::Zero(), {}, {}, 64);
  EXPECT_EQ(map.Visible({1, 2, 3}, Vec3f::UnitZ()), 1.0F);
}

}  // namespace
}  // namespace dyxel
