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

// A path over inner edges between two border vertices that parts most of the `crossings` (of border
// segments), is short, and leaves two parts of some size. Vertices of the chart, ends included.
// Empty if no path parts any crossing.
[[nodiscard]] std::vector<int> FindDivision(std::span<const Vec3f> positions,
                                            std::span<const Triangle> triangles,
                                            std::span<const Vec2d> uv,
                                            std::span<const int> border,
                                            std::span<const std::array<int, 2>> crossings);

}  // namespace dyxel::internal
