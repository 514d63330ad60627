#include "dyxel/mesh/texel_grid.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "dyxel/base/parallel.h"
#include "dyxel/mesh/adjacency.h"

namespace dyxel {
namespace {

// Twice the signed area of (a, b, p), computed from the same end whichever way the edge is given,
// so that the triangles on both of its sides agree on where p lies.
double Cross(const Vec2d& a, const Vec2d& b, const Vec2d& p) {
  const bool forward = a.y() < b.y() || (a.y() == b.y() && a.x() < b.x());
  const Vec2d& from = forward ? a : b;
  const Vec2d& to = forward ? b : a;
  const double cross =
      (to.x() - from.x()) * (p.y() - from.y()) - (to.y() - from.y()) * (p.x() - from.x());
  return forward ? cross : -cross;
}

Vec2d TexelPosition(const Atlas& atlas, int cut_vertex) {
  return atlas.uv_i[static_cast<std::size_t>(cut_vertex)].cast<double>() * atlas.size;
}

}  // namespace

TexelGrid MakeTexelGrid(const Atlas& atlas) {
  const int size = atlas.size;
  const auto num_pixels = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  std::vector<int> triangle_at(num_pixels, -1);
  std::vector<Vec3f> bary_at(num_pixels);
  for (std::size_t f = 0; f < atlas.triangles.size(); ++f) {
    const Triangle& t = atlas.triangles[f];
    const Vec2d a = TexelPosition(atlas, t[0]);
    const Vec2d b = TexelPosition(atlas, t[1]);
    const Vec2d c = TexelPosition(atlas, t[2]);
    const double area = Cross(a, b, c);
    if (!(std::abs(area) > 0)) continue;
    const double sign = area > 0 ? 1 : -1;
    const Vec2d low = a.cwiseMin(b).cwiseMin(c);
    const Vec2d high = a.cwiseMax(b).cwiseMax(c);
    const int x0 = static_cast<int>(std::ceil(std::clamp(low.x() - 0.5, 0.0, double{1e9})));
    const int y0 = static_cast<int>(std::ceil(std::clamp(low.y() - 0.5, 0.0, double{1e9})));
    const int x1 = static_cast<int>(std::floor(std::clamp(high.x() - 0.5, -1.0, size - 1.0)));
    const int y1 = static_cast<int>(std::floor(std::clamp(high.y() - 0.5, -1.0, size - 1.0)));
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const auto at = static_cast<std::size_t>(y * size + x);
        if (triangle_at[at] >= 0) continue;
        const Vec2d p(x + 0.5, y + 0.5);
        const Vec3d weight = sign * Vec3d(Cross(b, c, p), Cross(c, a, p), Cross(a, b, p));
        if (weight.minCoeff() < 0) continue;
        const double sum = weight.sum();
        if (!(sum > 0)) continue;
        triangle_at[at] = static_cast<int>(f);
        bary_at[at] = (weight / sum).cast<float>();
      }
    }
  }
  TexelGrid grid;
  grid.size = size;
  grid.texel_at.assign(num_pixels, -1);
  for (std::size_t at = 0; at < num_pixels; ++at) {
    if (triangle_at[at] < 0) continue;
    grid.texel_at[at] = static_cast<int>(grid.pixel.size());
    grid.pixel.push_back(static_cast<int>(at));
    grid.triangle.push_back(triangle_at[at]);
    grid.bary.push_back(bary_at[at]);
  }
  grid.nearest = NearestTexels(grid);
  return grid;
}

std::vector<Vec2f> TexelsInSecond(const Atlas& atlas, const TexelGrid& grid) {
  std::vector<Vec2f> result(grid.count());
  for (std::size_t k = 0; k < grid.count(); ++k) {
    const Triangle& t = atlas.triangles[static_cast<std::size_t>(grid.triangle[k])];
    result[k] = atlas.uv_ii[static_cast<std::size_t>(t[0])] * grid.bary[k][0] +
                atlas.uv_ii[static_cast<std::size_t>(t[1])] * grid.bary[k][1] +
                atlas.uv_ii[static_cast<std::size_t>(t[2])] * grid.bary[k][2];
  }
  return result;
}

