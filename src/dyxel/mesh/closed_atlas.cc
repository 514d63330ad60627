#include "dyxel/mesh/closed_atlas.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/parallel_invoke.h>

#include "dyxel/base/parallel.h"
#include "dyxel/mesh/chart_cuts.h"
#include "dyxel/mesh/chart_division.h"
#include "dyxel/mesh/chart_packing.h"
#include "dyxel/mesh/distortion.h"
#include "dyxel/mesh/exposure.h"
#include "dyxel/mesh/half_edges.h"
#include "dyxel/mesh/parameterize.h"
#include "dyxel/mesh/seam.h"

namespace dyxel {
namespace {

using namespace internal;

// Peaks of geodesic distance this prominent become ends of the seam: head, hands, feet; lesser
// ones (fingers) get slits of their own in I.
constexpr float kMainProminence = 0.15F;
constexpr float kMinorProminence = 0.03F;
constexpr std::size_t kMostMain = 8, kMostMinor = 24;

// Cost of a seam's edge: its length times how openly it lies, and a little for length alone.
std::vector<float> SeamCost(const VertexGraph& graph,
                            std::span<const float> length,
                            std::span<const float> exposure) {
  std::vector<float> cost(graph.neighbour.size());
  for (int v = 0; v + 1 < static_cast<int>(graph.begin.size()); ++v) {
    for (int e = graph.begin[v]; e < graph.begin[v + 1]; ++e) {
      const float open = (exposure[v] + exposure[graph.neighbour[e]]) / 2;
      cost[e] = length[e] * (0.05F + open * open);
    }
  }
  return cost;
}

struct Ends {
  std::vector<int> main, minor;
};

Ends FindEnds(const VertexGraph& graph, std::span<const float> length) {
  Ends ends;
  for (const Extremity& extremity : FindExtremities(graph, length)) {
    if (extremity.prominence >= kMainProminence && ends.main.size() < kMostMain) {
      ends.main.push_back(extremity.vertex);
    } else if (extremity.prominence >= kMinorProminence && ends.minor.size() < kMostMinor) {
      ends.minor.push_back(extremity.vertex);
    }
  }
  if (ends.main.size() < 2) {
    const Paths paths = ShortestPaths(graph, length, ends.main);
    ends.main.push_back(static_cast<int>(
        std::max_element(paths.distance.begin(), paths.distance.end()) - paths.distance.begin()));
  }
  return ends;
}

// One chart: the triangles of one piece, as a mesh of its own.
struct Chart {
  std::vector<int> members;         // triangles of the skin, ascending
  std::vector<int> vertices;        // of the cut mesh
  std::vector<Triangle> triangles;  // by index into `vertices`
  std::vector<Vec3f> positions;
  std::vector<int> border;  // loop
  std::vector<Vec2d> uv;    // metres
};

std::vector<Chart> SplitCharts(const CutMesh& mesh,
                               std::span<const Vec3f> positions,
                               std::span<const int> twins,
                               std::span<const char> cut) {
  std::vector<char> seen(mesh.triangles.size(), 0);
  std::vector<Chart> charts;
  std::vector<int> index(mesh.vertex.size(), -1);
  for (int first = 0; first < static_cast<int>(seen.size()); ++first) {
    if (seen[first]) continue;
    Chart chart;
    chart.members.push_back(first);
    seen[first] = 1;
    for (std::size_t i = 0; i < chart.members.size(); ++i) {
      for (int h = 3 * chart.members[i]; h < 3 * chart.members[i] + 3; ++h) {
        const int neighbour = twins[h] / 3;
        if (cut[h] || seen[neighbour]) continue;
        seen[neighbour] = 1;
        chart.members.push_back(neighbour);
      }
    }
    std::sort(chart.members.begin(), chart.members.end());
    for (const int f : chart.members) {
      Triangle local{};
      for (std::size_t k = 0; k < 3; ++k) {
        const int c = mesh.triangles[f][k];
        if (index[c] < 0) {
          index[c] = static_cast<int>(chart.vertices.size());
          chart.vertices.push_back(c);
          chart.positions.push_back(positions[mesh.vertex[c]]);
        }
        local[k] = index[c];
      }
      chart.triangles.push_back(local);
    }
    charts.push_back(std::move(chart));
  }
  return charts;
}

std::vector<Vec2d> BorderInPlane(const Chart& chart) {
  std::vector<Vec2d> border;
  for (const int v : chart.border) border.push_back(chart.uv[v]);
  return border;
}

// The charts that `cut` leaves, flattened; those that overlap themselves are cut further until
// none does.
struct ChartMap {
  CutMesh mesh;
  std::vector<Chart> charts;
};

// Cuts charts where that saves a good deal of the area of their hulls. Their maps stay.
void TightenCharts(std::span<const Vec3f> positions,
                   std::span<const Triangle> triangles,
                   std::span<const int> twins,
                   const VertexGraph& graph,
                   std::vector<char>& cut,
                   ChartMap& map) {
  constexpr int kMostCuts = 8;
  constexpr double kLeastSaving = 0.02;  // of the whole area
  double area = 0;
  std::vector<std::array<Vec2d, 3>> corner_uv(triangles.size());
  for (const Chart& chart : map.charts) {
    for (std::size_t i = 0; i < chart.members.size(); ++i) {
      const Triangle& t = chart.triangles[i];
      corner_uv[chart.members[i]] = {chart.uv[t[0]], chart.uv[t[1]], chart.uv[t[2]]};
      area += DoubleArea(chart.uv[t[0]], chart.uv[t[1]], chart.uv[t[2]]) / 2;
    }
  }
  std::vector<TighterDivision> divisions(map.charts.size());
  std::vector<std::vector<int>> asked;  // members of the charts that the divisions are of
  for (int round = 0; round < kMostCuts; ++round) {
    std::vector<TighterDivision> fresh(map.charts.size());
    ParallelFor(map.charts.size(), [&](std::size_t i) {
      const Chart& chart = map.charts[i];
      for (std::size_t k = 0; k < asked.size(); ++k) {
        if (asked[k] != chart.members) continue;
        fresh[i] = divisions[k];
        return;
      }
      fresh[i] = FindTighterDivision(chart.positions, chart.triangles, chart.uv, chart.border);
    });
    divisions = std::move(fresh);
    const auto best = std::max_element(
        divisions.begin(), divisions.end(), [](const TighterDivision& a, const TighterDivision& b) {
          return a.saved < b.saved;
        });
    if (best->path.empty() || best->saved < kLeastSaving * area) return;
    const Chart& divided = map.charts[best - divisions.begin()];
    std::vector<std::array<int, 2>> edges;
    for (std::size_t k = 0; k + 1 < best->path.size(); ++k) {
      edges.push_back({map.mesh.vertex[divided.vertices[best->path[k]]],
                       map.mesh.vertex[divided.vertices[best->path[k + 1]]]});
    }
    MarkCut(triangles, twins, graph, edges, cut);
    asked.clear();
    for (const Chart& chart : map.charts) asked.push_back(chart.members);
    asked[best - divisions.begin()].clear();
    map.mesh = CutOpen(triangles, twins, cut, static_cast<int>(positions.size()));
    map.charts = SplitCharts(map.mesh, positions, twins, cut);
    for (Chart& chart : map.charts) {
      chart.border = DiskBoundary(chart.triangles, static_cast<int>(chart.vertices.size()));
      chart.uv.resize(chart.vertices.size());
      for (std::size_t i = 0; i < chart.members.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
          chart.uv[chart.triangles[i][k]] = corner_uv[chart.members[i]][k];
        }
      }
    }
  }
}

ChartMap MapCharts(std::span<const Vec3f> positions,
                   std::span<const Triangle> triangles,
                   std::span<const int> twins,
                   const VertexGraph& graph,
                   std::vector<char> cut) {
  constexpr int kMostRounds = 20;
  ChartMap map;
  for (int round = 0; round < kMostRounds; ++round) {
    const std::vector<Chart> done = std::move(map.charts);
    map.mesh = CutOpen(triangles, twins, cut, static_cast<int>(positions.size()));
    map.charts = SplitCharts(map.mesh, positions, twins, cut);
    std::vector<std::vector<std::array<int, 2>>> divisions(map.charts.size());
    ParallelFor(map.charts.size(), [&](std::size_t i) {
      Chart& chart = map.charts[i];
      for (const Chart& old : done) {
        const bool same = old.members == chart.members && old.triangles == chart.triangles;
        if (!same) continue;
        chart.border = old.border;
        chart.uv = old.uv;
        return;
      }
      chart.border = DiskBoundary(chart.triangles, static_cast<int>(chart.vertices.size()));
      FreeMap flat = FlattenFree(chart.positions, chart.triangles, true);
      chart.uv = std::move(flat.uv);
      auto crossings = BorderCrossings(BorderInPlane(chart));
      if (crossings.empty() && !flat.finished) {
        chart.uv = FlattenFree(chart.positions, chart.triangles).uv;
        crossings = BorderCrossings(BorderInPlane(chart));
      }
      if (crossings.empty()) return;
      const std::vector<int> path =
          FindDivision(chart.positions, chart.triangles, chart.uv, chart.border, crossings);
      for (std::size_t k = 0; k + 1 < path.size(); ++k) {
        divisions[i].push_back({map.mesh.vertex[chart.vertices[path[k]]],
                                map.mesh.vertex[chart.vertices[path[k + 1]]]});
      }
      Require(!path.empty(),
              Fault::kStage,
              "a chart of {} triangles overlaps itself and no cut parts it",
              chart.members.size());
    });
    bool divided = false;
    for (const auto& edges : divisions) {
      divided = divided || !edges.empty();
      MarkCut(triangles, twins, graph, edges, cut);
    }
    if (divided) continue;
    // Nothing overlaps any more: cut for a tighter packing.
    TightenCharts(positions, triangles, twins, graph, cut, map);
    return map;
  }
  throw Error(Fault::kStage, "charts of the skin still overlap themselves after many cuts");
}

}  // namespace

