// Half-edges of an indexed triangle mesh, and cutting it open along chosen edges.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel::internal {

// Half-edge h = 3·t + k runs from vertex k to vertex k + 1 (mod 3) of triangle t.
[[nodiscard]] inline int NextInTriangle(int h) { return h % 3 == 2 ? h - 2 : h + 1; }
[[nodiscard]] inline int PreviousInTriangle(int h) { return h % 3 == 0 ? h + 2 : h - 1; }
[[nodiscard]] inline int Origin(std::span<const Triangle> triangles, int h) {
  return triangles[static_cast<std::size_t>(h / 3)][static_cast<std::size_t>(h % 3)];
}

// The opposite half-edge of each (3F), -1 at a border. Throws Error(kInput) where an edge has more
// than two triangles, or two that disagree about the outside, or an index is out of range.
[[nodiscard]] std::vector<int> FindTwins(std::span<const Triangle> triangles, int num_vertices);

// Throws Error(kInput) unless the mesh is one closed manifold piece without handles, every vertex
// in use; says what it is instead.
void RequireSphere(std::span<const Triangle> triangles,
                   std::span<const int> twins,
                   int num_vertices);

// Neighbours of each vertex over the mesh's edges, as ranges of one array.
struct VertexGraph {
  std::vector<int> begin;      // (V + 1)
  std::vector<int> neighbour;  // (2E), ascending within a vertex
  [[nodiscard]] std::span<const int> Of(int v) const {
    return std::span(neighbour).subspan(
        static_cast<std::size_t>(begin[v]),
        static_cast<std::size_t>(begin[v + 1]) - static_cast<std::size_t>(begin[v]));
  }
};
[[nodiscard]] VertexGraph MakeVertexGraph(std::span<const Triangle> triangles, int num_vertices);

// A mesh cut open: cut vertex c copies vertex[c]; the first V of them are the vertices themselves.
struct CutMesh {
  std::vector<int> vertex;          // (C)
  std::vector<Triangle> triangles;  // (F) of cut vertices, in the mesh's order
};

// `cut` (3F): nonzero where a half-edge is cut; both halves of an edge alike. A vertex has a copy
// for each fan of triangles that the cuts around it leave.
[[nodiscard]] CutMesh CutOpen(std::span<const Triangle> triangles,
                              std::span<const int> twins,
                              std::span<const char> cut,
                              int num_vertices);

// Border of a disk as a loop of vertices, the mesh to its left, from the lowest border vertex.
// Throws Error(kStage) if the mesh is no disk.
[[nodiscard]] std::vector<int> DiskBoundary(std::span<const Triangle> triangles, int num_vertices);

}  // namespace dyxel::internal
