#include "dyxel/mesh/chart_division.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "dyxel/mesh/chart_cuts.h"
#include "dyxel/mesh/distortion.h"
#include "dyxel/mesh/seam.h"

namespace dyxel::internal {
namespace {

constexpr int kStarts = 40;           // border vertices from which divisions are sought
constexpr double kLeastShare = 0.01;  // of the chart's area, on each side
constexpr std::size_t kMostCrossings = 400;

bool Cross(const Vec2d& a, const Vec2d& b, const Vec2d& c, const Vec2d& d) {
  const double abc = DoubleArea(a, b, c), abd = DoubleArea(a, b, d);
  const double cda = DoubleArea(c, d, a), cdb = DoubleArea(c, d, b);
  if ((abc > 0 && abd > 0) || (abc < 0 && abd < 0)) return false;
  if ((cda > 0 && cdb > 0) || (cda < 0 && cdb < 0)) return false;
  // On one line they meet only if their boxes do.
  return a.cwiseMin(b).cwiseMax(c.cwiseMin(d)).x() <= a.cwiseMax(b).cwiseMin(c.cwiseMax(d)).x() &&
         a.cwiseMin(b).cwiseMax(c.cwiseMin(d)).y() <= a.cwiseMax(b).cwiseMin(c.cwiseMax(d)).y();
}

}  // namespace

std::vector<std::array<int, 2>> BorderCrossings(std::span<const Vec2d> border) {
  const int n = static_cast<int>(border.size());
  Vec2d low = border[0], high = border[0];
  double longest = 0;
  for (int i = 0; i < n; ++i) {
    low = low.cwiseMin(border[i]);
    high = high.cwiseMax(border[i]);
    longest = std::max(longest, (border[(i + 1) % n] - border[i]).norm());
  }
  // A grid of cells, each with the segments whose boxes meet it.
  const double cell = std::max(longest, (high - low).maxCoeff() / 256);
  const int columns = static_cast<int>((high - low).x() / cell) + 1;
  const int rows = static_cast<int>((high - low).y() / cell) + 1;
  std::vector<std::vector<int>> cells(static_cast<std::size_t>(columns) * rows);
  std::vector<std::array<int, 2>> crossings;
  for (int j = 0; j < n; ++j) {
    const Vec2d &c = border[j], &d = border[(j + 1) % n];
    const Eigen::Vector2i from = ((c.cwiseMin(d) - low) / cell).cast<int>();
    const Eigen::Vector2i to = ((c.cwiseMax(d) - low) / cell).cast<int>();
    for (int y = from.y(); y <= to.y(); ++y) {
      for (int x = from.x(); x <= to.x(); ++x) {
        std::vector<int>& others = cells[static_cast<std::size_t>(y) * columns + x];
        for (const int i : others) {
          if (j - i <= 1 || (i == 0 && j == n - 1)) continue;
          if (Cross(border[i], border[i + 1], c, d)) crossings.push_back({i, j});
        }
        others.push_back(j);
      }
    }
  }
  std::sort(crossings.begin(), crossings.end());
  crossings.erase(std::unique(crossings.begin(), crossings.end()), crossings.end());
  return crossings;
}

std::vector<int> FindDivision(std::span<const Vec3f> positions,
                              std::span<const Triangle> triangles,
                              std::span<const Vec2d> uv,
                              std::span<const int> border,
                              std::span<const std::array<int, 2>> crossings) {
  const int n = static_cast<int>(border.size());
  const VertexGraph graph = MakeVertexGraph(triangles, static_cast<int>(positions.size()));
  const std::vector<float> length = EdgeLengths(graph, positions);
  // Paths may end at the border but not go on from there.
  std::vector<float> cost = length;
  const auto close = [&](int v, bool closed) {
    for (int e = graph.begin[v]; e < graph.begin[v + 1]; ++e) {
      cost[e] = closed ? std::numeric_limits<float>::infinity() : length[e];
    }
  };
  for (const int v : border) close(v, true);

  // Twice the area that the border sweeps around the origin up to each vertex: with a chord, the
  // area on one side of it.
  std::vector<double> swept(static_cast<std::size_t>(n) + 1, 0);
  const auto cross = [](const Vec2d& a, const Vec2d& b) { return a.x() * b.y() - a.y() * b.x(); };
  for (int i = 0; i < n; ++i)
    swept[i + 1] = swept[i] + cross(uv[border[i]], uv[border[(i + 1) % n]]);
  const std::size_t stride = crossings.size() / kMostCrossings + 1;

  double best = std::numeric_limits<double>::infinity();
  std::vector<int> best_path;
  const int starts = std::min(n, kStarts);
  for (int s = 0; s < starts; ++s) {
    const int a = static_cast<int>(static_cast<std::int64_t>(s) * n / starts);
    close(border[a], false);
    const Paths paths = ShortestPaths(graph, cost, std::array{border[a]});
    close(border[a], true);
    int best_b = -1;
    for (int b = 0; b < n; ++b) {
      if (b == a || !std::isfinite(paths.distance[border[b]])) continue;
      const int from = std::min(a, b), to = std::max(a, b);
      const double side = swept[to] - swept[from] + cross(uv[border[to]], uv[border[from]]);
      const double smaller = std::min(side, swept[n] - side);
      if (smaller < kLeastShare * swept[n]) continue;
      int parted = 0, all = 0;
      for (std::size_t k = 0; k < crossings.size(); k += stride) {
        const auto between = [&](int i) { return i >= from && i < to; };
        parted += between(crossings[k][0]) != between(crossings[k][1]) ? 1 : 0;
        ++all;
      }
      if (parted == 0) continue;
      const double score = static_cast<double>(paths.distance[border[b]]) / std::sqrt(smaller) *
                           (1 + 4.0 * (all - parted) / all);
      if (score < best) {
        best = score;
        best_b = b;
      }
    }
    if (best_b < 0) continue;
    best_path.clear();
    for (int v = border[best_b]; v >= 0; v = paths.parent[v]) best_path.push_back(v);
  }
  return best_path;
}

}  // namespace dyxel::internal