Atlas MakeClosedAtlas(std::span<const Vec3f> positions,
                      std::span<const Triangle> triangles,
                      const AtlasOptions& options) {
  CheckOptions("atlas", options);
  const int num_vertices = static_cast<int>(positions.size());
  const std::vector<int> twins = FindTwins(triangles, num_vertices);
  RequireSphere(triangles, twins, num_vertices);

  const VertexGraph graph = MakeVertexGraph(triangles, num_vertices);
  const std::vector<float> length = EdgeLengths(graph, positions);
  const std::vector<float> cost = SeamCost(graph, length, Exposure(positions, triangles));
  const Ends ends = FindEnds(graph, length);
  const Seam seam = JoinInduced(graph, cost, ends.main);

  std::vector<char> seam_cut(twins.size(), 0);
  MarkCut(triangles, twins, graph, seam.edges, seam_cut);
  const CutMesh disk = CutOpen(triangles, twins, seam_cut, num_vertices);
  std::vector<Vec3f> disk_positions(disk.vertex.size());
  for (std::size_t c = 0; c < disk.vertex.size(); ++c)
    disk_positions[c] = positions[disk.vertex[c]];

  std::vector<char> cut = seam_cut;
  if (options.limbs) {
    CutLimbs(disk, disk_positions, seam.terminals, triangles, twins, graph, cut);
  }
  std::vector<int> slits = ends.minor;
  for (const int end : ends.main) {
    const bool joined =
        std::find(seam.terminals.begin(), seam.terminals.end(), end) != seam.terminals.end();
    if (!joined) slits.push_back(end);
  }
  CutSlits(graph, cost, slits, triangles, twins, cut);

  std::vector<Vec2d> square;
  ChartMap map;
  Packing packing;
  tbb::parallel_invoke([&] { square = FlattenToSquare(disk_positions, disk.triangles); },
                       [&] {
                         map = MapCharts(positions, triangles, twins, graph, cut);
                         std::vector<std::vector<Vec2d>> borders;
                         for (const Chart& chart : map.charts) {
                           borders.push_back(BorderInPlane(chart));
                         }
                         packing = PackCharts(
                             borders, options.size, options.gutter, options.packing_trials);
                       });

  Atlas atlas;
  atlas.size = options.size;
  atlas.skin_vertex = map.mesh.vertex;
  atlas.triangles = map.mesh.triangles;
  atlas.uv_i.resize(map.mesh.vertex.size());
  atlas.uv_ii.resize(map.mesh.vertex.size());
  for (std::size_t i = 0; i < map.charts.size(); ++i) {
    const Chart& chart = map.charts[i];
    const ChartPlace& place = packing.places[i];
    const double c = std::cos(place.angle), s = std::sin(place.angle);
    for (std::size_t v = 0; v < chart.vertices.size(); ++v) {
      const Vec2d& p = chart.uv[v];
      const Vec2d texel =
          packing.texels_per_unit * Vec2d(c * p.x() - s * p.y(), s * p.x() + c * p.y()) +
          place.offset;
      atlas.uv_i[chart.vertices[v]] =
          Vec2d(texel.x() / options.size, 1 - texel.y() / options.size).cast<float>();
    }
  }
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2d& p = square[disk.triangles[f][k]];
      atlas.uv_ii[map.mesh.triangles[f][k]] = Vec2d(p.x(), 1 - p.y()).cast<float>();
    }
  }
  return atlas;
}

}  // namespace dyxel
