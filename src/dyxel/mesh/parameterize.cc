#include "dyxel/mesh/parameterize.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/error.h"
#include "dyxel/mesh/chart_division.h"
#include "dyxel/mesh/disk_hierarchy.h"
#include "dyxel/mesh/flatten.h"
#include "dyxel/mesh/half_edges.h"

namespace dyxel::internal {
namespace {

// Vertices of the disk on which the maps start.
constexpr int kCoarsest = 800;

// Triangles around each vertex, as ranges of one array; a corner is 3·triangle + corner.
struct Fans {
  std::vector<int> begin;   // (V + 1)
  std::vector<int> corner;  // (3F)
};

Fans MakeFans(std::span<const Triangle> triangles, std::size_t num_vertices) {
  Fans fans;
  fans.begin.assign(num_vertices + 1, 0);
  fans.corner.resize(3 * triangles.size());
  for (const Triangle& t : triangles) {
    for (const int v : t) ++fans.begin[v + 1];
  }
  for (std::size_t v = 0; v < num_vertices; ++v) fans.begin[v + 1] += fans.begin[v];
  std::vector<int> fill(fans.begin.begin(), fans.begin.end() - 1);
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      fans.corner[fill[triangles[f][k]]++] = static_cast<int>(3 * f + k);
    }
  }
  return fans;
}

// Energy of the triangles around vertex v were it at x.
double FanEnergy(const FlatMesh& mesh, const Fans& fans, int v, const Vec2d& x) {
  double energy = 0;
  for (int i = fans.begin[v]; i < fans.begin[v + 1]; ++i) {
    const int f = fans.corner[i] / 3;
    const Triangle& t = mesh.triangles[f];
    const std::size_t k = fans.corner[i] % 3;
    const RestTriangle& rest = mesh.rest[f];
    const Mat2d jacobian = x * rest.gradient[k].transpose() +
                           mesh.uv[t[(k + 1) % 3]] * rest.gradient[(k + 1) % 3].transpose() +
                           mesh.uv[t[(k + 2) % 3]] * rest.gradient[(k + 2) % 3].transpose();
    energy += rest.area * SymmetricDirichlet(jacobian);
  }
  return energy;
}

// One Newton step of vertex v alone, kept from turning a triangle over. |J|² is quadratic in the
// vertex and det J linear, so the derivatives are exact and short.
struct Relaxation {
  double gain = 0;     // what the energy fell by
  double density = 0;  // the energy before, over the area
};
Relaxation RelaxVertex(FlatMesh& mesh, const Fans& fans, int v, unsigned char freedom) {
  const Vec2d x = mesh.uv[v];
  double energy = 0, area = 0;
  Vec2d gradient = Vec2d::Zero();
  Mat2d hessian = Mat2d::Zero();
  for (int i = fans.begin[v]; i < fans.begin[v + 1]; ++i) {
    const int f = fans.corner[i] / 3;
    const Triangle& t = mesh.triangles[f];
    const std::size_t k = fans.corner[i] % 3;
    const RestTriangle& rest = mesh.rest[f];
    const Vec2d& g = rest.gradient[k];
    const Mat2d j = Jacobian(rest, mesh.uv[t[0]], mesh.uv[t[1]], mesh.uv[t[2]]);
    const double d = j.determinant(), q = j.squaredNorm();
    const double i2 = 1 / (d * d), i3 = i2 / d;
    const Vec2d dq = 2 * j * g;
    const Vec2d dd(j(1, 1) * g.x() - j(1, 0) * g.y(), j(0, 0) * g.y() - j(0, 1) * g.x());
    energy += rest.area * q * (1 + i2);
    area += rest.area;
    gradient += rest.area * ((1 + i2) * dq - 2 * q * i3 * dd);
    hessian += rest.area * (2 * g.squaredNorm() * (1 + i2) * Mat2d::Identity() -
                            2 * i3 * (dq * dd.transpose() + dd * dq.transpose()) +
                            6 * q * i2 * i2 * dd * dd.transpose());
  }
  Vec2d step = Vec2d::Zero();
  if (freedom == 3) {
    // Make the Hessian positive: |eigenvalues|, bounded from below.
    const double mean = (hessian(0, 0) + hessian(1, 1)) / 2;
    const double half = (hessian(0, 0) - hessian(1, 1)) / 2, off = hessian(0, 1);
    const double radius = std::sqrt(half * half + off * off);
    if (mean - radius < 1e-3 * (mean + radius)) {
      const double shift = 1e-3 * (std::abs(mean) + radius) - (mean - radius);
      hessian(0, 0) += shift;
      hessian(1, 1) += shift;
    }
    const double det = hessian(0, 0) * hessian(1, 1) - off * off;
    step = {-(hessian(1, 1) * gradient.x() - off * gradient.y()) / det,
            -(hessian(0, 0) * gradient.y() - off * gradient.x()) / det};
  } else {
    const int axis = freedom == 1 ? 0 : 1;
    step[axis] = -gradient[axis] / std::max(std::abs(hessian(axis, axis)), 1e-300);
  }
  const double slope = gradient.dot(step);
  if (!(slope < 0)) return {0, energy / area};
  // Longest step with every triangle on its side: areas are linear in x.
  double length = 1;
  for (int i = fans.begin[v]; i < fans.begin[v + 1]; ++i) {
    const Triangle& t = mesh.triangles[fans.corner[i] / 3];
    const std::size_t k = fans.corner[i] % 3;
    const Vec2d &a = mesh.uv[t[(k + 1) % 3]], &b = mesh.uv[t[(k + 2) % 3]];
    const double now = DoubleArea(a, b, x), then = DoubleArea(a, b, x + step);
    if (then < now) length = std::min(length, 0.8 * now / (now - then));
  }
  for (int halving = 0; halving < 10; ++halving, length /= 2) {
    const Vec2d trial = x + length * step;
    const double after = FanEnergy(mesh, fans, v, trial);
    if (after <= energy + 1e-4 * length * slope) {
      mesh.uv[v] = trial;
      return {energy - after, energy / area};
    }
  }
  return {0, energy / area};
}

