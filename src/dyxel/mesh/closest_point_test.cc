#include "dyxel/mesh/closest_point.h"

#include <gtest/gtest.h>

#include "dyxel/base/random.h"

namespace dyxel {
namespace {

// Nearest point by dense sampling of the triangle: an oracle that shares nothing with the code.
float SampledDistance(const Vec3f& x, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  constexpr int kSteps = 200;
  float best = 1e9F;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps - i; ++j) {
      const float u = static_cast<float>(i) / kSteps;
      const float v = static_cast<float>(j) / kSteps;
      best = std::min(best, (x - (a + u * (b - a) + v * (c - a))).norm());
    }
  }
  return best;
}

TEST(ClosestPointOnTriangle, AgreesWithSampling) {
  Random random(3);
  const auto point = [&] { return Vec3f(random.Normal(), random.Normal(), random.Normal()); };
  for (int i = 0; i < 60; ++i) {
    const Vec3f a = point();
    const Vec3f b = point();
    const Vec3f c = point();
    const Vec3f x = 2 * point();
    const float exact = (x - ClosestPointOnTriangle(x, a, b, c)).norm();
    const float sampled = SampledDistance(x, a, b, c);
    EXPECT_LE(exact, sampled + 1e-5F);
    EXPECT_NEAR(exact, sampled, 0.03F);
  }
}

TEST(ClosestPointTree, AgreesWithAllTriangles) {
  Random random(5);
  std::vector<Vec3f> positions;
  std::vector<Triangle> triangles;
  for (int i = 0; i < 300; ++i) {
    const Vec3f centre(random.Normal(), random.Normal(), random.Normal());
    for (int k = 0; k < 3; ++k) {
      positions.push_back(centre + 0.1F * Vec3f(random.Normal(), random.Normal(), random.Normal()));
    }
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const ClosestPointTree tree(positions, triangles);
  for (int i = 0; i < 200; ++i) {
    const Vec3f x(random.Normal(), random.Normal(), random.Normal());
    float best = 1e9F;
    for (const Triangle& t : triangles) {
      best = std::min(
          best,
          (x - ClosestPointOnTriangle(x, positions[t[0]], positions[t[1]], positions[t[2]]))
              .norm());
    }
    EXPECT_NEAR(tree.Find(x).distance, best, 1e-6F);
    EXPECT_EQ(tree.Find(x, /*guess=*/i).triangle, tree.Find(x).triangle);
  }
  EXPECT_EQ(ClosestPointTree({}, {}).Find(Vec3f::Zero()).triangle, -1);
}

}  // namespace
}  // namespace dyxel
