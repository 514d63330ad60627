#include "dyxel/studio/surface_nets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "dyxel/base/parallel.h"

namespace dyxel::studio {
namespace {

constexpr int kBlock = 8;  // cells a side that are skipped together

struct Grid {
  const GridLines &x, &y, &z;
  int nx, ny, nz;            // lines
  std::vector<float> value;  // [nz][ny][nx]

  [[nodiscard]] std::size_t At(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(ny) +
            static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(nx) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] Vec3f Point(int i, int j, int k) const {
    return {x[static_cast<std::size_t>(i)],
            y[static_cast<std::size_t>(j)],
            z[static_cast<std::size_t>(k)]};
  }
};

// Values at all lines near the surface; elsewhere only their sign (±1 m).
void FillGrid(const std::function<float(const Vec3f&)>& distance, Grid& grid) {
  const int blocks_z = (grid.nz + kBlock - 1) / kBlock;
  ParallelFor(static_cast<std::size_t>(blocks_z), [&](std::size_t block) {
    const int k0 = static_cast<int>(block) * kBlock;
    const int k1 = std::min(k0 + kBlock, grid.nz);
    for (int j0 = 0; j0 < grid.ny; j0 += kBlock) {
      const int j1 = std::min(j0 + kBlock, grid.ny);
      for (int i0 = 0; i0 < grid.nx; i0 += kBlock) {
        const int i1 = std::min(i0 + kBlock, grid.nx);
        // One line more, since its neighbours' cells reach into this block.
        const Vec3f low = grid.Point(std::max(i0 - 1, 0), std::max(j0 - 1, 0), std::max(k0 - 1, 0));
        const Vec3f high = grid.Point(
            std::min(i1, grid.nx - 1), std::min(j1, grid.ny - 1), std::min(k1, grid.nz - 1));
        const float at_center = distance(0.5F * (low + high));
        const bool far = std::abs(at_center) > 1.34F * 0.5F * (high - low).norm();
        for (int k = k0; k < k1; ++k) {
          for (int j = j0; j < j1; ++j) {
            for (int i = i0; i < i1; ++i) {
              grid.value[grid.At(i, j, k)] =
                  far ? std::copysign(1.0F, at_center) : distance(grid.Point(i, j, k));
            }
          }
        }
      }
    }
  });
}

// The vertex of a cell: the mean of its edges' crossings.
Vec3f CellVertex(const Grid& grid, int i, int j, int k) {
  std::array<float, 8> value;
  std::array<Vec3f, 8> point;
  for (int c = 0; c < 8; ++c) {
    const auto n = static_cast<std::size_t>(c);
    const int ci = i + (c & 1);
    const int cj = j + ((c >> 1) & 1);
    const int ck = k + ((c >> 2) & 1);
    value[n] = grid.value[grid.At(ci, cj, ck)];
    point[n] = grid.Point(ci, cj, ck);
  }
  Vec3f sum = Vec3f::Zero();
  float count = 0;
  for (std::size_t a = 0; a < 8; ++a) {
    for (const std::size_t bit : {std::size_t{1}, std::size_t{2}, std::size_t{4}}) {
      const std::size_t b = a | bit;
      if (b == a || (value[a] < 0) == (value[b] < 0)) continue;
      const float t = value[a] / (value[a] - value[b]);
      sum += point[a] + t * (point[b] - point[a]);
      count += 1;
    }
  }
  return sum / count;
}

}  // namespace

GridLines MakeGridLines(float low, float high, float cell, std::span<const FineZone> zones) {
  GridLines lines;
  float at = low;
  while (at < high) {
    lines.push_back(at);
    float step = cell;
    for (const FineZone& zone : zones) {
      if (at >= zone.low && at < zone.high) step = std::min(step, cell * zone.factor);
    }
    at += step;
  }
  lines.push_back(at);
  return lines;
}

TriangleMesh MeshDistance(const std::function<float(const Vec3f&)>& distance,
                          const GridLines& x,
                          const GridLines& y,
                          const GridLines& z) {
  Grid grid{x,
            y,
            z,
            static_cast<int>(x.size()),
            static_cast<int>(y.size()),
            static_cast<int>(z.size()),
            std::vector<float>(x.size() * y.size() * z.size())};
  FillGrid(distance, grid);

  TriangleMesh mesh;
  std::vector<int> vertex_of(grid.value.size(), -1);
  for (int k = 0; k + 1 < grid.nz; ++k) {
    for (int j = 0; j + 1 < grid.ny; ++j) {
      for (int i = 0; i + 1 < grid.nx; ++i) {
        int inside = 0;
        for (int c = 0; c < 8; ++c) {
          inside += grid.value[grid.At(i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2))] < 0 ? 1 : 0;
        }
        if (inside == 0 || inside == 8) continue;
        vertex_of[grid.At(i, j, k)] = static_cast<int>(mesh.positions.size());
        mesh.positions.push_back(CellVertex(grid, i, j, k));
      }
    }
  }
  // A quad of the four cells around every grid edge that the surface crosses.
  const std::array<std::array<int, 3>, 3> axis = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (int k = 1; k + 1 < grid.nz; ++k) {
    for (int j = 1; j + 1 < grid.ny; ++j) {
      for (int i = 1; i + 1 < grid.nx; ++i) {
        const bool inside = grid.value[grid.At(i, j, k)] < 0;
        for (std::size_t a = 0; a < 3; ++a) {
          const auto& u = axis[(a + 1) % 3];
          const auto& v = axis[(a + 2) % 3];
          const bool next = grid.value[grid.At(i + axis[a][0], j + axis[a][1], k + axis[a][2])] < 0;
          if (inside == next) continue;
          const auto cell = [&](int du, int dv) {
            return vertex_of[grid.At(
                i - du * u[0] - dv * v[0], j - du * u[1] - dv * v[1], k - du * u[2] - dv * v[2])];
          };
          std::array<int, 4> q = {cell(0, 0), cell(1, 0), cell(1, 1), cell(0, 1)};
          if (!inside) std::swap(q[1], q[3]);
          const auto gap = [&](int m, int n) {
            return (mesh.positions[static_cast<std::size_t>(m)] -
                    mesh.positions[static_cast<std::size_t>(n)])
                .squaredNorm();
          };
          if (gap(q[0], q[2]) <= gap(q[1], q[3])) {
            mesh.triangles.push_back({q[0], q[1], q[2]});
            mesh.triangles.push_back({q[0], q[2], q[3]});
          } else {
            mesh.triangles.push_back({q[0], q[1], q[3]});
            mesh.triangles.push_back({q[1], q[2], q[3]});
          }
        }
      }
    }
  }
  // Onto the surface: two Newton steps along the gradient, never farther than half a cell.
  ParallelFor(mesh.positions.size(), [&](std::size_t n) {
    Vec3f& p = mesh.positions[n];
    const float step = 0.5F * (x[1] - x[0]);
    const Vec3f start = p;
    for (int round = 0; round < 2; ++round) {
      const float d = distance(p);
      constexpr float kDelta = 5e-4F;
      Vec3f gradient;
      for (int c = 0; c < 3; ++c) {
        Vec3f q = p;
        q[c] += kDelta;
        gradient[c] = (distance(q) - d) / kDelta;
      }
      p -= gradient * (d / std::max(gradient.squaredNorm(), 0.1F));
    }
    if ((p - start).norm() > step) p = start;
  });
  return mesh;
}

}  // namespace dyxel::studio