// Gauss-Seidel sweeps to and fro until one gains less than `tolerance` of the energy.
void Relax(FlatMesh& mesh, const Freedom& freedom, int max_sweeps, double tolerance) {
  constexpr double kDense = 20;  // five times an isometry's
  constexpr int kMostSteps = 8;
  const Fans fans = MakeFans(mesh.triangles, mesh.uv.size());
  const double energy = TotalEnergy(mesh);
  const int n = static_cast<int>(mesh.uv.size());
  for (int sweep = 0; sweep < max_sweeps; ++sweep) {
    double gain = 0;
    for (int i = 0; i < n; ++i) {
      const int v = sweep % 2 == 0 ? i : n - 1 - i;
      if (freedom[v] == 0) continue;
      // A vertex just placed may sit in a corner of its ring: more steps at once.
      for (int step = 0; step < kMostSteps; ++step) {
        const Relaxation relaxation = RelaxVertex(mesh, fans, v, freedom[v]);
        gain += relaxation.gain;
        if (relaxation.density < kDense || relaxation.gain <= 0) break;
      }
    }
    if (gain < tolerance * energy) break;
  }
}

struct Disk {
  std::vector<Vec3d> positions;
  std::vector<int> border;
  std::vector<double> border_length;  // (B) before each border vertex, along the border
  double perimeter = 0;
};

Disk MakeDisk(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
  Disk disk;
  disk.positions.reserve(positions.size());
  for (const Vec3f& p : positions) disk.positions.push_back(p.cast<double>());
  disk.border = DiskBoundary(triangles, static_cast<int>(positions.size()));
  for (std::size_t i = 0; i < disk.border.size(); ++i) {
    disk.border_length.push_back(disk.perimeter);
    disk.perimeter +=
        (disk.positions[disk.border[(i + 1) % disk.border.size()]] - disk.positions[disk.border[i]])
            .norm();
  }
  return disk;
}

// The quasi-harmonic map with the border where `flat` has it, or Tutte's where that flips.
void StartFlat(FlatMesh& flat, std::span<const int> border) {
  std::vector<char> fixed(flat.uv.size(), 0);
  for (const int v : border) fixed[v] = 1;
  if (!QuasiHarmonicMap(flat, fixed)) TutteEmbedding(flat, fixed);
}

// Grows `hierarchy` back from its coarsest level, where `uv` is a good map, relaxing on the way.
void GrowBack(DiskHierarchy& hierarchy,
              std::vector<Vec2d>& uv,
              const Freedom& freedom,
              bool straight_border) {
  while (!hierarchy.AtFinest()) {
    hierarchy.Refine(uv, straight_border);
    DiskHierarchy::Level level = hierarchy.Current();
    FlatMesh flat{std::move(level.triangles), std::move(level.rest), {}};
    Freedom level_freedom;
    for (const int v : level.vertices) {
      flat.uv.push_back(uv[v]);
      level_freedom.push_back(freedom[v]);
    }
    Relax(flat, level_freedom, hierarchy.AtFinest() ? 10 : 5, 1e-4);
    for (std::size_t i = 0; i < level.vertices.size(); ++i) uv[level.vertices[i]] = flat.uv[i];
  }
}

// What a vertex without room, or a start that was no map, would leave.
void RequireNoFlips(std::span<const Triangle> triangles, const std::vector<Vec2d>& uv) {
  const auto flips = std::count_if(triangles.begin(), triangles.end(), [&](const Triangle& t) {
    return !(DoubleArea(uv[t[0]], uv[t[1]], uv[t[2]]) > 0);
  });
  Require(flips == 0,
          Fault::kStage,
          "{} of {} triangles could not be flattened without a flip: the skin has degenerate "
          "triangles there; remesh it",
          flips,
          triangles.size());
}

}  // namespace

