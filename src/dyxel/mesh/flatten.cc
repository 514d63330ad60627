#define EIGEN_MPL2_ONLY
#include "dyxel/mesh/flatten.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/SparseCholesky>

#include "dyxel/base/error.h"

namespace dyxel::internal {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Entry = Eigen::Triplet<double>;
using Solver = Eigen::SimplicialLDLT<Sparse, Eigen::Lower>;

// Rows of the unknowns: numbered vertices, -1 where fixed.
std::vector<int> NumberFree(std::span<const char> fixed, int& count) {
  std::vector<int> row(fixed.size(), -1);
  count = 0;
  for (std::size_t v = 0; v < fixed.size(); ++v) {
    if (!fixed[v]) row[v] = count++;
  }
  return row;
}

// Solves Σ_j k_ij (uv_i - uv_j) = 0 for the free vertices, k given as off-diagonal pairs.
struct Spring {
  int a, b;
  double stiffness;
};
bool SolveSprings(const std::vector<Spring>& springs,
                  std::span<const int> row,
                  int num_free,
                  std::vector<Vec2d>& uv) {
  std::vector<Entry> entries;
  entries.reserve(3 * springs.size());
  Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(num_free, 2);
  for (const Spring& s : springs) {
    const int a = row[s.a], b = row[s.b];
    if (a >= 0) entries.emplace_back(a, a, s.stiffness);
    if (b >= 0) entries.emplace_back(b, b, s.stiffness);
    if (a >= 0 && b >= 0) entries.emplace_back(std::max(a, b), std::min(a, b), -s.stiffness);
    if (a >= 0 && b < 0) right.row(a) += s.stiffness * uv[s.b].transpose();
    if (b >= 0 && a < 0) right.row(b) += s.stiffness * uv[s.a].transpose();
  }
  if (num_free == 0) return true;
  Sparse matrix(num_free, num_free);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Solver solver(matrix);
  if (solver.info() != Eigen::Success) return false;
  const Eigen::MatrixX2d solution = solver.solve(right);
  for (std::size_t v = 0; v < row.size(); ++v) {
    if (row[v] >= 0) uv[v] = solution.row(row[v]).transpose();
  }
  return true;
}

// (JᵀJ)^½ of a 2x2 Jacobian: (JᵀJ + |det J| I) / sqrt(tr JᵀJ + 2 |det J|).
Mat2d Stretch(const Mat2d& jacobian) {
  const Mat2d metric = jacobian.transpose() * jacobian;
  const double det = std::abs(jacobian.determinant());
  return (metric + det * Mat2d::Identity()) / std::sqrt(metric.trace() + 2 * det + 1e-30);
}

// The greatest step in [0, limit] along `step` that keeps every triangle's area positive.
double LongestStep(const FlatMesh& mesh, const std::vector<Vec2d>& step) {
  double longest = std::numeric_limits<double>::infinity();
  for (const Triangle& t : mesh.triangles) {
    const Vec2d e1 = mesh.uv[t[1]] - mesh.uv[t[0]], e2 = mesh.uv[t[2]] - mesh.uv[t[0]];
    const Vec2d d1 = step[t[1]] - step[t[0]], d2 = step[t[2]] - step[t[0]];
    const auto cross = [](const Vec2d& x, const Vec2d& y) { return x.x() * y.y() - x.y() * y.x(); };
    // Area c + b s + a s²: its least positive root.
    const double a = cross(d1, d2), b = cross(e1, d2) + cross(d1, e2), c = cross(e1, e2);
    const double under = b * b - 4 * a * c;
    if (under < 0) continue;
    const double q = -0.5 * (b + std::copysign(std::sqrt(under), b));
    for (const double root : {a != 0 ? q / a : -1.0, q != 0 ? c / q : -1.0}) {
      if (root > 0) longest = std::min(longest, root);
    }
  }
  return longest;
}

}  // namespace

double TotalEnergy(const FlatMesh& mesh) {
  double energy = 0;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Triangle& t = mesh.triangles[f];
    energy += mesh.rest[f].area * SymmetricDirichlet(Jacobian(
                                      mesh.rest[f], mesh.uv[t[0]], mesh.uv[t[1]], mesh.uv[t[2]]));
  }
  return energy;
}

int CountFlips(const FlatMesh& mesh) {
  int flips = 0;
  for (const Triangle& t : mesh.triangles) {
    flips += DoubleArea(mesh.uv[t[0]], mesh.uv[t[1]], mesh.uv[t[2]]) > 0 ? 0 : 1;
  }
  return flips;
}

void TutteEmbedding(FlatMesh& mesh, std::span<const char> fixed) {
  int num_free = 0;
  const std::vector<int> row = NumberFree(fixed, num_free);
  std::vector<Spring> springs;
  springs.reserve(3 * mesh.triangles.size());
  // Inner edges come twice, border edges once, but those join fixed vertices.
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) springs.push_back({t[k], t[(k + 1) % 3], 1.0});
  }
  Require(SolveSprings(springs, row, num_free, mesh.uv),
          Fault::kStage,
          "Tutte's embedding has no solution: the cut surface is not connected");
}