// Exact feature transform in two passes (Meijster, Roerdink, Hesselink 2000): nearest in the
// column, then the lower envelope of the columns' parabolas along each row.
std::vector<int> NearestTexels(const TexelGrid& grid) {
  const int size = grid.size;
  const auto n = static_cast<std::size_t>(size);
  std::vector<int> nearest(n * n, -1);
  if (grid.count() == 0) return nearest;
  std::vector<int> row_of(n * n, -1);  // nearest surface row in the column
  ParallelForBlocks(n, 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t x = begin; x < end; ++x) {
      int last = -1;
      for (int y = 0; y < size; ++y) {
        const std::size_t at = static_cast<std::size_t>(y) * n + x;
        if (grid.texel_at[at] >= 0) last = y;
        row_of[at] = last;
      }
      last = -1;
      for (int y = size - 1; y >= 0; --y) {
        const std::size_t at = static_cast<std::size_t>(y) * n + x;
        if (grid.texel_at[at] >= 0) last = y;
        if (last >= 0 && (row_of[at] < 0 || last - y < y - row_of[at])) row_of[at] = last;
      }
    }
  });
  ParallelForBlocks(n, 16, [&](std::size_t begin, std::size_t end) {
    std::vector<int> column(n);    // of the envelope's parabolas
    std::vector<double> start(n);  // from where each is the lowest
    for (std::size_t y = begin; y < end; ++y) {
      const int* const row = row_of.data() + y * n;
      const auto height = [&](int x) {
        const double d = row[x] - static_cast<double>(y);
        return d * d;
      };
      int top = -1;
      for (int x = 0; x < size; ++x) {
        if (row[x] < 0) continue;
        double from = -1e9;
        while (top >= 0) {
          const int other = column[static_cast<std::size_t>(top)];
          from = (height(x) - height(other) + static_cast<double>(x) * x -
                  static_cast<double>(other) * other) /
                 (2.0 * (x - other));
          if (from > start[static_cast<std::size_t>(top)]) break;
          --top;
          from = -1e9;
        }
        ++top;
        column[static_cast<std::size_t>(top)] = x;
        start[static_cast<std::size_t>(top)] = from;
      }
      int at = 0;
      for (int x = 0; x < size; ++x) {
        while (at < top && start[static_cast<std::size_t>(at) + 1] < x) ++at;
        const int from = column[static_cast<std::size_t>(at)];
        nearest[y * n + static_cast<std::size_t>(x)] = row[from] * size + from;
      }
    }
  });
  return nearest;
}

void FillGutters(const TexelGrid& grid, ImageF& map) {
  const std::vector<int>& nearest = grid.nearest;
  const auto channels = static_cast<std::size_t>(map.channels);
  ParallelForBlocks(nearest.size(), 65536, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; ++at) {
      if (grid.texel_at[at] >= 0 || nearest[at] < 0) continue;
      const float* const from = map.data.data() + static_cast<std::size_t>(nearest[at]) * channels;
      std::copy(from, from + channels, map.data.data() + at * channels);
    }
  });
}

