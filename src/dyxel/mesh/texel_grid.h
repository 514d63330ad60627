// More about the texel grid of an atlas: nearest texels for gutters, neighbours across seams.
#pragma once

#include <array>
#include <vector>

#include "dyxel/mesh/atlas.h"

namespace dyxel {

// For each texel of the square (size²) the pixel of the nearest one on the surface (Euclidean; of
// several the first by row), itself where it is on the surface; -1 where the grid is empty.
// FillGutters copies along it.
[[nodiscard]] std::vector<int> NearestTexels(const TexelGrid& grid);

// The 4-neighbours of each of the K texels on the surface: left, right, above, below (index into
// the K, or -1). Inside a chart those of the grid; where the neighbour would lie across a seam, the
// texel at the same place of the seam's other side.
[[nodiscard]] std::vector<std::array<int, 4>> TexelNeighbours(const Atlas& atlas,
                                                              const TexelGrid& grid);

// The chart (connected piece of the cut surface) of each triangle, numbered from 0 in the order of
// their first triangles.
[[nodiscard]] std::vector<int> ChartOfTriangles(const Atlas& atlas);

}  // namespace dyxel
