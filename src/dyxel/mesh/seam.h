// The seam of a closed skin: extremities joined along hidden ground; docs/method.md (A1).
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dyxel/math/types.h"
#include "dyxel/mesh/half_edges.h"

namespace dyxel::internal {

// Distance from the sources over the graph's edges, `cost` (2E) aligned with graph.neighbour;
// infinity where blocked. `parent` gives the vertex before each, -1 at a source and where not
// reached. Stops once `target` is settled if that is >= 0.
struct Paths {
  std::vector<float> distance;  // (V)
  std::vector<int> parent;      // (V)
};
[[nodiscard]] Paths ShortestPaths(const VertexGraph& graph,
                                  std::span<const float> cost,
                                  std::span<const int> sources,
                                  std::span<const char> blocked = {},
                                  int target = -1);

// Vertices where the geodesic distance from the skin's middle peaks, and by how much (the peak's
// height over the pass to a higher one, as a share of the greatest distance), highest first. The
// farthest vertex has prominence 1.
struct Extremity {
  int vertex = -1;
  float prominence = 0;
};
[[nodiscard]] std::vector<Extremity> FindExtremities(const VertexGraph& graph,
                                                     std::span<const float> length);

// A tree of edges over the skin that reaches the extremities.
struct Seam {
  std::vector<std::array<int, 2>> edges;
  std::vector<int> terminals;  // reached, first two first
};

// Joins `terminals` by paths of least cost. The tree is an induced one: no edge of the mesh joins
// two of its vertices but its own edges. Then no triangle of the cut disk has all three corners on
// the border, and no inner edge joins two border vertices, which is what Tutte's embedding with a
// straight-sided border needs. Terminals that cannot be joined so are left out.
[[nodiscard]] Seam JoinInduced(const VertexGraph& graph,
                               std::span<const float> cost,
                               std::span<const int> terminals);

}  // namespace dyxel::internal
