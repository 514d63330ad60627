#include "dyxel/mesh/rasterizer.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/parallel.h"
#include "dyxel/base/random.h"

namespace dyxel {
namespace {

struct Scene {
  std::vector<ScreenVertex> vertices;
  std::vector<Triangle> triangles;
};

Scene RandomTriangles(int count, int width, int height, float extent, std::uint64_t seed) {
  Random random(seed);
  Scene scene;
  for (int i = 0; i < count; ++i) {
    const float x = (1.4F * random.Uniform() - 0.2F) * static_cast<float>(width);
    const float y = (1.4F * random.Uniform() - 0.2F) * static_cast<float>(height);
    for (int c = 0; c < 3; ++c) {
      scene.vertices.push_back({x + extent * (random.Uniform() - 0.5F),
                                y + extent * (random.Uniform() - 0.5F),
                                0.1F + random.Uniform()});
    }
    scene.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return scene;
}

// The nearest triangle and inverse depth at a pixel's centre, in double; `margin` the least
// distance (pixels, or relative depth) by which the decision could have gone another way.
struct Reference {
  int triangle = -1;
  double inverse_depth = 0;
  double margin = 1e9;
};
Reference ReferenceAt(const Scene& scene, int x, int y) {
  Reference best;
  const Vec2d p(x + 0.5, y + 0.5);
  for (std::size_t f = 0; f < scene.triangles.size(); ++f) {
    std::array<Vec2d, 3> corner;
    Vec3d w;
    bool behind = false;
    for (std::size_t c = 0; c < 3; ++c) {
      const ScreenVertex& v = scene.vertices[static_cast<std::size_t>(scene.triangles[f][c])];
      corner[c] = Vec2d(v.x, v.y);
      w[static_cast<int>(c)] = v.inverse_depth;
      behind |= v.inverse_depth <= 0;
    }
    if (behind) continue;
    const auto cross = [](const Vec2d& a, const Vec2d& b) { return a.x() * b.y() - a.y() * b.x(); };
    const double area = cross(corner[1] - corner[0], corner[2] - corner[0]);
    double inside = 1e9;  // distance to the nearest side's line, negative outside
    Vec3d bary;
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec2d& a = corner[(c + 1) % 3];
      const Vec2d& b = corner[(c + 2) % 3];
      const double e = cross(b - a, p - a) * (area > 0 ? 1 : -1);
      inside = std::min(inside, e / (b - a).norm());
      bary[static_cast<int>(c)] = e / std::abs(area);
    }
    best.margin = std::min(best.margin, std::abs(inside));
    if (inside < 0) continue;
    const double depth = bary.dot(w);
    if (best.triangle >= 0) {
      best.margin = std::min(best.margin, 100 * std::abs(depth - best.inverse_depth));
    }
    if (depth > best.inverse_depth) {
      best.inverse_depth = depth;
      best.triangle = static_cast<int>(f);
    }
  }
  return best;
}

void ExpectLikeReference(const Scene& scene, int width, int height) {
  const VisibilityBuffer buffer = Rasterize(scene.vertices, scene.triangles, width, height);
  ASSERT_EQ(buffer.triangle.size(), static_cast<std::size_t>(width * height));
  ASSERT_EQ(buffer.inverse_depth.size(), static_cast<std::size_t>(width * height));
  EXPECT_EQ(RasterizeDepth(scene.vertices, scene.triangles, width, height), buffer.inverse_depth);
  int compared = 0;
  int covered = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Reference expected = ReferenceAt(scene, x, y);
      if (expected.margin < 1e-3) continue;
      const auto at = static_cast<std::size_t>(y * width + x);
      ++compared;
      covered += expected.triangle >= 0 ? 1 : 0;
      ASSERT_EQ(buffer.triangle[at], expected.triangle) << x << ", " << y;
      ASSERT_NEAR(buffer.inverse_depth[at], expected.inverse_depth, 1e-4) << x << ", " << y;
    }
  }
  EXPECT_GT(compared, width * height * 8 / 10);
  EXPECT_GT(covered, 0);
}

TEST(RasterizeTest, AgreesWithAPlainReference) {
  ExpectLikeReference(RandomTriangles(300, 101, 75, 30, 1), 101, 75);
  ExpectLikeReference(RandomTriangles(2000, 101, 75, 4, 2), 101, 75);   // small ones
  ExpectLikeReference(RandomTriangles(20, 101, 75, 1000, 3), 101, 75);  // larger than the picture
  ExpectLikeReference(RandomTriangles(40, 5, 7, 6, 4), 5, 7);           // narrower than a register
}

