// Cuts along edges of the skin: marking them, and slits to fingers.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dyxel/mesh/half_edges.h"

namespace dyxel::internal {

// Length of each edge of the graph (2E), aligned with graph.neighbour.
[[nodiscard]] std::vector<float> EdgeLengths(const VertexGraph& graph,
                                             std::span<const Vec3f> positions);

// Sets `cut` (3F) on both half-edges of each edge, given by its two vertices.
void MarkCut(std::span<const Triangle> triangles,
             std::span<const int> twins,
             const VertexGraph& graph,
             std::span<const std::array<int, 2>> edges,
             std::span<char> cut);

// Joins each of `tips` to the nearest cut by the path of least cost.
void CutSlits(const VertexGraph& graph,
              std::span<const float> cost,
              std::span<const int> tips,
              std::span<const Triangle> triangles,
              std::span<const int> twins,
              std::span<char> cut);

}  // namespace dyxel::internal
