#include "dyxel/mesh/chart_division.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/mesh/distortion.h"
#include "dyxel/mesh/half_edges.h"
#include "dyxel/mesh/triangle_mesh.h"

namespace dyxel::internal {
namespace {

// The cells (x, y) of an m × n grid for which `in` holds, two triangles each.
template <class In>
std::vector<Triangle> GridCells(int m, int n, const In& in, std::vector<std::array<int, 2>>& at) {
  std::vector<int> index((m + 1) * (n + 1), -1);
  std::vector<Triangle> triangles;
  const auto vertex = [&](int x, int y) {
    int& i = index[y * (m + 1) + x];
    if (i < 0) {
      i = static_cast<int>(at.size());
      at.push_back({x, y});
    }
    return i;
  };
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < m; ++x) {
      if (!in(x, y)) continue;
      const int a = vertex(x, y), b = vertex(x + 1, y);
      const int c = vertex(x + 1, y + 1), d = vertex(x, y + 1);
      triangles.push_back({a, b, c});
      triangles.push_back({a, c, d});
    }
  }
  return triangles;
}

TEST(BorderCrossings, AgreeWithAllPairs) {
  // A curve that crosses itself, and one that does not.
  for (const double loops : {1.0, 2.0}) {
    std::vector<Vec2d> curve;
    constexpr int kPoints = 200;
    for (int i = 0; i < kPoints; ++i) {
      const double t = 2 * kPiD * i / kPoints;
      curve.emplace_back(std::cos(t) * (1 + 0.5 * std::cos(loops * t)), std::sin(loops * t));
    }
    std::vector<std::array<int, 2>> slow;
    for (int i = 0; i < kPoints; ++i) {
      for (int j = i + 2; j < kPoints; ++j) {
        if (i == 0 && j == kPoints - 1) continue;
        Eigen::Matrix2d system;
        system << curve[i + 1] - curve[i], curve[j] - curve[(j + 1) % kPoints];
        const Vec2d x = system.inverse() * (curve[j] - curve[i]);
        if (x.minCoeff() >= 0 && x.maxCoeff() <= 1) slow.push_back({i, j});
      }
    }
    EXPECT_EQ(slow.empty(), loops == 1.0);
    EXPECT_EQ(BorderCrossings(curve), slow);
  }
}

TEST(FindDivision, PartsARingThatOverlapsItself) {
  // 1.3 turns of a ring, laid out flat: its ends lie on one another.
  std::vector<std::array<int, 2>> at;
  const std::vector<Triangle> triangles = GridCells(
      130, 8, [](int, int) { return true; }, at);
  std::vector<Vec3f> positions;
  std::vector<Vec2d> uv;
  for (const auto& p : at) {
    const double angle = 2 * kPiD * p[0] / 100, radius = 1.4 - 0.1 * p[1];
    uv.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
    positions.emplace_back(uv.back().x(), uv.back().y(), 0.01 * p[0]);
  }
  const std::vector<int> border = DiskBoundary(triangles, static_cast<int>(at.size()));
  std::vector<Vec2d> loop;
  for (const int v : border) loop.push_back(uv[v]);
  const auto crossings = BorderCrossings(loop);
  ASSERT_FALSE(crossings.empty());
  const std::array<int, 2> ends = FindDivision(positions, triangles, uv, border, crossings);
  const std::vector<int> path = PathAcross(positions, triangles, border, ends);
  ASSERT_GE(path.size(), 2U);
  // Straight across, where neither part has a whole turn.
  EXPECT_LE(path.size(), 12U);
  const double share = at[path[path.size() / 2]][0] / 130.0;
  EXPECT_GT(share, 1 - 1 / 1.3);
  EXPECT_LT(share, 1 / 1.3);
}

TEST(FindTighterDivision, CutsTheArmOffAnL) {
  // Two arms of 4 × 1: area 7, hull 11.5, and 7 once an arm is off.
  constexpr int kCells = 10;
  std::vector<std::array<int, 2>> at;
  const std::vector<Triangle> triangles = GridCells(
      4 * kCells, 4 * kCells, [](int x, int y) { return x < kCells || y < kCells; }, at);
  std::vector<Vec3f> positions;
  std::vector<Vec2d> uv;
  for (const auto& p : at) {
    uv.emplace_back(p[0] / static_cast<double>(kCells), p[1] / static_cast<double>(kCells));
    positions.emplace_back(uv.back().x(), uv.back().y(), 0);
  }
  const std::vector<int> border = DiskBoundary(triangles, static_cast<int>(at.size()));
  const TighterDivision division = FindTighterDivision(positions, triangles, uv, border);
  EXPECT_NEAR(division.saved, 4.5, 0.6);
  // One end lies near the inner corner (1, 1), the other across an arm.
  ASSERT_GE(division.path.size(), 2U);
  const double to_corner = std::min((uv[division.path.front()] - Vec2d(1, 1)).norm(),
                                    (uv[division.path.back()] - Vec2d(1, 1)).norm());
  EXPECT_LT(to_corner, 0.3);
  // A square is tight already.
  at.clear();
  const std::vector<Triangle> square = GridCells(
      8, 8, [](int, int) { return true; }, at);
  positions.clear();
  uv.clear();
  for (const auto& p : at) {
    uv.emplace_back(p[0], p[1]);
    positions.emplace_back(static_cast<float>(p[0]), static_cast<float>(p[1]), 0);
  }
  EXPECT_TRUE(
      FindTighterDivision(positions, square, uv, DiskBoundary(square, static_cast<int>(at.size())))
          .path.empty());
}

}  // namespace
}  // namespace dyxel::internal
