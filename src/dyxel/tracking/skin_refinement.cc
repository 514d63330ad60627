#include <algorithm>
#include <cmath>

#include <Eigen/SparseCholesky>

#include "dyxel/base/parallel.h"
#include "dyxel/mesh/adjacency.h"
#include "dyxel/tracking/actor_fit.h"

namespace dyxel::internal {
namespace {

// Displacements of hands stay small: their fingers are thin, and a few pixels say little of them.
constexpr float kHandLimit = 0.006F;

// Where a vertex's rest normal points in the world.
Vec3f WorldNormal(const Actor& actor,
                  const std::vector<Rigid>& transforms,
                  std::size_t v,
                  const Vec3f& rest_normal) {
  Vec3f sum = Vec3f::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    const float w = actor.joint_weights[v][k];
    if (w == 0) continue;
    sum += w *
           (transforms[static_cast<std::size_t>(actor.joint_indices[v][k])].rotation.cast<float>() *
            rest_normal);
  }
  return sum;
}

struct Evidence {
  std::vector<double> weight;  // (V) Σ w c²
  std::vector<double> pull;    // (V) Σ w c r
};

}  // namespace

void RefineSkin(Actor& actor,
                const std::vector<Vec3f>& base_positions,
                std::vector<float>& displacement,
                FitFrames& frames,
                float scale,
                double smoothness,
                float limit) {
  const std::size_t num_vertices = base_positions.size();
  const auto& triangles = actor.skin.triangles;
  displacement.resize(num_vertices, 0.0F);
  const std::vector<Vec3f> normals = VertexNormals(base_positions, triangles);
  const TrackedBody body = MakeTrackedBody(actor, 0);

  std::vector<Evidence> parts(frames.poses.size());
  ParallelFor(frames.poses.size(), [&](std::size_t t) {
    Evidence& part = parts[t];
    part.weight.assign(num_vertices, 0);
    part.pull.assign(num_vertices, 0);
    PoseEvaluator evaluator(frames.observations[t], body);
    const PoseState state = evaluator.Evaluate(frames.poses[t]);
    const std::vector<Rigid> transforms = SkinTransforms(actor.skeleton, frames.poses[t]);
    for (const auto& list : evaluator.Matches(state, 4 * scale)) {
      for (const Match& m : list) {
        const auto v = static_cast<std::size_t>(m.vertex);
        const float c = m.gradient.dot(WorldNormal(actor, transforms, v, normals[v]));
        if (c < 0.3F) continue;  // the rim does not move along the contour's normal
        const float w = m.length * RobustWeight(m.residual, scale);
        part.weight[v] += static_cast<double>(w * c * c);
        part.pull[v] += static_cast<double>(w * c * m.residual);
      }
    }
  });
  Evidence sum{std::vector<double>(num_vertices, 0), std::vector<double>(num_vertices, 0)};
  double total = 0;
  for (const Evidence& part : parts) {
    for (std::size_t v = 0; v < num_vertices; ++v) {
      sum.weight[v] += part.weight[v];
      sum.pull[v] += part.pull[v];
      total += part.weight[v];
    }
  }
  if (total <= 0) return;

  // Σ a (δ + b/a)² + λ |L (D + δ)|² + μ |D + δ|², L the uniform Laplacian.
  const VertexNeighbours neighbours =
      NeighboursOfVertices(triangles, static_cast<int>(num_vertices));
  double edge = 0;
  std::size_t edges = 0;
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t v = 0; v < num_vertices; ++v) {
    const int begin = neighbours.begin[v];
    const int end = neighbours.begin[v + 1];
    if (begin == end) continue;
    entries.emplace_back(static_cast<int>(v), static_cast<int>(v), 1.0);
    for (int k = begin; k < end; ++k) {
      const int u = neighbours.index[static_cast<std::size_t>(k)];
      entries.emplace_back(static_cast<int>(v), u, -1.0 / (end - begin));
      edge += static_cast<double>(
          (base_positions[v] - base_positions[static_cast<std::size_t>(u)]).norm());
      ++edges;
    }
  }
  edge /= static_cast<double>(std::max<std::size_t>(1, edges));
  const auto n = static_cast<Eigen::Index>(num_vertices);
  Eigen::SparseMatrix<double> laplacian(n, n);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  const double mean_weight = total / static_cast<double>(num_vertices);
  const double stiffness = mean_weight * std::pow(smoothness / edge, 4) * 0.05;
  Eigen::SparseMatrix<double> matrix =
      stiffness * (Eigen::SparseMatrix<double>(laplacian.transpose()) * laplacian);
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(n);
  Eigen::SparseMatrix<double> diagonal(n, n);
  diagonal.reserve(Eigen::VectorXi::Constant(n, 1));
  for (Eigen::Index v = 0; v < n; ++v) {
    const auto k = static_cast<std::size_t>(v);
    diagonal.insert(v, v) = sum.weight[k] + 0.02 * mean_weight;
    // In the total D: a (D − D_old) = −b.
    rhs[v] = sum.weight[k] * static_cast<double>(displacement[k]) - sum.pull[k];
  }
  matrix += diagonal;
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  if (solver.info() != Eigen::Success) return;
  const Eigen::VectorXd solution = solver.solve(rhs);
  if (!solution.allFinite()) return;
  std::vector<char> hand(actor.skeleton.joints.size(), 0);
  for (std::size_t j = 0; j < hand.size(); ++j) {
    hand[j] = actor.skeleton.joints[j].name.ends_with("hand") ? 1 : 0;
  }
  for (std::size_t v = 0; v < num_vertices; ++v) {
    // The limit falls off gradually from the arm to the hand.
    float on_hand = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (hand[static_cast<std::size_t>(actor.joint_indices[v][k])] != 0) {
        on_hand += actor.joint_weights[v][k];
      }
    }
    const float most = limit + on_hand * (kHandLimit - limit);
    displacement[v] =
        std::clamp(static_cast<float>(solution[static_cast<Eigen::Index>(v)]), -most, most);
    actor.skin.positions[v] = base_positions[v] + displacement[v] * normals[v];
  }
}

}  // namespace dyxel::internal
