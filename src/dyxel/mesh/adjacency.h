// Edges of a triangle mesh: who lies across each of them.
#pragma once

#include <span>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel {

// For each triangle (F) and edge e (from corner e to corner (e + 1) % 3) the half-edge
// 3 * triangle + edge on the other side, or -1 at a border and where more than two triangles meet.
[[nodiscard]] std::vector<std::array<int, 3>> OppositeHalfEdges(std::span<const Triangle> triangles,
                                                                int num_vertices);

// The vertices that share an edge with each vertex, once each and ascending, packed: those of v
// are index[begin[v] .. begin[v + 1]).
struct VertexNeighbours {
  std::vector<int> begin;  // (V + 1)
  std::vector<int> index;
};
[[nodiscard]] VertexNeighbours NeighboursOfVertices(std::span<const Triangle> triangles,
                                                    int num_vertices);

}  // namespace dyxel