FreeMap FlattenFree(std::span<const Vec3f> positions,
                    std::span<const Triangle> triangles,
                    bool stop_at_overlap) {
  const Disk disk = MakeDisk(positions, triangles);
  std::vector<Vec2d> uv(positions.size(), Vec2d::Zero());
  const double radius = disk.perimeter / (2 * kPiD);
  for (std::size_t i = 0; i < disk.border.size(); ++i) {
    const double angle = 2 * kPiD * disk.border_length[i] / disk.perimeter;
    uv[disk.border[i]] = radius * Vec2d(std::cos(angle), std::sin(angle));
  }
  const std::vector<char> kept(positions.size(), 0);
  DiskHierarchy hierarchy(
      disk.positions, {triangles.begin(), triangles.end()}, disk.border, kept, kCoarsest);
  const Freedom freedom(positions.size(), 3);
  {
    const DiskHierarchy::Level level = hierarchy.Current();
    FlatMesh flat{level.triangles, level.rest, {}};
    for (const int v : level.vertices) flat.uv.push_back(uv[v]);
    StartFlat(flat, level.border);
    DescendNewton(flat, Freedom(flat.uv.size(), 3), 100, 1e-5);
    for (std::size_t i = 0; i < level.vertices.size(); ++i) uv[level.vertices[i]] = flat.uv[i];
    if (stop_at_overlap) {
      std::vector<Vec2d> border;
      for (const int v : level.border) border.push_back(flat.uv[v]);
      std::vector<std::array<int, 2>> crossings = BorderCrossings(border);
      if (!crossings.empty()) {
        return {{}, {level.vertices, level.triangles, flat.uv, level.border, std::move(crossings)}};
      }
    }
  }
  GrowBack(hierarchy, uv, freedom, false);
  RequireNoFlips(triangles, uv);
  return {std::move(uv), {}};
}

std::vector<Vec2d> FlattenToSquare(std::span<const Vec3f> positions,
                                   std::span<const Triangle> triangles) {
  Disk disk = MakeDisk(positions, triangles);
  Require(disk.border.size() >= 4, Fault::kStage, "the seam is too short for a square's border");
  // In units in which the surface has the square's area.
  double area = 0;
  for (const Triangle& t : triangles) {
    area += (disk.positions[t[1]] - disk.positions[t[0]])
                .cross(disk.positions[t[2]] - disk.positions[t[0]])
                .norm() /
            2;
  }
  const double scale = 1 / std::sqrt(std::max(area, 1e-300));
  for (Vec3d& p : disk.positions) p *= scale;

  const int n = static_cast<int>(disk.border.size());
  std::array<int, 4> corners{};
  for (int side = 0; side < 4; ++side) {
    const double at = side * disk.perimeter / 4;
    const auto it = std::lower_bound(disk.border_length.begin(), disk.border_length.end(), at);
    corners[side] = static_cast<int>(it - disk.border_length.begin());
    if (side > 0) corners[side] = std::max(corners[side], corners[side - 1] + 1);
    corners[side] = std::min(corners[side], n - 4 + side);
  }
  constexpr std::array<std::array<double, 4>, 4> kSides = {
      // from, direction
      {{0, 0, 1, 0}, {1, 0, 0, 1}, {1, 1, -1, 0}, {0, 1, 0, -1}}};
  std::vector<Vec2d> uv(positions.size(), Vec2d::Zero());
  Freedom freedom(positions.size(), 3);
  std::vector<char> kept(positions.size(), 0);
  for (int side = 0; side < 4; ++side) {
    const int from = corners[side], to = side < 3 ? corners[side + 1] : n;
    const double start = disk.border_length[from];
    const double end = to < n ? disk.border_length[to] : disk.perimeter;
    for (int i = from; i < to; ++i) {
      const double share = (disk.border_length[i] - start) / (end - start);
      const auto& line = kSides[side];
      uv[disk.border[i]] = {line[0] + share * line[2], line[1] + share * line[3]};
      freedom[disk.border[i]] = side % 2 == 0 ? 1 : 2;
    }
    freedom[disk.border[from]] = 0;
    kept[disk.border[from]] = 1;
  }
  DiskHierarchy hierarchy(
      disk.positions, {triangles.begin(), triangles.end()}, disk.border, kept, kCoarsest);
  {
    const DiskHierarchy::Level level = hierarchy.Current();
    FlatMesh flat{level.triangles, level.rest, {}};
    Freedom level_freedom;
    for (const int v : level.vertices) {
      flat.uv.push_back(uv[v]);
      level_freedom.push_back(freedom[v]);
    }
    StartFlat(flat, level.border);
    DescendNewton(flat, level_freedom, 100, 1e-4);
    for (std::size_t i = 0; i < level.vertices.size(); ++i) uv[level.vertices[i]] = flat.uv[i];
  }
  GrowBack(hierarchy, uv, freedom, true);
  RequireNoFlips(triangles, uv);
  return uv;
}

}  // namespace dyxel::internal
