#include "dyxel/mesh/adjacency.h"

#include <algorithm>

namespace dyxel {

std::vector<std::array<int, 3>> OppositeHalfEdges(std::span<const Triangle> triangles,
                                                  int num_vertices) {
  // Half-edges sorted by their lower vertex (counting sort), then matched by the higher one.
  const auto count = triangles.size();
  std::vector<int> begin(static_cast<std::size_t>(num_vertices) + 1, 0);
  const auto low = [&](std::size_t f, std::size_t e) {
    return static_cast<std::size_t>(std::min(triangles[f][e], triangles[f][(e + 1) % 3]));
  };
  const auto high = [&](int half_edge) {
    const auto f = static_cast<std::size_t>(half_edge / 3);
    const auto e = static_cast<std::size_t>(half_edge % 3);
    return std::max(triangles[f][e], triangles[f][(e + 1) % 3]);
  };
  for (std::size_t f = 0; f < count; ++f) {
    for (std::size_t e = 0; e < 3; ++e) ++begin[low(f, e) + 1];
  }
  for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
  std::vector<int> sorted(3 * count);
  std::vector<int> next(begin.begin(), begin.end() - 1);
  for (std::size_t f = 0; f < count; ++f) {
    for (std::size_t e = 0; e < 3; ++e) {
      sorted[static_cast<std::size_t>(next[low(f, e)]++)] = static_cast<int>(3 * f + e);
    }
  }
  std::vector<std::array<int, 3>> opposite(count, {-1, -1, -1});
  for (std::size_t v = 0; v + 1 < begin.size(); ++v) {
    for (int i = begin[v]; i < begin[v + 1]; ++i) {
      const int half_edge = sorted[static_cast<std::size_t>(i)];
      int twin = -1;
      int matches = 0;
      for (int j = begin[v]; j < begin[v + 1]; ++j) {
        const int other = sorted[static_cast<std::size_t>(j)];
        if (j != i && high(other) == high(half_edge)) {
          twin = other;
          ++matches;
        }
      }
      if (matches == 1 && twin / 3 != half_edge / 3) {
        opposite[static_cast<std::size_t>(half_edge / 3)][static_cast<std::size_t>(half_edge % 3)] =
            twin;
      }
    }
  }
  return opposite;
}

VertexNeighbours NeighboursOfVertices(std::span<const Triangle> triangles, int num_vertices) {
  const auto n = static_cast<std::size_t>(num_vertices);
  VertexNeighbours result;
  result.begin.assign(n + 1, 0);
  std::vector<int> first(n + 1, 0);
  for (const Triangle& t : triangles) {
    for (const int v : t) first[static_cast<std::size_t>(v) + 1] += 2;
  }
  for (std::size_t v = 0; v < n; ++v) first[v + 1] += first[v];
  std::vector<int> all(static_cast<std::size_t>(first[n]));
  std::vector<int> next(first.begin(), first.end() - 1);
  for (const Triangle& t : triangles) {
    for (std::size_t c = 0; c < 3; ++c) {
      int& slot = next[static_cast<std::size_t>(t[c])];
      all[static_cast<std::size_t>(slot++)] = t[(c + 1) % 3];
      all[static_cast<std::size_t>(slot++)] = t[(c + 2) % 3];
    }
  }
  result.index.reserve(all.size() / 2);
  for (std::size_t v = 0; v < n; ++v) {
    const auto from = all.begin() + first[v];
    const auto to = all.begin() + first[v + 1];
    std::sort(from, to);
    result.index.insert(result.index.end(), from, std::unique(from, to));
    result.begin[v + 1] = static_cast<int>(result.index.size());
  }
  return result;
}

}  // namespace dyxel
