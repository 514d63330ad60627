#include "dyxel/mesh/texel_grid.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/random.h"
#include "dyxel/mesh/test_meshes.h"

namespace dyxel {
namespace {

TEST(TexelGridTest, BarycentricsGiveTheTexelsCentreBack) {
  const Tube tube = MakeTube(13, 7, 128);
  const TexelGrid grid = MakeTexelGrid(tube.atlas);
  EXPECT_EQ(grid.count(), 64U * 64U);  // the middle half of the texture
  for (std::size_t k = 0; k < grid.count(); ++k) {
    const Triangle& t = tube.atlas.triangles[static_cast<std::size_t>(grid.triangle[k])];
    Vec2f uv = Vec2f::Zero();
    for (std::size_t c = 0; c < 3; ++c) {
      uv += tube.atlas.uv_i[static_cast<std::size_t>(t[c])] * grid.bary[k][static_cast<int>(c)];
    }
    const Vec2f centre(static_cast<float>(grid.pixel[k] % 128) + 0.5F,
                       static_cast<float>(grid.pixel[k] / 128) + 0.5F);
    ASSERT_TRUE((uv * 128).isApprox(centre, 1e-4F));
    ASSERT_GE(grid.bary[k].minCoeff(), 0);
    ASSERT_EQ(grid.texel_at[static_cast<std::size_t>(grid.pixel[k])], static_cast<int>(k));
    if (k > 0) {
      ASSERT_GT(grid.pixel[k], grid.pixel[k - 1]);
    }
  }
}

TEST(TexelGridTest, OverlapGoesToTheLowerTriangle) {
  Atlas atlas;
  atlas.size = 16;
  atlas.skin_vertex = {0, 1, 2, 3};
  atlas.uv_i = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  atlas.triangles = {{0, 1, 3}, {0, 1, 2}, {0, 3, 2}};
  const TexelGrid grid = MakeTexelGrid(atlas);
  EXPECT_EQ(grid.count(), 256U);
  EXPECT_EQ(grid.triangle[static_cast<std::size_t>(grid.texel_at[15])], 0);
  EXPECT_EQ(grid.triangle[static_cast<std::size_t>(grid.texel_at[7 * 16 + 7])], 0);  // on an edge
  EXPECT_THAT(grid.triangle, testing::Contains(1));
}

TEST(TexelGridTest, SecondParameterizationFollowsTheSameBarycentrics) {
  Tube tube = MakeTube(8, 8, 64);
  tube.atlas.uv_ii = tube.atlas.uv_i;
  for (Vec2f& uv : tube.atlas.uv_ii) uv = Vec2f(1 - uv.y(), 2 * uv.x());
  const TexelGrid grid = MakeTexelGrid(tube.atlas);
  const std::vector<Vec2f> second = TexelsInSecond(tube.atlas, grid);
  for (std::size_t k = 0; k < grid.count(); ++k) {
    const float u = (static_cast<float>(grid.pixel[k] % 64) + 0.5F) / 64;
    const float v = (static_cast<float>(grid.pixel[k] / 64) + 0.5F) / 64;
    ASSERT_TRUE(second[k].isApprox(Vec2f(1 - v, 2 * u), 1e-4F));
  }
}

TEST(TexelGridTest, GuttersTakeTheNearestTexel) {
  TexelGrid grid;
  grid.size = 48;
  grid.texel_at.assign(48 * 48, -1);
  Random random(3);
  for (int i = 0; i < 40; ++i) grid.texel_at[random.Below(48 * 48)] = 0;
  for (int at = 0; at < 48 * 48; ++at) {
    if (grid.texel_at[static_cast<std::size_t>(at)] < 0) continue;
    grid.texel_at[static_cast<std::size_t>(at)] = static_cast<int>(grid.pixel.size());
    grid.pixel.push_back(at);
  }
  grid.nearest = NearestTexels(grid);
  ImageF map(48, 48, 2, -1.0F);
  for (const int at : grid.pixel) {
    map.At(at % 48, at / 48, 0) = static_cast<float>(at % 48);
    map.At(at % 48, at / 48, 1) = static_cast<float>(at / 48);
  }
  FillGutters(grid, map);
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 48; ++x) {
      float nearest = 1e9F;
      for (const int at : grid.pixel) {
        nearest = std::min(
            nearest, std::hypot(static_cast<float>(at % 48 - x), static_cast<float>(at / 48 - y)));
      }
      const float found = std::hypot(map.At(x, y, 0) - static_cast<float>(x),
                                     map.At(x, y, 1) - static_cast<float>(y));
      ASSERT_NEAR(found, nearest, 1e-4) << x << ", " << y;
    }
  }
}

TEST(TexelNeighboursTest, AreOneTexelAwayOnTheSurfaceAlsoAcrossTheSeam) {
  // 256 texels around a unit tube cut open: a neighbour is 2π/256 away, over the seam up to twice.
  const Tube tube = MakeTube(24, 6, 512);
  const TexelGrid grid = MakeTexelGrid(tube.atlas);
  const auto neighbours = TexelNeighbours(tube.atlas, grid);
  ASSERT_EQ(neighbours.size(), grid.count());
  const auto around = [&](int k) { return grid.pixel[static_cast<std::size_t>(k)] % 512 - 128; };
  const auto row = [&](int k) { return grid.pixel[static_cast<std::size_t>(k)] / 512 - 128; };
  int over_seam = 0;
  for (std::size_t k = 0; k < neighbours.size(); ++k) {
    const int x = around(static_cast<int>(k));
    const int y = row(static_cast<int>(k));
    const auto& [left, right, above, below] = neighbours[k];
    ASSERT_GE(left, 0);
    ASSERT_GE(right, 0);
    over_seam += x == 0 || x == 255 ? 1 : 0;
    EXPECT_EQ(around(left), (x + 255) % 256);
    EXPECT_EQ(around(right), (x + 1) % 256);
    EXPECT_EQ(row(left), y);
    EXPECT_EQ(row(right), y);
    EXPECT_EQ(above < 0, y == 0);  // the tube's ends are open
    EXPECT_EQ(below < 0, y == 255);
  }
  EXPECT_EQ(over_seam, 512);
}

}  // namespace
}  // namespace dyxel
