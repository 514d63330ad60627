#include "dyxel/mesh/exposure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dyxel/base/parallel.h"

namespace dyxel::internal {
namespace {

constexpr int kMapSize = 224;

// Direction i of n on a Fibonacci sphere.
Vec3f FibonacciDirection(int i, int n) {
  const float z = 1 - (2 * static_cast<float>(i) + 1) / static_cast<float>(n);
  const float r = std::sqrt(std::max(0.0F, 1 - z * z));
  const float phi = static_cast<float>(i) * kPi * (3 - std::sqrt(5.0F));
  return {r * std::cos(phi), r * std::sin(phi), z};
}

std::vector<Vec3f> UnitNormals(std::span<const Vec3f> positions,
                               std::span<const Triangle> triangles) {
  std::vector<Vec3f> normals(positions.size(), Vec3f::Zero());
  for (const Triangle& t : triangles) {
    const Vec3f n = (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
    for (const int v : t) normals[v] += n;
  }
  for (Vec3f& n : normals) n.normalize();
  return normals;
}

// Greatest height along the view direction at each pixel, of points (x, y in pixels, z height).
// Vertices are splatted too, so that triangles between pixel centres leave no holes.
void DrawHeights(std::span<const Vec3f> points,
                 std::span<const Triangle> triangles,
                 std::vector<float>& map) {
  std::fill(map.begin(), map.end(), -std::numeric_limits<float>::infinity());
  const auto raise = [&](int x, int y, float z) {
    float& m = map[static_cast<std::size_t>(y * kMapSize + x)];
    m = std::max(m, z);
  };
  for (const Vec3f& p : points) raise(static_cast<int>(p.x()), static_cast<int>(p.y()), p.z());
  for (const Triangle& t : triangles) {
    const Vec3f &a = points[t[0]], &b = points[t[1]], &c = points[t[2]];
    const float area = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
    if (!(area > 0)) continue;  // faces away
    const int x0 = static_cast<int>(std::ceil(std::min({a.x(), b.x(), c.x()}) - 0.5F));
    const int x1 = static_cast<int>(std::floor(std::max({a.x(), b.x(), c.x()}) - 0.5F));
    const int y0 = static_cast<int>(std::ceil(std::min({a.y(), b.y(), c.y()}) - 0.5F));
    const int y1 = static_cast<int>(std::floor(std::max({a.y(), b.y(), c.y()}) - 0.5F));
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const float px = static_cast<float>(x) + 0.5F, py = static_cast<float>(y) + 0.5F;
        const float wb = ((px - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (py - a.y())) / area;
        const float wc = ((b.x() - a.x()) * (py - a.y()) - (px - a.x()) * (b.y() - a.y())) / area;
        if (wb < 0 || wc < 0 || wb + wc > 1) continue;
        raise(x, y, a.z() + wb * (b.z() - a.z()) + wc * (c.z() - a.z()));
      }
    }
  }
}

}  // namespace

std::vector<float> Exposure(std::span<const Vec3f> positions,
                            std::span<const Triangle> triangles,
                            int num_directions) {
  const std::vector<Vec3f> normals = UnitNormals(positions, triangles);
  Vec3f low = positions[0], high = positions[0];
  for (const Vec3f& p : positions) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vec3f centre = (low + high) / 2;
  const float pixels_per_metre =
      (static_cast<float>(kMapSize) - 4) / std::max((high - low).norm(), 1e-20F);
  struct Sums {
    std::vector<float> seen, all;
  };
  const Sums none{std::vector<float>(positions.size(), 0.0F),
                  std::vector<float>(positions.size(), 0.0F)};
  const Sums sums = ParallelReduce(
      static_cast<std::size_t>(num_directions),
      8,
      none,
      [&](std::size_t begin, std::size_t end) {
        Sums part = none;
        std::vector<float> map(static_cast<std::size_t>(kMapSize) * kMapSize);
        std::vector<Vec3f> points(positions.size());
        for (std::size_t d = begin; d < end; ++d) {
          const Vec3f to_sky = FibonacciDirection(static_cast<int>(d), num_directions);
          const Vec3f x_axis = to_sky.unitOrthogonal();
          const Vec3f y_axis = to_sky.cross(x_axis);
          for (std::size_t v = 0; v < positions.size(); ++v) {
            const Vec3f p = (positions[v] - centre) * pixels_per_metre;
            points[v] = {p.dot(x_axis) + kMapSize / 2, p.dot(y_axis) + kMapSize / 2, p.dot(to_sky)};
          }
          DrawHeights(points, triangles, map);
          for (std::size_t v = 0; v < positions.size(); ++v) {
            const float cosine = normals[v].dot(to_sky);
            if (!(cosine > 0)) continue;
            part.all[v] += cosine;
            const float height = map[static_cast<std::size_t>(
                static_cast<int>(points[v].y()) * kMapSize + static_cast<int>(points[v].x()))];
            // A surface of slope 1/cosine rises this much over a pixel.
            const float slack = 1.0F + 1.5F / std::max(cosine, 0.1F);
            if (points[v].z() + slack >= height) part.seen[v] += cosine;
          }
        }
        return part;
      },
      [](Sums& total, const Sums& part) {
        for (std::size_t v = 0; v < total.all.size(); ++v) {
          total.seen[v] += part.seen[v];
          total.all[v] += part.all[v];
        }
      });
  std::vector<float> exposure(positions.size());
  for (std::size_t v = 0; v < exposure.size(); ++v) {
    exposure[v] = sums.all[v] > 0 ? sums.seen[v] / sums.all[v] : 0.0F;
  }
  return exposure;
}

}  // namespace dyxel::internal