TEST(RasterizeTest, NeighboursLeaveNoCrackAndNoOverlap) {
  // A grid of jittered corners, some of them exactly on pixel centres: all of its inside is
  // covered, at the depth of its plane.
  Random random(5);
  const int n = 40;
  Scene scene;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      float x = static_cast<float>(i) * 3.7F + random.Uniform() * 3;
      float y = static_cast<float>(j) * 3.7F + random.Uniform() * 3;
      if (random.Uniform() < 0.3F) {
        x = std::floor(x) + 0.5F;
        y = std::floor(y) + 0.5F;
      }
      scene.vertices.push_back({x, y, 1});
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const int at = j * (n + 1) + i;
      scene.triangles.push_back({at, at + 1, at + n + 2});
      scene.triangles.push_back({at + n + 1, at, at + n + 2});
    }
  }
  const VisibilityBuffer buffer = Rasterize(scene.vertices, scene.triangles, 150, 150);
  for (int y = 4; y < 146; ++y) {
    for (int x = 4; x < 146; ++x) {
      ASSERT_GE(buffer.triangle[static_cast<std::size_t>(y * 150 + x)], 0) << x << ", " << y;
      ASSERT_EQ(buffer.inverse_depth[static_cast<std::size_t>(y * 150 + x)], 1);
    }
  }
}

TEST(RasterizeTest, SameForAnyNumberOfThreadsAndTiesGoToTheLowerIndex) {
  Scene scene = RandomTriangles(3000, 200, 300, 20, 6);
  for (ScreenVertex& v : scene.vertices) v.inverse_depth = 1;
  SetJobs(1);
  const VisibilityBuffer one = Rasterize(scene.vertices, scene.triangles, 200, 300);
  SetJobs(4);
  const VisibilityBuffer four = Rasterize(scene.vertices, scene.triangles, 200, 300);
  SetJobs(0);
  EXPECT_EQ(one.triangle, four.triangle);
  EXPECT_EQ(one.inverse_depth, four.inverse_depth);
  std::reverse(scene.triangles.begin(), scene.triangles.end());
  const VisibilityBuffer reversed = Rasterize(scene.vertices, scene.triangles, 200, 300);
  int higher = 0;
  for (std::size_t at = 0; at < one.triangle.size(); ++at) {
    if (one.triangle[at] < 0) continue;
    higher += 2999 - reversed.triangle[at] > one.triangle[at] ? 1 : 0;
    EXPECT_GE(2999 - reversed.triangle[at], one.triangle[at]);
  }
  EXPECT_GT(higher, 100);
}

TEST(RasterizeTest, DropsWhatIsBehindTheEyeOrHasNoSize) {
  Scene scene;
  const float nan = std::nanf("");
  scene.vertices = {{0, 0, 1}, {9, 0, 1}, {0, 9, 1}, {0, 9, -1}, {nan, 3, 1}, {1e30F, 0, 1}};
  scene.triangles = {{0, 1, 3}, {0, 0, 1}, {0, 1, 4}, {0, 2, 5}};
  const VisibilityBuffer buffer = Rasterize(scene.vertices, {&scene.triangles[0], 3}, 10, 10);
  for (const int t : buffer.triangle) EXPECT_EQ(t, -1);
  const VisibilityBuffer far = Rasterize(scene.vertices, scene.triangles, 10, 10);  // no crash
  EXPECT_EQ(far.triangle.size(), 100U);
  EXPECT_TRUE(Rasterize({}, {}, 0, 0).triangle.empty());
}

TEST(PerspectiveBarycentricsTest, FindThePointOfTheTriangleInSpace) {
  const std::array<Vec3f, 3> corner = {Vec3f(-1, -1, 2), Vec3f(1.5F, -0.5F, 5), Vec3f(0, 2, 3)};
  const Vec3f weight(0.5F, 0.2F, 0.3F);
  std::array<ScreenVertex, 3> screen;
  Vec3f point = Vec3f::Zero();
  for (std::size_t c = 0; c < 3; ++c) {
    point += weight[static_cast<int>(c)] * corner[c];
    screen[c] = {100 * corner[c].x() / corner[c].z(),
                 100 * corner[c].y() / corner[c].z(),
                 1 / corner[c].z()};
  }
  const Vec3f found = PerspectiveBarycentrics(screen[0],
                                              screen[1],
                                              screen[2],
                                              100 * point.x() / point.z() - 0.5F,
                                              100 * point.y() / point.z() - 0.5F);
  EXPECT_TRUE(found.isApprox(weight, 1e-4F)) << found.transpose();
}

}  // namespace
}  // namespace dyxel
