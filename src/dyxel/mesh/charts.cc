#include "dyxel/mesh/charts.h"

#include <algorithm>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/mesh/chart_cuts.h"
#include "dyxel/mesh/chart_division.h"
#include "dyxel/mesh/distortion.h"
#include "dyxel/mesh/parameterize.h"

namespace dyxel::internal {
namespace {

constexpr int kMostDivisions = 20;  // rounds of dividing charts that overlap
constexpr int kMostTighterCuts = 8;
constexpr double kLeastSaving = 0.02;  // of the whole area, that a tighter cut has to gain

// The pieces that `cut` leaves, not yet flattened.
Charts SplitCharts(const Skin& skin, std::span<const char> cut) {
  Charts split;
  split.mesh = CutOpen(skin.triangles, skin.twins, cut, static_cast<int>(skin.positions.size()));
  std::vector<char> seen(skin.triangles.size(), 0);
  std::vector<int> index(split.mesh.vertex.size(), -1);
  for (int first = 0; first < static_cast<int>(seen.size()); ++first) {
    if (seen[first]) continue;
    Chart chart;
    chart.members.push_back(first);
    seen[first] = 1;
    for (std::size_t i = 0; i < chart.members.size(); ++i) {
      for (int h = 3 * chart.members[i], end = h + 3; h < end; ++h) {
        const int neighbour = skin.twins[h] / 3;
        if (cut[h] || seen[neighbour]) continue;
        seen[neighbour] = 1;
        chart.members.push_back(neighbour);
      }
    }
    std::sort(chart.members.begin(), chart.members.end());
    for (const int f : chart.members) {
      Triangle local{};
      for (std::size_t k = 0; k < 3; ++k) {
        const int c = split.mesh.triangles[f][k];
        if (index[c] < 0) {
          index[c] = static_cast<int>(chart.vertices.size());
          chart.vertices.push_back(c);
          chart.positions.push_back(skin.positions[split.mesh.vertex[c]]);
        }
        local[k] = index[c];
      }
      chart.triangles.push_back(local);
    }
    chart.border = DiskBoundary(chart.triangles, static_cast<int>(chart.vertices.size()));
    split.charts.push_back(std::move(chart));
  }
  return split;
}

// Marks a path of a chart's vertices as cut.
void CutAlong(const Skin& skin,
              const Charts& charts,
              const Chart& chart,
              std::span<const int> path,
              std::span<char> cut) {
  std::vector<std::array<int, 2>> edges;
  for (std::size_t k = 0; k + 1 < path.size(); ++k) {
    edges.push_back({charts.mesh.vertex[chart.vertices[path[k]]],
                     charts.mesh.vertex[chart.vertices[path[k + 1]]]});
  }
  MarkCut(skin.triangles, skin.twins, skin.graph, edges, cut);
}

// Flattens the chart; the path that is to divide it if it overlaps itself, else empty.
std::vector<int> Flatten(Chart& chart) {
  FreeMap map = FlattenFree(chart.positions, chart.triangles, true);
  chart.uv = std::move(map.uv);
  std::array<int, 2> ends = {-1, -1};  // of the dividing path
  if (chart.uv.empty()) {
    const CoarseMap& coarse = map.coarse;
    std::vector<Vec3f> positions;
    for (const int v : coarse.vertices) positions.push_back(chart.positions[v]);
    ends = FindDivision(positions, coarse.triangles, coarse.uv, coarse.border, coarse.crossings);
    if (ends[0] >= 0) ends = {coarse.vertices[ends[0]], coarse.vertices[ends[1]]};
  } else {
    const std::vector<std::array<int, 2>> crossings = BorderCrossings(BorderInPlane(chart));
    if (crossings.empty()) return {};
    ends = FindDivision(chart.positions, chart.triangles, chart.uv, chart.border, crossings);
  }
  std::vector<int> path;
  if (ends[0] >= 0) path = PathAcross(chart.positions, chart.triangles, chart.border, ends);
  Require(!path.empty(),
          Fault::kStage,
          "a chart of {} triangles overlaps itself and no cut parts it",
          chart.members.size());
  return path;
}

}  // namespace

std::vector<Vec2d> BorderInPlane(const Chart& chart) {
  std::vector<Vec2d> border;
  for (const int v : chart.border) border.push_back(chart.uv[v]);
  return border;
}

Charts FlattenCharts(const Skin& skin, std::vector<char>& cut) {
  Charts charts;
  for (int round = 0; round < kMostDivisions; ++round) {
    const std::vector<Chart> done = std::move(charts.charts);
    charts = SplitCharts(skin, cut);
    std::vector<std::vector<int>> divisions(charts.charts.size());
    ParallelFor(charts.charts.size(), [&](std::size_t i) {
      Chart& chart = charts.charts[i];
      const auto same = std::find_if(done.begin(), done.end(), [&](const Chart& old) {
        return old.members == chart.members && old.triangles == chart.triangles;
      });
      if (same != done.end()) {
        chart.uv = same->uv;
      } else {
        divisions[i] = Flatten(chart);
      }
    });
    bool divided = false;
    for (std::size_t i = 0; i < divisions.size(); ++i) {
      if (divisions[i].empty()) continue;
      divided = true;
      CutAlong(skin, charts, charts.charts[i], divisions[i], cut);
    }
    if (!divided) return charts;
  }
  throw Error(Fault::kStage, "charts of the skin still overlap themselves after many cuts");
}

void TightenCharts(const Skin& skin, std::vector<char>& cut, Charts& charts) {
  double area = 0;
  std::vector<std::array<Vec2d, 3>> corner_uv(skin.triangles.size());
  for (const Chart& chart : charts.charts) {
    for (std::size_t i = 0; i < chart.members.size(); ++i) {
      const Triangle& t = chart.triangles[i];
      corner_uv[chart.members[i]] = {chart.uv[t[0]], chart.uv[t[1]], chart.uv[t[2]]};
      area += DoubleArea(chart.uv[t[0]], chart.uv[t[1]], chart.uv[t[2]]) / 2;
    }
  }
  struct Known {
    std::vector<int> members;
    TighterDivision division;
  };
  std::vector<Known> known;
  for (int round = 0; round < kMostTighterCuts; ++round) {
    std::vector<Known> now(charts.charts.size());
    ParallelFor(now.size(), [&](std::size_t i) {
      const Chart& chart = charts.charts[i];
      const auto same = std::find_if(known.begin(), known.end(), [&](const Known& old) {
        return old.members == chart.members;
      });
      now[i].members = chart.members;
      now[i].division =
          same != known.end()
              ? same->division
              : FindTighterDivision(chart.positions, chart.triangles, chart.uv, chart.border);
    });
    known = std::move(now);
    const auto best =
        std::max_element(known.begin(), known.end(), [](const Known& a, const Known& b) {
          return a.division.saved < b.division.saved;
        });
    if (best->division.path.empty() || best->division.saved < kLeastSaving * area) return;
    CutAlong(skin, charts, charts.charts[best - known.begin()], best->division.path, cut);
    charts = SplitCharts(skin, cut);
    for (Chart& chart : charts.charts) {
      chart.uv.resize(chart.vertices.size());
      for (std::size_t i = 0; i < chart.members.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
          chart.uv[chart.triangles[i][k]] = corner_uv[chart.members[i]][k];
        }
      }
    }
  }
}

}  // namespace dyxel::internal
