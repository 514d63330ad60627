// Splits a piece of surface in two where that makes it flatter.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel::internal {

// `chart` lists triangles; `opposite` are the half-edges across which charts hang together (-1:
// cut). Returns the connected parts of the two sides, at least two of them: by the side that the
// smoothed normals face where the surface turns, else across its length. Small islands go to their
// surroundings.
[[nodiscard]] std::vector<std::vector<int>> SplitChart(std::span<const Vec3f> positions,
                                                       std::span<const Triangle> triangles,
                                                       std::span<const std::array<int, 3>> opposite,
                                                       std::span<const int> chart,
                                                       bool across = false);

// Connected parts of a list of triangles, each ascending, in the order of their first triangles.
[[nodiscard]] std::vector<std::vector<int>> ConnectedParts(
    std::span<const std::array<int, 3>> opposite, std::span<const int> chart, int num_triangles);

}  // namespace dyxel::internal
