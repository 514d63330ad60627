// Charts that overlap themselves: where their borders cross, and the cut that parts them.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel::internal {

// Pairs (i, j), i < j, of segments i, i + 1 and j, j + 1 of a closed polygon that cross or touch,
// neighbours left out. A map of a disk without flips overlaps itself just where its border does.
[[nodiscard]] std::vector<std::array<int, 2>> BorderCrossings(std::span<const Vec2d> border);

// Two border vertices between which a path over inner edges parts most of the `crossings` (of
// border segments), is short, and leaves two parts of some size; -1 if none parts any crossing.
[[nodiscard]] std::array<int, 2> FindDivision(std::span<const Vec3f> positions,
                                              std::span<const Triangle> triangles,
                                              std::span<const Vec2d> uv,
                                              std::span<const int> border,
                                              std::span<const std::array<int, 2>> crossings);

// The shortest path over inner edges between two border vertices that touches the border only in
// them; both included. Empty if there is none.
[[nodiscard]] std::vector<int> PathAcross(std::span<const Vec3f> positions,
                                          std::span<const Triangle> triangles,
                                          std::span<const int> border,
                                          const std::array<int, 2>& ends);

// The cut that makes a chart pack better: between two border points that see each other in the
// plane, least area of the two parts' convex hulls together, against the chart's own.
struct TighterDivision {
  double saved = 0;       // area of the hulls saved, less a little for the cut's length
  std::vector<int> path;  // vertices of the chart, ends included; empty if nothing is saved
};
[[nodiscard]] TighterDivision FindTighterDivision(std::span<const Vec3f> positions,
                                                  std::span<const Triangle> triangles,
                                                  std::span<const Vec2d> uv,
                                                  std::span<const int> border);

}  // namespace dyxel::internal
