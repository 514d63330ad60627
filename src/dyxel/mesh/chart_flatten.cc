#include "dyxel/mesh/chart_flatten.h"

#include <algorithm>
#include <cmath>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include "dyxel/mesh/adjacency.h"

namespace dyxel::internal {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Entry = Eigen::Triplet<double, int>;
constexpr int kRounds = 20;         // of as-rigid-as-possible
constexpr double kThinnest = 1e-3;  // height over base of the thinnest triangle

// A triangle in its own plane, counter-clockwise, with the cotangents at its corners.
struct Rest {
  std::array<Vec2d, 3> x;
  Vec3d cotangent;
  double area;  // as thickened
};

Rest MakeRest(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d ab = b - a;
  const Vec3d ac = c - a;
  const double base = std::max(ab.norm(), 1e-12);
  const double longest = std::max({base, ac.norm(), (c - b).norm()});
  const double along = ab.dot(ac) / base;
  const double height = std::max(ab.cross(ac).norm() / base, kThinnest * longest);
  Rest rest;
  rest.x = {Vec2d(0, 0), Vec2d(base, 0), Vec2d(along, height)};
  rest.area = 0.5 * base * height;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2d p = rest.x[(k + 1) % 3] - rest.x[k];
    const Vec2d q = rest.x[(k + 2) % 3] - rest.x[k];
    rest.cotangent[static_cast<int>(k)] = p.dot(q) / (2 * rest.area);
  }
  return rest;
}

double DoubledArea(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

std::size_t At(int i) { return static_cast<std::size_t>(i); }

// The two vertices that are about farthest from each other.
std::array<int, 2> FarPair(std::span<const Vec3f> positions) {
  const auto farthest_from = [&](int v) {
    int best = v == 0 ? 1 : 0;
    float distance = -1;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const float d = (positions[i] - positions[At(v)]).squaredNorm();
      if (static_cast<int>(i) != v && d > distance) {
        distance = d;
        best = static_cast<int>(i);
      }
    }
    return best;
  };
  const int a = farthest_from(0);
  return {a, farthest_from(a)};
}

// Minimises the conformal energy, Dirichlet's less the area of the image, two vertices held.
bool Conformal(std::span<const Vec3f> positions,
               std::span<const Triangle> triangles,
               std::span<const Rest> rest,
               std::vector<Vec2d>& uv) {
  const int n = static_cast<int>(positions.size());
  const std::array<int, 2> pins = FarPair(positions);
  std::vector<int> unknown(At(n));  // of u; v follows
  int num_free = 0;
  for (int v = 0; v < n; ++v) unknown[At(v)] = v == pins[0] || v == pins[1] ? -1 : num_free++;
  uv.assign(At(n), Vec2d::Zero());
  uv[At(pins[1])] = {(positions[At(pins[1])] - positions[At(pins[0])]).cast<double>().norm(), 0};

  std::vector<Entry> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(2 * num_free);
  const auto add = [&](int row, int row_axis, int column, int column_axis, double value) {
    if (unknown[At(row)] < 0) return;
    const int i = unknown[At(row)] + row_axis * num_free;
    if (unknown[At(column)] < 0) {
      right[i] -= value * uv[At(column)][column_axis];
    } else {
      entries.emplace_back(i, unknown[At(column)] + column_axis * num_free, value);
    }
  };
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double weight = 0.5 * rest[f].cotangent[static_cast<int>(k)];
      const int a = triangles[f][(k + 1) % 3];
      const int b = triangles[f][(k + 2) % 3];
      for (int axis = 0; axis < 2; ++axis) {
        add(a, axis, a, axis, weight);
        add(b, axis, b, axis, weight);
        add(a, axis, b, axis, -weight);
        add(b, axis, a, axis, -weight);
      }
    }
  }
  const auto opposite = OppositeHalfEdges(triangles, n);
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    for (std::size_t e = 0; e < 3; ++e) {
      if (opposite[f][e] >= 0) continue;
      const int a = triangles[f][e];  // area = ½ Σ (u_a v_b - u_b v_a)
      const int b = triangles[f][(e + 1) % 3];
      add(a, 0, b, 1, -0.5);
      add(b, 1, a, 0, -0.5);
      add(b, 0, a, 1, 0.5);
      add(a, 1, b, 0, 0.5);
    }
  }
  Sparse matrix(2 * num_free, 2 * num_free);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Sparse> solver(matrix);
  if (solver.info() != Eigen::Success) return false;
  const Eigen::VectorXd solution = solver.solve(right);
  if (!solution.allFinite()) return false;
  for (int v = 0; v < n; ++v) {
    const int i = unknown[At(v)];
    if (i >= 0) uv[At(v)] = {solution[i], solution[i + num_free]};
  }
  return true;
}

// Scales `uv` so that its area is the surface's.
void ScaleToArea(std::span<const Triangle> triangles,
                 std::span<const Rest> rest,
                 std::vector<Vec2d>& uv) {
  double area = 0;
  double image = 0;
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const Triangle& t = triangles[f];
    area += rest[f].area;
    image += 0.5 * std::abs(DoubledArea(uv[At(t[0])], uv[At(t[1])], uv[At(t[2])]));
  }
  if (!(image > 0)) return;
  for (Vec2d& p : uv) p *= std::sqrt(area / image);
}

