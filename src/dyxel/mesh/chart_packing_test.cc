#include "dyxel/mesh/chart_packing.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace dyxel::internal {
namespace {

std::vector<Vec2d> Rectangle(double width, double height) {
  return {{0, 0}, {width, 0}, {width, height}, {0, height}};
}

std::vector<Vec2d> Placed(const std::vector<Vec2d>& border, const Packing& packing, int chart) {
  const ChartPlace& place = packing.places[chart];
  const Eigen::Rotation2Dd turn(place.angle);
  std::vector<Vec2d> placed;
  for (const Vec2d& p : border) {
    placed.emplace_back(packing.texels_per_unit * (turn * p) + place.offset);
  }
  return placed;
}

TEST(PackCharts, KeepsTheGutterAndFillsWithSquares) {
  const std::vector<std::vector<Vec2d>> borders(4, Rectangle(1, 1));
  constexpr int kSize = 512, kGutter = 4;
  const Packing packing = PackCharts(borders, kSize, kGutter, 400);
  // Four squares and three gutters across.
  EXPECT_GT(packing.texels_per_unit, 0.98 * (kSize - 3 * kGutter) / 2.0);
  std::vector<Vec2d> low, high;
  for (int i = 0; i < 4; ++i) {
    const std::vector<Vec2d> placed = Placed(borders[i], packing, i);
    low.push_back(placed[0]);
    high.push_back(placed[0]);
    for (const Vec2d& p : placed) {
      low[i] = low[i].cwiseMin(p);
      high[i] = high[i].cwiseMax(p);
    }
    EXPECT_GE(low[i].minCoeff(), kGutter - 1e-4);
    EXPECT_LE(high[i].maxCoeff(), kSize - kGutter + 1e-4);
    for (int j = 0; j < i; ++j) {
      const Vec2d gap = (low[i] - high[j]).cwiseMax(low[j] - high[i]);
      EXPECT_GE(gap.maxCoeff(), kGutter - 1e-4);
    }
  }
}

TEST(PackCharts, IsTheSameEachTime) {
  const std::vector<std::vector<Vec2d>> borders = {
      Rectangle(3, 1), Rectangle(1, 1), Rectangle(2, 0.5), Rectangle(1, 0.3)};
  const Packing a = PackCharts(borders, 256, 2, 200), b = PackCharts(borders, 256, 2, 200);
  EXPECT_EQ(a.texels_per_unit, b.texels_per_unit);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(a.places[i].offset, b.places[i].offset);
}

}  // namespace
}  // namespace dyxel::internal