bool QuasiHarmonicMap(FlatMesh& mesh, std::span<const char> fixed, int max_rounds) {
  int num_free = 0;
  const std::vector<int> row = NumberFree(fixed, num_free);
  std::vector<Mat2d> metric(mesh.triangles.size(), Mat2d::Identity());
  FlatMesh trial = mesh;
  double best = std::numeric_limits<double>::infinity();
  std::vector<Spring> springs;
  for (int round = 0; round < max_rounds; ++round) {
    springs.clear();
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      const RestTriangle& rest = mesh.rest[f];
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = (k + 1) % 3;
        springs.push_back({mesh.triangles[f][k],
                           mesh.triangles[f][next],
                           -rest.area * rest.gradient[k].dot(metric[f] * rest.gradient[next])});
      }
    }
    if (!SolveSprings(springs, row, num_free, trial.uv)) break;
    const bool flipped = CountFlips(trial) > 0;
    const double energy = flipped ? best : TotalEnergy(trial);
    if (!flipped && energy < best) {
      const bool settled = energy > 0.999 * best;
      best = energy;
      mesh.uv = trial.uv;
      if (settled) break;
    } else if (best < std::numeric_limits<double>::infinity()) {
      break;
    }
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      const Triangle& t = mesh.triangles[f];
      metric[f] = Stretch(Jacobian(mesh.rest[f], trial.uv[t[0]], trial.uv[t[1]], trial.uv[t[2]]));
    }
  }
  return best < std::numeric_limits<double>::infinity();
}

double DescendNewton(FlatMesh& mesh, const Freedom& freedom, int max_steps, double tolerance) {
  const std::size_t n = mesh.uv.size();
  std::vector<std::array<int, 2>> row(n, {-1, -1});
  int num_free = 0;
  for (std::size_t v = 0; v < n; ++v) {
    if (freedom[v] & 1U) row[v][0] = num_free++;
    if (freedom[v] & 2U) row[v][1] = num_free++;
  }
  double energy = TotalEnergy(mesh);
  if (num_free == 0) return energy;
  Solver solver;
  bool analyzed = false;
  std::vector<Entry> entries;
  std::vector<Vec2d> step(n), start;
  for (int iteration = 0; iteration < max_steps; ++iteration) {
    entries.clear();
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(num_free);
    double trace = 0;
    for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
      const Triangle& t = mesh.triangles[f];
      const RestTriangle& rest = mesh.rest[f];
      const DensityDerivatives density = DifferentiateSymmetricDirichlet(
          Jacobian(rest, mesh.uv[t[0]], mesh.uv[t[1]], mesh.uv[t[2]]));
      // vec J by (u, v) of corner k: the first half of vec J times gradient.x, the second times .y.
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2d& gk = rest.gradient[k];
        const Vec2d force =
            rest.area * (gk.x() * density.gradient.head<2>() + gk.y() * density.gradient.tail<2>());
        for (int i = 0; i < 2; ++i) {
          if (row[t[k]][i] >= 0) gradient[row[t[k]][i]] += force[i];
        }
        for (std::size_t l = 0; l < 3; ++l) {
          const Vec2d& gl = rest.gradient[l];
          const Mat2d block =
              rest.area * (gk.x() * gl.x() * density.hessian.topLeftCorner<2, 2>() +
                           gk.x() * gl.y() * density.hessian.topRightCorner<2, 2>() +
                           gk.y() * gl.x() * density.hessian.bottomLeftCorner<2, 2>() +
                           gk.y() * gl.y() * density.hessian.bottomRightCorner<2, 2>());
          for (int i = 0; i < 2; ++i) {
            for (int j = 0; j < 2; ++j) {
              const int r = row[t[k]][i], c = row[t[l]][j];
              if (r < 0 || c < 0 || r < c) continue;
              entries.emplace_back(r, c, block(i, j));
              if (r == c) trace += block(i, j);
            }
          }
        }
      }
    }
    // A free border leaves translation and rotation undetermined.
    const double shift = 1e-9 * trace / num_free;
    for (int r = 0; r < num_free; ++r) entries.emplace_back(r, r, shift);
    Sparse matrix(num_free, num_free);
    matrix.setFromTriplets(entries.begin(), entries.end());
    if (!analyzed) solver.analyzePattern(matrix);
    analyzed = true;
    solver.factorize(matrix);
    if (solver.info() != Eigen::Success) break;
    const Eigen::VectorXd solution = -solver.solve(gradient);
    const double slope = gradient.dot(solution);
    if (!(slope < 0)) break;
    for (std::size_t v = 0; v < n; ++v) {
      step[v] = {row[v][0] >= 0 ? solution[row[v][0]] : 0.0,
                 row[v][1] >= 0 ? solution[row[v][1]] : 0.0};
    }
    double length = std::min(1.0, 0.9 * LongestStep(mesh, step));
    start = mesh.uv;
    const double before = energy;
    bool fell = false;
    for (int halving = 0; halving < 30 && !fell; ++halving, length /= 2) {
      for (std::size_t v = 0; v < n; ++v) mesh.uv[v] = start[v] + length * step[v];
      energy = TotalEnergy(mesh);
      fell = energy <= before + 1e-4 * length * slope;
    }
    if (!fell) {
      mesh.uv = start;
      return before;
    }
    if (before - energy < tolerance * before) break;
  }
  return energy;
}

}  // namespace dyxel::internal
