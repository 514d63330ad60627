#include "dyxel/mesh/closed_atlas.h"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_invoke.h>

#include "dyxel/mesh/chart_cuts.h"
#include "dyxel/mesh/chart_packing.h"
#include "dyxel/mesh/charts.h"
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

}  // namespace

Atlas MakeClosedAtlas(std::span<const Vec3f> positions,
                      std::span<const Triangle> triangles,
                      const AtlasOptions& options) {
  CheckOptions("atlas", options);
  const int num_vertices = static_cast<int>(positions.size());
  Skin skin{positions, triangles, FindTwins(triangles, num_vertices), {}};
  RequireSphere(triangles, skin.twins, num_vertices);
  skin.graph = MakeVertexGraph(triangles, num_vertices);

  const std::vector<float> length = EdgeLengths(skin.graph, positions);
  const std::vector<float> cost = SeamCost(skin.graph, length, Exposure(positions, triangles));
  const Ends ends = FindEnds(skin.graph, length);
  const Seam seam = JoinInduced(skin.graph, cost, ends.main);
  std::vector<char> seam_cut(skin.twins.size(), 0);
  MarkCut(triangles, skin.twins, skin.graph, seam.edges, seam_cut);

  const CutMesh disk = CutOpen(triangles, skin.twins, seam_cut, num_vertices);
  std::vector<Vec2d> square;
  Charts charts;
  Packing packing;
  tbb::parallel_invoke(
      [&] {
        std::vector<Vec3f> disk_positions;
        for (const int v : disk.vertex) disk_positions.push_back(positions[v]);
        square = FlattenToSquare(disk_positions, disk.triangles);
      },
      [&] {
        // Slits to the lesser extremities, and to greater ones that the seam could not reach.
        std::vector<char> cut = seam_cut;
        CutSlits(skin.graph, cost, ends.minor, triangles, skin.twins, cut);
        CutSlits(skin.graph, cost, ends.main, triangles, skin.twins, cut);
        charts = FlattenCharts(skin, cut);
        if (options.divide) TightenCharts(skin, cut, charts);
        std::vector<std::vector<Vec2d>> borders;
        for (const Chart& chart : charts.charts) borders.push_back(BorderInPlane(chart));
        packing = PackCharts(borders, options.size, options.gutter, options.packing_trials);
      });

  Atlas atlas;
  atlas.size = options.size;
  atlas.skin_vertex = charts.mesh.vertex;
  atlas.triangles = charts.mesh.triangles;
  atlas.uv_i.resize(atlas.skin_vertex.size());
  atlas.uv_ii.resize(atlas.skin_vertex.size());
  for (std::size_t i = 0; i < charts.charts.size(); ++i) {
    const Chart& chart = charts.charts[i];
    const Eigen::Rotation2Dd turn(packing.places[i].angle);
    for (std::size_t v = 0; v < chart.vertices.size(); ++v) {
      const Vec2d texel = packing.texels_per_unit * (turn * chart.uv[v]) + packing.places[i].offset;
      atlas.uv_i[chart.vertices[v]] =
          Vec2d(texel.x() / options.size, 1 - texel.y() / options.size).cast<float>();
    }
  }
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2d& p = square[disk.triangles[f][k]];
      atlas.uv_ii[atlas.triangles[f][k]] = Vec2d(p.x(), 1 - p.y()).cast<float>();
    }
  }
  return atlas;
}

}  // namespace dyxel
