#include "dyxel/mesh/given_atlas.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/mesh/adjacency.h"
#include "dyxel/mesh/chart_flatten.h"
#include "dyxel/mesh/chart_packing.h"
#include "dyxel/mesh/chart_split.h"
#include "dyxel/mesh/texel_grid.h"

namespace dyxel {
namespace {

constexpr int kMostTrials = 300;      // of the packing: with many charts a step takes long
constexpr double kMeanEnergy = 1.15;  // a chart with more distortion is cut (1: an isometry)
constexpr double kHighEnergy = 3;
constexpr double kBulky = 0.01;    // share of the texture from which a chart must also pack well:
constexpr double kBoxShare = 0.6;  // fill this much of its smallest box

std::size_t At(int i) { return static_cast<std::size_t>(i); }

double Cross(const Vec2d& a, const Vec2d& b, const Vec2d& p) {
  return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x());
}

// A chart cut out of the surface, with vertices of its own.
struct Chart {
  std::vector<int> faces;           // of the surface
  std::vector<int> vertex;          // of the surface, of each own vertex
  std::vector<Triangle> triangles;  // of own vertices, in the order of `faces`
  std::vector<Vec2d> uv;            // metres
  bool good = false;
};

// Own vertices: one for each fan of triangles that hang together around a vertex.
Chart MakeChart(std::span<const Triangle> triangles,
                std::span<const std::array<int, 3>> opposite,
                std::vector<int> faces,
                std::vector<int>& local_of) {
  Chart chart;
  chart.faces = std::move(faces);
  const std::size_t n = chart.faces.size();
  for (std::size_t i = 0; i < n; ++i) local_of[At(chart.faces[i])] = static_cast<int>(i);
  std::vector<int> parent(3 * n);  // of corners
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](int c) {
    while (parent[At(c)] != c) c = parent[At(c)] = parent[At(parent[At(c)])];
    return c;
  };
  const auto join = [&](int a, int b) {
    const int x = find(a);
    const int y = find(b);
    parent[At(std::max(x, y))] = std::min(x, y);
  };
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t e = 0; e < 3; ++e) {
      const int other = opposite[At(chart.faces[i])][e];
      if (other < 0 || local_of[At(other / 3)] < 0) continue;
      const int j = local_of[At(other / 3)];
      const int k = other % 3;
      join(static_cast<int>(3 * i + e), 3 * j + (k + 1) % 3);
      join(static_cast<int>(3 * i + (e + 1) % 3), 3 * j + k);
    }
  }
  std::vector<int> number(3 * n, -1);
  for (std::size_t i = 0; i < n; ++i) {
    Triangle own;
    for (std::size_t c = 0; c < 3; ++c) {
      int& v = number[At(find(static_cast<int>(3 * i + c)))];
      if (v < 0) {
        v = static_cast<int>(chart.vertex.size());
        chart.vertex.push_back(triangles[At(chart.faces[i])][c]);
      }
      own[c] = v;
    }
    chart.triangles.push_back(own);
  }
  for (const int f : chart.faces) local_of[At(f)] = -1;
  return chart;
}

// Share of its smallest box (over some angles) that a flat chart fills.
double BoxShare(const Chart& chart) {
  double area = 0;
  for (const Triangle& t : chart.triangles) {
    area += 0.5 * Cross(chart.uv[At(t[0])], chart.uv[At(t[1])], chart.uv[At(t[2])]);
  }
  double smallest = 1e30;
  for (int i = 0; i < 12; ++i) {
    const double c = std::cos(kPiD / 24 * i);
    const double s = std::sin(kPiD / 24 * i);
    Vec2d low = Vec2d::Constant(1e30);
    Vec2d high = -low;
    for (const Vec2d& p : chart.uv) {
      const Vec2d q(c * p.x() - s * p.y(), s * p.x() + c * p.y());
      low = low.cwiseMin(q);
      high = high.cwiseMax(q);
    }
    smallest = std::min(smallest, (high - low).prod());
  }
  return smallest > 0 ? area / smallest : 1;
}

// Texels of `scale` a metre whose centres two triangles claim.
int CountOverlap(const Chart& chart, double scale) {
  Vec2d low = Vec2d::Constant(1e30);
  Vec2d high = -low;
  for (const Vec2d& p : chart.uv) {
    low = low.cwiseMin(p * scale);
    high = high.cwiseMax(p * scale);
  }
  const int width = static_cast<int>(high.x() - low.x()) + 1;
  const int height = static_cast<int>(high.y() - low.y()) + 1;
  std::vector<std::uint8_t> claimed(At(width) * At(height), 0);
  int overlap = 0;
  for (const Triangle& t : chart.triangles) {
    const Vec2d a = chart.uv[At(t[0])] * scale - low;
    const Vec2d b = chart.uv[At(t[1])] * scale - low;
    const Vec2d c = chart.uv[At(t[2])] * scale - low;
    const Vec2d from = a.cwiseMin(b).cwiseMin(c);
    const Vec2d to = a.cwiseMax(b).cwiseMax(c);
    for (int y = static_cast<int>(std::ceil(from.y() - 0.5)); y + 0.5 <= to.y(); ++y) {
      for (int x = static_cast<int>(std::ceil(from.x() - 0.5)); x + 0.5 <= to.x(); ++x) {
        if (x < 0 || y < 0 || x >= width || y >= height) continue;
        const Vec2d p(x + 0.5, y + 0.5);
        if (std::min({Cross(a, b, p), Cross(b, c, p), Cross(c, a, p)}) < 1e-6) continue;
        std::uint8_t& count = claimed[At(y) * At(width) + At(x)];
        if (count == 1) ++overlap;
        if (count < 2) ++count;
      }
    }
  }
  return overlap;
}

