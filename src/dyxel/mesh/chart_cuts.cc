#include "dyxel/mesh/chart_cuts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "dyxel/mesh/seam.h"

namespace dyxel::internal {
namespace {

// A crossing longer than this times the root of the area that it cuts off is no limb's: an arm or
// a leg has about 0.7 to 1, a neck 1; half a sphere would have 2.5.
constexpr double kWidestLimb = 1.5;
// Shares of the whole area that a limb may have.
constexpr double kLeastLimb = 0.01, kGreatestLimb = 0.4;
constexpr int kCrossings = 24;  // tried a limb

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
  std::vector<char> marked(graph.neighbour.size(), 0);
  const auto find = [&](int a, int b) {
    const auto neighbours = graph.Of(a);
    return graph.begin[a] +
           (std::lower_bound(neighbours.begin(), neighbours.end(), b) - neighbours.begin());
  };
  for (const auto& edge : edges) {
    marked[find(edge[0], edge[1])] = 1;
    marked[find(edge[1], edge[0])] = 1;
  }
  for (int h = 0; h < static_cast<int>(twins.size()); ++h) {
    if (marked[find(Origin(triangles, h), Origin(triangles, NextInTriangle(h)))]) cut[h] = 1;
  }
}

void CutLimbs(const CutMesh& disk,
              std::span<const Vec3f> disk_positions,
              std::span<const int> ends,
              std::span<const Triangle> triangles,
              std::span<const int> twins,
              const VertexGraph& graph,
              std::span<char> cut) {
  const int n = static_cast<int>(disk.vertex.size());
  const VertexGraph disk_graph = MakeVertexGraph(disk.triangles, n);
  const std::vector<float> length = EdgeLengths(disk_graph, disk_positions);
  const std::vector<int> border = DiskBoundary(disk.triangles, n);
  const int loop = static_cast<int>(border.size());
  std::vector<char> on_border(static_cast<std::size_t>(n), 0);
  for (const int c : border) on_border[c] = 1;
  double whole = 0;
  std::vector<double> area(disk.triangles.size());
  for (std::size_t f = 0; f < area.size(); ++f) {
    const Triangle& t = disk.triangles[f];
    area[f] = (disk_positions[t[1]] - disk_positions[t[0]])
                  .cross(disk_positions[t[2]] - disk_positions[t[0]])
                  .norm() /
              2;
    whole += area[f];
  }
  std::vector<std::array<int, 2>> edges;
  for (const int end : ends) {
    // An end of the tree has one copy; left and right of it lie the two sides of its branch.
    const auto it =
        std::find_if(border.begin(), border.end(), [&](int c) { return disk.vertex[c] == end; });
    if (it == border.end()) continue;
    const int tip = static_cast<int>(it - border.begin());
    const auto side = [&](int steps) { return border[(tip + steps + 2 * loop) % loop]; };
    int branch = 0;
    while (branch + 1 < loop / 2 &&
           disk.vertex[side(branch + 1)] == disk.vertex[side(-branch - 1)]) {
      ++branch;
    }
    // Area nearer to the tip than each vertex of the branch.
    const Paths from_tip = ShortestPaths(disk_graph, length, std::array{border[tip]});
    std::vector<std::pair<float, double>> nearer;
    for (std::size_t f = 0; f < area.size(); ++f) {
      const Triangle& t = disk.triangles[f];
      nearer.emplace_back(
          (from_tip.distance[t[0]] + from_tip.distance[t[1]] + from_tip.distance[t[2]]) / 3,
          area[f]);
    }
    std::sort(nearer.begin(), nearer.end());
    double sum = 0;
    for (auto& entry : nearer) entry.second = sum += entry.second;

    double best = kWidestLimb;
    std::vector<int> best_path;
    for (int i = 1; i <= kCrossings; ++i) {
      const int steps = branch * i / kCrossings;
      if (steps < 2) continue;
      const int left = side(-steps), right = side(steps);
      const auto below =
          std::lower_bound(nearer.begin(), nearer.end(), std::pair{from_tip.distance[left], 0.0});
      const double inside = below == nearer.begin() ? 0 : std::prev(below)->second;
      if (inside < kLeastLimb * whole || inside > kGreatestLimb * whole) continue;
      std::vector<char> blocked = on_border;
      blocked[right] = 0;
      const Paths paths = ShortestPaths(disk_graph, length, std::array{left}, blocked, right);
      const double ratio = static_cast<double>(paths.distance[right]) / std::sqrt(inside);
      if (ratio >= best) continue;
      best = ratio;
      best_path.clear();
      for (int c = right; c >= 0; c = paths.parent[c]) best_path.push_back(disk.vertex[c]);
    }
    for (const auto& edge : EdgesOf(best_path)) edges.push_back(edge);
  }
  MarkCut(triangles, twins, graph, edges, cut);
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