std::vector<int> ChartOfTriangles(const Atlas& atlas) {
  // Union-find over cut vertices.
  std::vector<int> parent(atlas.skin_vertex.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto find = [&](int v) {
    while (parent[static_cast<std::size_t>(v)] != v) {
      int& up = parent[static_cast<std::size_t>(v)];
      up = parent[static_cast<std::size_t>(up)];
      v = up;
    }
    return v;
  };
  for (const Triangle& t : atlas.triangles) {
    const int a = find(t[0]);
    for (const int corner : {t[1], t[2]}) parent[static_cast<std::size_t>(find(corner))] = a;
  }
  std::vector<int> number(parent.size(), -1);
  std::vector<int> chart(atlas.triangles.size());
  int count = 0;
  for (std::size_t f = 0; f < chart.size(); ++f) {
    int& c = number[static_cast<std::size_t>(find(atlas.triangles[f][0]))];
    if (c < 0) c = count++;
    chart[f] = c;
  }
  return chart;
}

std::vector<std::array<int, 4>> TexelNeighbours(const Atlas& atlas, const TexelGrid& grid) {
  const int size = grid.size;
  const std::vector<int> chart = ChartOfTriangles(atlas);
  const auto cut_opposite =
      OppositeHalfEdges(atlas.triangles, static_cast<int>(atlas.skin_vertex.size()));
  std::vector<Triangle> skin_triangles(atlas.triangles.size());
  int num_skin = 0;
  for (std::size_t f = 0; f < skin_triangles.size(); ++f) {
    for (std::size_t c = 0; c < 3; ++c) {
      skin_triangles[f][c] = atlas.skin_vertex[static_cast<std::size_t>(atlas.triangles[f][c])];
      num_skin = std::max(num_skin, skin_triangles[f][c] + 1);
    }
  }
  const auto skin_opposite = OppositeHalfEdges(skin_triangles, num_skin);
  const auto texel_of = [&](const Vec2d& p) {
    const int x = static_cast<int>(std::floor(p.x()));
    const int y = static_cast<int>(std::floor(p.y()));
    return x >= 0 && y >= 0 && x < size && y < size
               ? grid.texel_at[static_cast<std::size_t>(y * size + x)]
               : -1;
  };
  const auto chart_of_texel = [&](int k) {
    return chart[static_cast<std::size_t>(grid.triangle[static_cast<std::size_t>(k)])];
  };

  // The texel beyond the seam that the step from p (in `triangle`) to `to` crosses, or -1.
  const auto across = [&](int triangle, Vec2d p, const Vec2d& to) {
    int entered = -1;  // half-edge of `triangle` that the walk came through
    for (int step = 0; step < 64; ++step) {
      const Triangle& t = atlas.triangles[static_cast<std::size_t>(triangle)];
      // The edge with p and `to` on different sides that is crossed first.
      int exit = -1;
      double exit_at = 2;
      Vec2d centre = Vec2d::Zero();
      for (const int v : t) centre += TexelPosition(atlas, v) / 3;
      for (int e = 0; e < 3; ++e) {
        if (e == entered) continue;
        const Vec2d a = TexelPosition(atlas, t[static_cast<std::size_t>(e)]);
        const Vec2d b = TexelPosition(atlas, t[static_cast<std::size_t>((e + 1) % 3)]);
        const double sign = Cross(a, b, centre) > 0 ? 1 : -1;
        const double here = std::max(sign * Cross(a, b, p), 0.0);
        const double there = sign * Cross(a, b, to);
        if (there >= 0) continue;
        const double at = here / (here - there);
        if (at < exit_at) {
          exit_at = at;
          exit = e;
        }
      }
      if (exit < 0) return -1;  // `to` is in this triangle, yet no texel of it
      const int next =
          cut_opposite[static_cast<std::size_t>(triangle)][static_cast<std::size_t>(exit)];
      if (next >= 0) {
        triangle = next / 3;
        entered = next % 3;
        continue;
      }
      const int other =
          skin_opposite[static_cast<std::size_t>(triangle)][static_cast<std::size_t>(exit)];
      if (other < 0) return -1;  // the surface ends here
      // Where on the edge, then half a texel or more into the other side.
      const Vec2d crossing = p + exit_at * (to - p);
      const int from = t[static_cast<std::size_t>(exit)];
      const Vec2d a = TexelPosition(atlas, from);
      const Vec2d ab = TexelPosition(atlas, t[static_cast<std::size_t>((exit + 1) % 3)]) - a;
      const double length2 = ab.squaredNorm();
      double along = length2 > 0 ? std::clamp((crossing - a).dot(ab) / length2, 0.0, 1.0) : 0.5;
      const Triangle& o = atlas.triangles[static_cast<std::size_t>(other / 3)];
      const int e = other % 3;
      const int o_from = o[static_cast<std::size_t>(e)];
      const int o_to = o[static_cast<std::size_t>((e + 1) % 3)];
      if (atlas.skin_vertex[static_cast<std::size_t>(o_from)] !=
          atlas.skin_vertex[static_cast<std::size_t>(from)]) {
        along = 1 - along;
      }
      const Vec2d oa = TexelPosition(atlas, o_from);
      const Vec2d ob = TexelPosition(atlas, o_to);
      const Vec2d oc = TexelPosition(atlas, o[static_cast<std::size_t>((e + 2) % 3)]);
      Vec2d inwards(-(ob - oa).y(), (ob - oa).x());
      if (inwards.dot(oc - oa) < 0) inwards = -inwards;
      const double norm = inwards.norm();
      if (norm > 0) inwards /= norm;
      const int other_chart = chart[static_cast<std::size_t>(other / 3)];
      const Vec2d entry = oa + along * (ob - oa);
      for (const double depth : {0.5, 0.75, 1.0, 0.25}) {
        const int k = texel_of(entry + depth * inwards);
        if (k >= 0 && chart_of_texel(k) == other_chart) return k;
      }
      return -1;
    }
    return -1;
  };

  constexpr std::array<std::array<int, 2>, 4> kSteps = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
  std::vector<std::array<int, 4>> neighbours(grid.count());
  ParallelForBlocks(grid.count(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Vec2d p(grid.pixel[k] % size + 0.5, grid.pixel[k] / size + 0.5);
      const int own = chart_of_texel(static_cast<int>(k));
      for (std::size_t d = 0; d < 4; ++d) {
        const Vec2d to = p + Vec2d(kSteps[d][0], kSteps[d][1]);
        const int next = texel_of(to);
        neighbours[k][d] =
            next >= 0 && chart_of_texel(next) == own ? next : across(grid.triangle[k], p, to);
      }
    }
  });
  return neighbours;
}

}  // namespace dyxel
