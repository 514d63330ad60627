// The figures of an atlas: flips, overlap, stretch, fill; docs/method.md (A4).
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "dyxel/mesh/atlas.h"

namespace dyxel {
namespace {

double Cross(const Vec2d& a, const Vec2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Calls claim(pixel, strictly) for the texel centres within the triangle abc (texels).
template <class Claim>
void ForTexelsIn(const std::array<Vec2d, 3>& p, int size, Claim&& claim) {
  const double area = Cross(p[1] - p[0], p[2] - p[0]);
  if (area == 0) return;
  const auto range = [&](int axis, int& from, int& to) {
    const double low = std::min({p[0][axis], p[1][axis], p[2][axis]});
    const double high = std::max({p[0][axis], p[1][axis], p[2][axis]});
    from = std::max(0, static_cast<int>(std::ceil(low - 0.5)));
    to = std::min(size - 1, static_cast<int>(std::floor(high - 0.5)));
  };
  int x0, x1, y0, y1;
  range(0, x0, x1);
  range(1, y0, y1);
  const double sign = area > 0 ? 1 : -1;
  // Centres within 1e-7 texels of an edge belong to both of its triangles without overlap.
  std::array<double, 3> slack;
  for (std::size_t k = 0; k < 3; ++k) slack[k] = 1e-7 * (p[(k + 1) % 3] - p[k]).norm();
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const Vec2d centre(x + 0.5, y + 0.5);
      bool inside = true, strictly = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const double side = sign * Cross(p[(k + 1) % 3] - p[k], centre - p[k]);
        inside = inside && side >= -slack[k];
        strictly = strictly && side > slack[k];
      }
      if (inside) claim(static_cast<std::size_t>(y) * size + x, strictly);
    }
  }
}

}  // namespace

// Stretch is Sander et al. 2001's of the map from the plane to the surface, with singular values
// Γ >= γ: L² = (Γ² + γ²)/2 a triangle, its mean weighted by the surface's area; L∞ the greatest Γ;
// both times the square root of the whole map's area over the surface's. Infinite where a triangle
// with area on the surface has none in the plane. Orientation is that of the map's greater part.
AtlasQuality MeasureAtlas(std::span<const Vec3f> skin_positions,
                          const Atlas& atlas,
                          std::span<const Vec2f> uv) {
  AtlasQuality quality;
  const int size = atlas.size;
  std::vector<std::uint8_t> strict(static_cast<std::size_t>(size) * size, 0);
  std::vector<std::uint8_t> used(strict.size(), 0);
  std::size_t positive = 0, negative = 0, none = 0;
  double surface_area = 0, plane_area = 0, stretch_sum = 0, stretch_max = 0;
  for (const Triangle& t : atlas.triangles) {
    std::array<Vec2d, 3> p;
    std::array<Vec3d, 3> q;
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = uv[t[k]].cast<double>() * size;
      q[k] = skin_positions[atlas.skin_vertex[t[k]]].cast<double>();
    }
    const double signed_area = Cross(p[1] - p[0], p[2] - p[0]) / 2;
    ++(signed_area > 0 ? positive : (signed_area < 0 ? negative : none));
    ForTexelsIn(p, size, [&](std::size_t pixel, bool strictly) {
      used[pixel] = 1;
      if (strictly && strict[pixel] < 2) ++strict[pixel];
    });

    const double area = (q[1] - q[0]).cross(q[2] - q[0]).norm() / 2;
    surface_area += area;
    plane_area += std::abs(signed_area);
    if (!(area > 0)) continue;
    // Derivatives of the surface by the plane's coordinates.
    const Vec3d by_x = (q[0] * (p[1].y() - p[2].y()) + q[1] * (p[2].y() - p[0].y()) +
                        q[2] * (p[0].y() - p[1].y())) /
                       (2 * signed_area);
    const Vec3d by_y = (q[0] * (p[2].x() - p[1].x()) + q[1] * (p[0].x() - p[2].x()) +
                        q[2] * (p[1].x() - p[0].x())) /
                       (2 * signed_area);
    const double a = by_x.squaredNorm(), b = by_x.dot(by_y), c = by_y.squaredNorm();
    if (signed_area == 0) {
      stretch_sum = stretch_max = std::numeric_limits<double>::infinity();
      continue;
    }
    stretch_sum += area * (a + c) / 2;
    const double root = std::sqrt((a - c) * (a - c) + 4 * b * b);
    stretch_max = std::max(stretch_max, std::sqrt((a + c + root) / 2));
  }
  const double scale = std::sqrt(plane_area / surface_area);
  quality.flips = static_cast<int>(none + std::min(positive, negative));
  quality.overlap = static_cast<int>(std::count(strict.begin(), strict.end(), 2));
  quality.stretch_l2 = std::sqrt(stretch_sum / surface_area) * scale;
  quality.stretch_linf = stretch_max * scale;
  quality.fill = static_cast<double>(std::count(used.begin(), used.end(), 1)) /
                 static_cast<double>(used.size());
  return quality;
}

}  // namespace dyxel
