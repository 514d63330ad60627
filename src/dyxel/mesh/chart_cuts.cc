#include "dyxel/mesh/chart_cuts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "dyxel/mesh/seam.h"

namespace dyxel::internal {
namespace {

std::vector<std::array<int, 2>> EdgesOf(std::span<const int> path) {
  std::vector<std::array<int, 2>> edges;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) edges.push_back({path[i], path[i + 1]});
  return edges;
}

}  // namespace

std::vector<float> EdgeLengths(const VertexGraph& graph, std::span<const Vec3f> positions) {
  std::vector<float> length(graph.neighbour.size());
  for (int v = 0; v + 1 < static_cast<int>(graph.begin.size()); ++v) {
    for (int e = graph.begin[v]; e < graph.begin[v + 1]; ++e) {
      length[e] = (positions[graph.neighbour[e]] - positions[v]).norm();
    }
  }
  return length;
}

void MarkCut(std::span<const Triangle> triangles,
             std::span<const int> twins,
             const VertexGraph& graph,
             std::span<const std::array<int, 2>> edges,
             std::span<char> cut) {
  std::vector<char> marked(graph.neighbour.size(), 0), touched(graph.begin.size(), 0);
  const auto find = [&](int a, int b) {
    const auto neighbours = graph.Of(a);
    return graph.begin[a] +
           (std::lower_bound(neighbours.begin(), neighbours.end(), b) - neighbours.begin());
  };
  for (const auto& edge : edges) {
    touched[edge[0]] = touched[edge[1]] = 1;
    marked[find(edge[0], edge[1])] = 1;
    marked[find(edge[1], edge[0])] = 1;
  }
  for (int h = 0; h < static_cast<int>(twins.size()); ++h) {
    const int a = Origin(triangles, h), b = Origin(triangles, NextInTriangle(h));
    if (touched[a] && touched[b] && marked[find(a, b)]) cut[h] = 1;
  }
}

void CutSlits(const VertexGraph& graph,
              std::span<const float> cost,
              std::span<const int> tips,
              std::span<const Triangle> triangles,
              std::span<const int> twins,
              std::span<char> cut) {
  std::vector<char> on_cut(graph.begin.size() - 1, 0);
  for (int h = 0; h < static_cast<int>(twins.size()); ++h) {
    if (cut[h]) on_cut[Origin(triangles, h)] = 1;
  }
  for (const int tip : tips) {
    if (on_cut[tip]) continue;
    std::vector<int> sources;
    for (int v = 0; v < static_cast<int>(on_cut.size()); ++v) {
      if (on_cut[v]) sources.push_back(v);
    }
    const Paths paths = ShortestPaths(graph, cost, sources, {}, tip);
    std::vector<int> path;
    for (int v = tip; v >= 0; v = paths.parent[v]) path.push_back(v);
    for (const int v : path) on_cut[v] = 1;
    MarkCut(triangles, twins, graph, EdgesOf(path), cut);
  }
}

}  // namespace dyxel::internal