// Border of a chart as a closed polygon: the loop of greatest area.
std::vector<Vec2d> OuterBorder(const Chart& chart) {
  const auto opposite = OppositeHalfEdges(chart.triangles, static_cast<int>(chart.vertex.size()));
  std::vector<int> next(chart.vertex.size(), -1);
  for (std::size_t f = 0; f < opposite.size(); ++f) {
    for (std::size_t e = 0; e < 3; ++e) {
      if (opposite[f][e] < 0) next[At(chart.triangles[f][e])] = chart.triangles[f][(e + 1) % 3];
    }
  }
  std::vector<Vec2d> best;
  double best_area = -1;
  for (std::size_t v = 0; v < next.size(); ++v) {
    std::vector<Vec2d> loop;
    double area = 0;
    int at = static_cast<int>(v);
    while (next[At(at)] >= 0) {
      loop.push_back(chart.uv[At(at)]);
      const int to = next[At(at)];
      next[At(at)] = -1;
      area +=
          chart.uv[At(at)].x() * chart.uv[At(to)].y() - chart.uv[At(at)].y() * chart.uv[At(to)].x();
      at = to;
    }
    if (loop.size() >= 3 && std::abs(area) > best_area) {
      best_area = std::abs(area);
      best = std::move(loop);
    }
  }
  return best;
}

double SurfaceArea(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
  double area = 0;
  for (const Triangle& t : triangles) {
    const Vec3d a = positions[At(t[0])].cast<double>();
    area += 0.5 * (positions[At(t[1])].cast<double>() - a)
                      .cross(positions[At(t[2])].cast<double>() - a)
                      .norm();
  }
  return area;
}

// Cuts charts until each has a good map. Charts of one round are flattened side by side.
std::vector<Chart> CutCharts(std::span<const Vec3f> positions,
                             std::span<const Triangle> triangles,
                             std::span<const std::array<int, 3>> opposite,
                             double texels_per_metre,
                             double area,
                             bool divide) {
  std::vector<int> all(triangles.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<std::vector<int>> open =
      internal::ConnectedParts(opposite, all, static_cast<int>(triangles.size()));
  std::vector<int> local_of(triangles.size(), -1);
  std::vector<Chart> done;
  while (!open.empty()) {
    std::vector<Chart> round;
    for (std::vector<int>& faces : open) {
      round.push_back(MakeChart(triangles, opposite, std::move(faces), local_of));
    }
    std::vector<std::vector<std::vector<int>>> parts(round.size());
    ParallelFor(round.size(), [&](std::size_t i) {
      Chart& chart = round[i];
      std::vector<Vec3f> own(chart.vertex.size());
      for (std::size_t v = 0; v < own.size(); ++v) own[v] = positions[At(chart.vertex[v])];
      const auto own_opposite = OppositeHalfEdges(chart.triangles, static_cast<int>(own.size()));
      bool closed = true;
      for (const auto& sides : own_opposite) {
        closed = closed && std::min({sides[0], sides[1], sides[2]}) >= 0;
      }
      if (!closed) {
        internal::FlatChart flat = internal::FlattenChart(own, chart.triangles);
        chart.uv = std::move(flat.uv);
        chart.good = flat.flips == 0 && flat.mean_energy < kMeanEnergy &&
                     flat.high_energy < kHighEnergy && CountOverlap(chart, texels_per_metre) == 0;
      }
      bool bulky = false;
      if (divide && chart.good) {
        double own_area = 0;
        for (const int f : chart.faces) own_area += SurfaceArea(positions, {&triangles[At(f)], 1});
        bulky = own_area > kBulky * area && BoxShare(chart) < kBoxShare;
      }
      // A single triangle always has a map.
      if ((!chart.good || bulky) && chart.faces.size() > 1) {
        parts[i] = internal::SplitChart(positions, triangles, opposite, chart.faces, bulky);
      }
    });
    open.clear();
    for (std::size_t i = 0; i < round.size(); ++i) {
      if (parts[i].empty()) {
        done.push_back(std::move(round[i]));
      } else {
        for (auto& part : parts[i]) open.push_back(std::move(part));
      }
    }
  }
  std::stable_sort(done.begin(), done.end(), [](const Chart& a, const Chart& b) {
    return a.faces[0] < b.faces[0];
  });
  return done;
}

}  // namespace

