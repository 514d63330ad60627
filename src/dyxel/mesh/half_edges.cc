#include "dyxel/mesh/half_edges.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>

#include "dyxel/base/error.h"
#include "dyxel/mesh/adjacency.h"

namespace dyxel::internal {
namespace {

struct DisjointSets {
  std::vector<int> parent;
  explicit DisjointSets(int n) : parent(static_cast<std::size_t>(n)) {
    std::iota(parent.begin(), parent.end(), 0);
  }
  int Find(int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  }
  // The lower index becomes the root, so that the result does not depend on the order of unions.
  void Join(int a, int b) {
    a = Find(a);
    b = Find(b);
    parent[std::max(a, b)] = std::min(a, b);
  }
};

}  // namespace

std::vector<int> FindTwins(std::span<const Triangle> triangles, int num_vertices) {
  const int n = static_cast<int>(3 * triangles.size());
  // Half-edges in order of their lower vertex (counting sort), then of the higher one.
  struct Key {
    int high, half_edge;
  };
  std::vector<int> begin(static_cast<std::size_t>(num_vertices) + 1, 0);
  const auto ends = [&](int h) {
    return std::minmax({Origin(triangles, h), Origin(triangles, NextInTriangle(h))});
  };
  for (int h = 0; h < n; ++h) {
    const int a = Origin(triangles, h), b = Origin(triangles, NextInTriangle(h));
    Require(a >= 0 && a < num_vertices && b >= 0 && b < num_vertices && a != b,
            Fault::kInput,
            "triangle {} has vertex {} of {}, or one vertex twice: clean the mesh first",
            h / 3,
            a,
            num_vertices);
    ++begin[ends(h).first + 1];
  }
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<Key> keys(static_cast<std::size_t>(n));
  std::vector<int> fill(begin.begin(), begin.end() - 1);
  for (int h = 0; h < n; ++h) keys[fill[ends(h).first]++] = {ends(h).second, h};
  std::vector<int> twins(static_cast<std::size_t>(n), -1);
  for (int v = 0; v < num_vertices; ++v) {
    std::sort(keys.begin() + begin[v], keys.begin() + begin[v + 1], [](const Key& a, const Key& b) {
      return a.high != b.high ? a.high < b.high : a.half_edge < b.half_edge;
    });
    for (int i = begin[v], j = i; i < begin[v + 1]; i = j) {
      while (j < begin[v + 1] && keys[j].high == keys[i].high) ++j;
      Require(j - i <= 2,
              Fault::kInput,
              "edge {}-{} has {} triangles, so the skin is no manifold: remesh it",
              v,
              keys[i].high,
              j - i);
      if (j - i < 2) continue;
      const int g = keys[i].half_edge, h = keys[i + 1].half_edge;
      Require(Origin(triangles, g) != Origin(triangles, h),
              Fault::kInput,
              "triangles {} and {} disagree about the outside at edge {}-{}: make the skin's "
              "winding consistent",
              g / 3,
              h / 3,
              v,
              keys[i].high);
      twins[g] = h;
      twins[h] = g;
    }
  }
  return twins;
}

void RequireSphere(std::span<const Triangle> triangles,
                   std::span<const int> twins,
                   int num_vertices) {
  Require(!triangles.empty(), Fault::kInput, "the skin has no triangles");
  const auto open = std::count(twins.begin(), twins.end(), -1);
  Require(open == 0,
          Fault::kInput,
          "the skin is open: {} of its edges have only one triangle; close its holes, or give it "
          "as surfaces (--geometry)",
          open);
  const int num_triangles = static_cast<int>(triangles.size());
  DisjointSets pieces(num_triangles);
  DisjointSets fans(static_cast<int>(twins.size()));
  for (int h = 0; h < static_cast<int>(twins.size()); ++h) {
    pieces.Join(h / 3, twins[h] / 3);
    fans.Join(h, NextInTriangle(twins[h]));
  }
  int num_pieces = 0, num_fans = 0;
  for (int t = 0; t < num_triangles; ++t) num_pieces += pieces.Find(t) == t ? 1 : 0;
  for (int h = 0; h < static_cast<int>(twins.size()); ++h) num_fans += fans.Find(h) == h ? 1 : 0;
  Require(num_pieces == 1,
          Fault::kInput,
          "the skin is in {} pieces: give the body's skin as one closed piece",
          num_pieces);
  Require(num_fans == num_vertices,
          Fault::kInput,
          "the skin has {} vertices, of which its triangles make {}: a vertex is unused, or two "
          "parts touch in one; weld or remesh it",
          num_vertices,
          num_fans);
  const int euler = num_vertices - num_triangles / 2;  // V - E + F with E = 3F / 2
  Require(euler == 2,
          Fault::kInput,
          "the skin has {} handles (genus; Euler number {}), so one seam cannot flatten it: close "
          "them, such as limbs that are fused with the body",
          (2 - euler) / 2,
          euler);
}

VertexGraph MakeVertexGraph(std::span<const Triangle> triangles, int num_vertices) {
  VertexNeighbours neighbours = NeighboursOfVertices(triangles, num_vertices);
  return {std::move(neighbours.begin), std::move(neighbours.index)};
}

CutMesh CutOpen(std::span<const Triangle> triangles,
                std::span<const int> twins,
                std::span<const char> cut,
                int num_vertices) {
  // A corner is named by the half-edge that starts there.
  const int num_corners = static_cast<int>(twins.size());
  DisjointSets corners(num_corners);
  for (int h = 0; h < num_corners; ++h) {
    if (twins[h] < 0 || cut[h]) continue;
    corners.Join(h, NextInTriangle(twins[h]));
  }
  CutMesh mesh;
  mesh.vertex.resize(static_cast<std::size_t>(num_vertices));
  std::iota(mesh.vertex.begin(), mesh.vertex.end(), 0);
  mesh.triangles.resize(triangles.size());
  std::vector<char> taken(static_cast<std::size_t>(num_vertices), 0);
  std::vector<int> copy_of(static_cast<std::size_t>(num_corners), -1);
  for (int h = 0; h < num_corners; ++h) {
    const int root = corners.Find(h);
    if (root == h) {
      const int v = Origin(triangles, h);
      if (taken[v]) {
        copy_of[h] = static_cast<int>(mesh.vertex.size());
        mesh.vertex.push_back(v);
      } else {
        taken[v] = 1;
        copy_of[h] = v;
      }
    }
    mesh.triangles[static_cast<std::size_t>(h / 3)][static_cast<std::size_t>(h % 3)] =
        copy_of[root];
  }
  return mesh;
}

std::vector<int> DiskBoundary(std::span<const Triangle> triangles, int num_vertices) {
  const std::vector<int> twins = FindTwins(triangles, num_vertices);
  std::vector<int> next(static_cast<std::size_t>(num_vertices), -1);
  int num_border = 0, first = num_vertices;
  for (int h = 0; h < static_cast<int>(twins.size()); ++h) {
    if (twins[h] >= 0) continue;
    const int v = Origin(triangles, h);
    Require(next[v] < 0, Fault::kStage, "the cut surface is pinched at vertex {}", v);
    next[v] = Origin(triangles, NextInTriangle(h));
    first = std::min(first, v);
    ++num_border;
  }
  std::vector<int> loop;
  for (int v = first; num_border > 0; v = next[v]) {
    loop.push_back(v);
    if (next[v] == first || static_cast<int>(loop.size()) > num_border) break;
  }
  const int edges = (static_cast<int>(twins.size()) + num_border) / 2;
  const int euler = num_vertices - edges + static_cast<int>(triangles.size());
  Require(num_border > 0 && static_cast<int>(loop.size()) == num_border && euler == 1,
          Fault::kStage,
          "the cut surface is no disk: Euler number {}, {} border edges in loops of {}",
          euler,
          num_border,
          loop.size());
  return loop;
}

}  // namespace dyxel::internal
