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

constexpr int kStarts = 40;  // border vertices from which divisions are sought
constexpr std::size_t kMostCrossings = 400;
constexpr int kHullPoints = 64;     // border points of which hulls are made
constexpr double kCutPrice = 0.05;  // area that a cut has to save, over its length times the
                                    // root of the chart's area

// Twice the area of the convex hull (monotone chain). Sorts the points.
double DoubleHullArea(std::vector<Vec2d>& points, std::vector<Vec2d>& hull) {
  std::sort(points.begin(), points.end(), [](const Vec2d& a, const Vec2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  double area = 0;
  for (int half = 0; half < 2; ++half) {
    hull.clear();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec2d& p = points[half == 0 ? i : points.size() - 1 - i];
      while (hull.size() > 1 && DoubleArea(hull[hull.size() - 2], hull.back(), p) <= 0) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    for (std::size_t i = 0; i + 1 < hull.size(); ++i) {
      area += hull[i].x() * hull[i + 1].y() - hull[i].y() * hull[i + 1].x();
    }
  }
  return area;
}

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

std::array<int, 2> FindDivision(std::span<const Vec3f> positions,
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

  // Parts of some size if that can be.
  for (const double least_share : {0.01, 0.0}) {
    double best = std::numeric_limits<double>::infinity();
    std::array<int, 2> best_ends = {-1, -1};
    const int starts = std::min(n, kStarts);
    for (int s = 0; s < starts; ++s) {
      const int a = static_cast<int>(static_cast<std::int64_t>(s) * n / starts);
      close(border[a], false);
      const Paths paths = ShortestPaths(graph, cost, std::array{border[a]});
      close(border[a], true);
      for (int b = 0; b < n; ++b) {
        if (b == a || !std::isfinite(paths.distance[border[b]])) continue;
        const int from = std::min(a, b), to = std::max(a, b);
        const double side = swept[to] - swept[from] + cross(uv[border[to]], uv[border[from]]);
        const double smaller = std::min(side, swept[n] - side);
        if (smaller <= least_share * swept[n]) continue;
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
          best_ends = {border[a], border[b]};
        }
      }
    }
    if (best_ends[0] >= 0) return best_ends;
  }
  return {-1, -1};
}

std::vector<int> PathAcross(std::span<const Vec3f> positions,
                            std::span<const Triangle> triangles,
                            std::span<const int> border,
                            const std::array<int, 2>& ends) {
  const VertexGraph graph = MakeVertexGraph(triangles, static_cast<int>(positions.size()));
  std::vector<float> cost = EdgeLengths(graph, positions);
  std::vector<char> on_border(positions.size(), 0);
  for (const int v : border) on_border[v] = 1;
  // Straight from border to border only where that is an inner edge: border edges cost too much.
  for (std::size_t i = 0; i < border.size(); ++i) {
    const std::array<int, 2> edge = {border[i], border[(i + 1) % border.size()]};
    for (int k = 0; k < 2; ++k) {
      for (int e = graph.begin[edge[k]]; e < graph.begin[edge[k] + 1]; ++e) {
        if (graph.neighbour[e] == edge[1 - k]) cost[e] = std::numeric_limits<float>::infinity();
      }
    }
  }
  on_border[ends[1]] = 0;
  const Paths paths = ShortestPaths(graph, cost, std::array{ends[0]}, on_border, ends[1]);
  std::vector<int> path;
  if (!std::isfinite(paths.distance[ends[1]])) return path;
  for (int v = ends[1]; v >= 0; v = paths.parent[v]) path.push_back(v);
  return path;
}

TighterDivision FindTighterDivision(std::span<const Vec3f> positions,
                                    std::span<const Triangle> triangles,
                                    std::span<const Vec2d> uv,
                                    std::span<const int> border) {
  const int n = static_cast<int>(border.size());
  // Points about evenly along the border.
  std::vector<double> way(static_cast<std::size_t>(n) + 1, 0);
  for (int i = 0; i < n; ++i) {
    way[i + 1] = way[i] + (uv[border[(i + 1) % n]] - uv[border[i]]).norm();
  }
  std::vector<int> sample;
  for (int i = 0; i < n; ++i) {
    if (way[i] * kHullPoints >= way[n] * static_cast<double>(sample.size())) sample.push_back(i);
  }
  const int m = static_cast<int>(sample.size());
  std::vector<Vec2d> points;
  for (const int i : sample) points.push_back(uv[border[i]]);
  double area = 0;
  for (int i = 0; i < m; ++i) {
    area += points[i].x() * points[(i + 1) % m].y() - points[i].y() * points[(i + 1) % m].x();
  }
  area /= 2;
  std::vector<Vec2d> part = points, hull;
  const double whole = DoubleHullArea(part, hull) / 2;

  // A chord lies inside where it leaves both ends into the chart and meets no border between.
  const auto inside = [&](int i, int j) {
    const auto into = [&](int k, const Vec2d& to) {
      const Vec2d &before = points[(k + m - 1) % m], &at = points[k], &after = points[(k + 1) % m];
      const bool left_of_next = DoubleArea(at, after, to) > 0;
      const bool left_of_previous = DoubleArea(before, at, to) > 0;
      return DoubleArea(before, at, after) > 0 ? left_of_next && left_of_previous
                                               : left_of_next || left_of_previous;
    };
    if (!into(i, points[j]) || !into(j, points[i])) return false;
    for (int k = 0; k < m; ++k) {
      const int next = (k + 1) % m;
      if (k == i || k == j || next == i || next == j) continue;
      if (Cross(points[i], points[j], points[k], points[next])) return false;
    }
    return true;
  };
  TighterDivision best;
  int best_i = -1, best_j = -1;
  for (int i = 0; i < m; ++i) {
    for (int j = i + 2; j < m; ++j) {
      const double price = kCutPrice * (points[i] - points[j]).norm() * std::sqrt(area);
      if (whole - area - price <= best.saved || !inside(i, j)) continue;
      part.assign(points.begin() + i, points.begin() + j + 1);
      double hulls = DoubleHullArea(part, hull) / 2;
      part.assign(points.begin() + j, points.end());
      part.insert(part.end(), points.begin(), points.begin() + i + 1);
      hulls += DoubleHullArea(part, hull) / 2;
      const double saved = whole - hulls - price;
      if (saved <= best.saved) continue;
      best.saved = saved;
      best_i = sample[i];
      best_j = sample[j];
    }
  }
  if (best_i < 0) return best;
  best.path = PathAcross(positions, triangles, border, {border[best_i], border[best_j]});
  return best;
}

}  // namespace dyxel::internal