std::vector<Vec2f> ReadPlyTextureCoordinates(const std::filesystem::path& path) {
  const std::vector<std::string> pairs[] = {{"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}};
  for (const std::vector<std::string>& names : pairs) {
    const std::vector<std::vector<float>> values = ReadPlyVertexProperties(path, names);
    if (values.empty()) continue;
    std::vector<Vec2f> uv(values[0].size());
    for (std::size_t v = 0; v < uv.size(); ++v) uv[v] = {values[0][v], 1 - values[1][v]};
    return uv;
  }
  return {};
}

bool IsUsableParameterization(std::span<const Vec3f> positions,
                              std::span<const Triangle> triangles,
                              std::span<const Vec2f> uv,
                              int size) {
  if (uv.size() != positions.size() || triangles.empty()) return false;
  for (const Vec2f& p : uv) {
    if (!(p.allFinite() && p.minCoeff() >= 0 && p.maxCoeff() <= 1)) return false;
  }
  Atlas atlas;
  atlas.size = size;
  atlas.skin_vertex.resize(positions.size());
  std::iota(atlas.skin_vertex.begin(), atlas.skin_vertex.end(), 0);
  atlas.triangles.assign(triangles.begin(), triangles.end());
  atlas.uv_i.assign(uv.begin(), uv.end());
  const std::vector<int> chart = ChartOfTriangles(atlas);
  std::vector<int> turn(triangles.size(), 0);  // of each chart
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const Triangle& t = triangles[f];
    const Vec3f ab = positions[At(t[1])] - positions[At(t[0])];
    const Vec3f ac = positions[At(t[2])] - positions[At(t[0])];
    if (!(ab.cross(ac).norm() > 0)) continue;
    const double area = Cross(
        uv[At(t[0])].cast<double>(), uv[At(t[1])].cast<double>(), uv[At(t[2])].cast<double>());
    const int sign = area > 0 ? 1 : (area < 0 ? -1 : 0);
    int& expected = turn[At(chart[f])];
    if (expected == 0) expected = sign;
    if (sign == 0 || sign != expected) return false;
  }
  const AtlasQuality quality = MeasureAtlas(positions, atlas, atlas.uv_i);
  return quality.overlap <= 0.001 * quality.fill * size * size;
}

Atlas MakeGivenAtlas(std::span<const Vec3f> positions,
                     std::span<const Triangle> triangles,
                     std::span<const Vec2f> uv,
                     const AtlasOptions& options) {
  CheckOptions("atlas", options);
  const int size = options.size;
  Atlas atlas;
  atlas.size = size;
  if (!uv.empty() && IsUsableParameterization(positions, triangles, uv, size)) {
    atlas.skin_vertex.resize(positions.size());
    std::iota(atlas.skin_vertex.begin(), atlas.skin_vertex.end(), 0);
    atlas.triangles.assign(triangles.begin(), triangles.end());
    atlas.uv_i.assign(uv.begin(), uv.end());
    return atlas;
  }
  const double area = SurfaceArea(positions, triangles);
  Require(area > 0, Fault::kInput, "The given surface has no area. Give a mesh with triangles.");

  // Triangles hang together over edges that exactly two of them share, facing the same way.
  auto opposite = OppositeHalfEdges(triangles, static_cast<int>(positions.size()));
  for (std::size_t f = 0; f < opposite.size(); ++f) {
    for (std::size_t e = 0; e < 3; ++e) {
      const int other = opposite[f][e];
      if (other < 0) continue;
      const Triangle& t = triangles[At(other / 3)];
      if (t[At((other + 1) % 3)] != triangles[f][e]) opposite[f][e] = -1;
    }
  }
  const double scale = size * std::sqrt(0.6 / area);
  std::vector<Chart> charts =
      CutCharts(positions, triangles, opposite, scale, area, options.divide);
  std::vector<std::vector<Vec2d>> borders;
  for (const Chart& chart : charts) borders.push_back(OuterBorder(chart));
  const internal::Packing packing = internal::PackCharts(
      borders, size, options.gutter, std::min(options.packing_trials, kMostTrials));

  atlas.triangles.resize(triangles.size());
  for (std::size_t i = 0; i < charts.size(); ++i) {
    const Chart& chart = charts[i];
    const internal::ChartPlace& place = packing.places[i];
    const int shift = static_cast<int>(atlas.skin_vertex.size());
    const double c = std::cos(place.angle) * packing.texels_per_unit;
    const double s = std::sin(place.angle) * packing.texels_per_unit;
    for (std::size_t v = 0; v < chart.vertex.size(); ++v) {
      const Vec2d& p = chart.uv[v];
      const Vec2d texel = Vec2d(c * p.x() - s * p.y(), s * p.x() + c * p.y()) + place.offset;
      atlas.skin_vertex.push_back(chart.vertex[v]);
      // v grows downwards in the image: turned over, so that the image is not mirrored.
      atlas.uv_i.push_back((Vec2d(texel.x(), size - texel.y()) / size).cast<float>());
    }
    for (std::size_t f = 0; f < chart.faces.size(); ++f) {
      const Triangle& t = chart.triangles[f];
      atlas.triangles[At(chart.faces[f])] = {t[0] + shift, t[1] + shift, t[2] + shift};
    }
  }
  return atlas;
}

}  // namespace dyxel