// Alternates between each triangle's best rotation and the positions that fit the rotated
// triangles best.
void AsRigidAsPossible(std::span<const Triangle> triangles,
                       std::span<const Rest> rest,
                       std::vector<Vec2d>& uv) {
  const int n = static_cast<int>(uv.size());
  if (n < 3) return;
  const auto weight = [&](std::size_t f, std::size_t k) {
    return 0.5 * std::max(rest[f].cotangent[static_cast<int>(k)], 0.01);
  };
  std::vector<Entry> entries;  // vertex 0 held
  const auto add = [&](int i, int j, double value) {
    if (i > 0 && j > 0) entries.emplace_back(i - 1, j - 1, value);
  };
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = triangles[f][(k + 1) % 3];
      const int b = triangles[f][(k + 2) % 3];
      const double w = weight(f, k);
      add(a, a, w);
      add(b, b, w);
      add(a, b, -w);
      add(b, a, -w);
    }
  }
  Sparse matrix(n - 1, n - 1);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Sparse> solver(matrix);
  if (solver.info() != Eigen::Success) return;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(n, 2);
    for (std::size_t f = 0; f < triangles.size(); ++f) {
      const Triangle& t = triangles[f];
      double cosine = 0;
      double sine = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2d from = rest[f].x[(k + 2) % 3] - rest[f].x[(k + 1) % 3];
        const Vec2d to = uv[At(t[(k + 2) % 3])] - uv[At(t[(k + 1) % 3])];
        cosine += weight(f, k) * from.dot(to);
        sine += weight(f, k) * (from.x() * to.y() - from.y() * to.x());
      }
      const double length = std::hypot(cosine, sine);
      if (!(length > 0)) continue;
      cosine /= length;
      sine /= length;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2d from = rest[f].x[(k + 2) % 3] - rest[f].x[(k + 1) % 3];
        const Vec2d turned(cosine * from.x() - sine * from.y(),
                           sine * from.x() + cosine * from.y());
        right.row(t[(k + 2) % 3]) += weight(f, k) * turned;
        right.row(t[(k + 1) % 3]) -= weight(f, k) * turned;
      }
    }
    const Eigen::MatrixX2d solution = solver.solve(right.bottomRows(n - 1));
    uv[0] = Vec2d::Zero();
    for (int v = 1; v < n; ++v) uv[At(v)] = solution.row(v - 1);
  }
}

void Measure(std::span<const Triangle> triangles, std::span<const Rest> rest, FlatChart& chart) {
  chart.flips = 0;
  std::vector<std::array<double, 2>> energies;  // energy, area
  double total = 0;
  double area = 0;
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const Triangle& t = triangles[f];
    const Vec2d& a = chart.uv[At(t[0])];
    const Vec2d ab = chart.uv[At(t[1])] - a;
    const Vec2d ac = chart.uv[At(t[2])] - a;
    const Vec2d& p = rest[f].x[1];
    const Vec2d& q = rest[f].x[2];
    Eigen::Matrix2d jacobian;
    jacobian.col(0) = ab / p.x();
    jacobian.col(1) = (ac - jacobian.col(0) * q.x()) / q.y();
    const double determinant = jacobian.determinant();
    if (!(determinant > 1e-9)) {
      ++chart.flips;
      continue;
    }
    const double squared = jacobian.squaredNorm();
    const double energy = 0.25 * (squared + squared / (determinant * determinant));
    energies.push_back({energy, rest[f].area});
    total += energy * rest[f].area;
    area += rest[f].area;
  }
  chart.mean_energy = area > 0 ? total / area : 1;
  std::sort(energies.begin(), energies.end());
  double above = 0;
  chart.high_energy = 1;
  for (auto it = energies.rbegin(); it != energies.rend() && above <= 0.01 * area; ++it) {
    above += (*it)[1];
    chart.high_energy = (*it)[0];
  }
}

}  // namespace

FlatChart FlattenChart(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
  std::vector<Rest> rest;
  rest.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    rest.push_back(MakeRest(positions[At(t[0])].cast<double>(),
                            positions[At(t[1])].cast<double>(),
                            positions[At(t[2])].cast<double>()));
  }
  FlatChart conformal;
  conformal.uv.assign(positions.size(), Vec2d::Zero());
  if (triangles.size() == 1) {
    for (std::size_t k = 0; k < 3; ++k) conformal.uv[At(triangles[0][k])] = rest[0].x[k];
  } else if (!Conformal(positions, triangles, rest, conformal.uv)) {
    conformal.flips = static_cast<int>(triangles.size());
    return conformal;
  }
  ScaleToArea(triangles, rest, conformal.uv);
  Measure(triangles, rest, conformal);
  // From a conformal map to an isometric one as far as it goes without flips.
  FlatChart rigid = conformal;
  AsRigidAsPossible(triangles, rest, rigid.uv);
  ScaleToArea(triangles, rest, rigid.uv);
  Measure(triangles, rest, rigid);
  return rigid.flips > conformal.flips ||
                 (rigid.flips == conformal.flips && rigid.mean_energy > conformal.mean_energy)
             ? conformal
             : rigid;
}

}  // namespace dyxel::internal
