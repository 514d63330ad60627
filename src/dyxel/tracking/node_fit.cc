#include "dyxel/tracking/node_fit.h"

#include <algorithm>
#include <cmath>

#include <Eigen/SparseCholesky>

#include "dyxel/body/nodes.h"

namespace dyxel::internal {
namespace {

constexpr double kLargestShift = 0.25;  // metres
constexpr double kAnchor = 0.02;        // of no shift at all, against the contours
constexpr float kReach = 0.14F;         // metres: farthest match of the first rounds, then half
constexpr float kScale = 0.08F;         // metres: robust scale of the first rounds, then half

using Sparse = Eigen::SparseMatrix<double>;

// The shifts in the world, of nodes whose frames are given.
std::vector<Vec3d> Turn(const std::vector<Vec3d>& shifts,
                        const std::vector<Rigid>& frames,
                        const std::vector<std::size_t>& joint_of_node) {
  std::vector<Vec3d> turned(joint_of_node.size(), Vec3d::Zero());
  for (std::size_t k = 0; k < shifts.size(); ++k) {
    turned[k] = frames[joint_of_node[k]].rotation * shifts[k];
  }
  return turned;
}

// What the matches say of one vertex: Σ w (r + gᵀ δ)².
struct VertexEvidence {
  Mat3d matrix = Mat3d::Zero();
  Vec3d gradient = Vec3d::Zero();
};

}  // namespace

NodeFit::NodeFit(const TrackedBody& body) : body_(&body) {
  const Actor& actor = body.actor;
  node_of_joint_.assign(actor.skeleton.joints.size(), -1);
  for (std::size_t j = 0; j < node_of_joint_.size(); ++j) {
    if (!actor.skeleton.joints[j].IsNode()) continue;
    node_of_joint_[j] = static_cast<int>(joint_of_node_.size());
    joint_of_node_.push_back(j);
  }
  std::vector<std::vector<int>> rings(joint_of_node_.size());
  for (const std::array<int, 2>& edge : NodeEdges(actor)) {
    rings[static_cast<std::size_t>(edge[0])].push_back(edge[1]);
    rings[static_cast<std::size_t>(edge[1])].push_back(edge[0]);
  }
  const auto n = static_cast<Eigen::Index>(joint_of_node_.size());
  std::vector<Eigen::Triplet<double>> rows;
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::vector<int>& ring = rings[static_cast<std::size_t>(i)];
    if (ring.empty()) continue;
    rows.emplace_back(i, i, 1.0);
    for (const int j : ring) rows.emplace_back(i, j, -1.0 / static_cast<double>(ring.size()));
  }
  Sparse laplacian(n, n);
  laplacian.setFromTriplets(rows.begin(), rows.end());
  const Sparse product = Sparse(laplacian.transpose()) * laplacian;
  for (Eigen::Index c = 0; c < n; ++c) {
    for (Sparse::InnerIterator it(product, c); it; ++it) {
      smoothness_.emplace_back(it.row(), it.col(), it.value());
    }
  }
}

NodeFit::Solution NodeFit::Solve(const Observation& observation,
                                 const Pose& start,
                                 const std::vector<Vec3d>& towards,
                                 const NodeSettings& settings,
                                 std::span<const Match> seen) const {
  const Actor& actor = body_->actor;
  const std::size_t nodes = joint_of_node_.size();
  PoseEvaluator evaluator(observation, *body_);
  Pose pose = start;
  pose.shifts.resize(nodes, Vec3d::Zero());
  // A node's frame turns with the bones alone, so that shifts can be solved for in the world.
  const std::vector<Rigid> frames = actor.skeleton.Forward(start);
  std::vector<Vec3d> shift = Turn(pose.shifts, frames, joint_of_node_);
  const std::vector<Vec3d> held = Turn(towards, frames, joint_of_node_);

  const bool unjudged = !seen.empty() || (!held.empty() && settings.inertia > 0);
  Solution best{pose};
  if (nodes == 0) return best;
  const std::vector<Vec3d> from = shift;
  const auto n = static_cast<Eigen::Index>(3 * nodes);
  Eigen::SimplicialLDLT<Sparse> solver;
  for (int round = 0; round <= settings.rounds; ++round) {
    const PoseState state = evaluator.Evaluate(pose);
    if (round == 0 && start.shifts.empty()) best.before = state.mismatch;
    if (round == 0 || unjudged || state.mismatch < best.mismatch) {
      best.pose = pose;
      best.mismatch = state.mismatch;
    }
    if (round == settings.rounds) break;
    const float narrow = round < 2 ? 1.0F : 0.5F;
    std::vector<VertexEvidence> evidence(actor.skin.positions.size());
    double total = 0;
    const auto add = [&](const Match& m, double residual) {
      const double w = static_cast<double>(
          m.length * RobustWeight(static_cast<float>(residual), narrow * kScale));
      const Vec3d g = m.gradient.cast<double>();
      VertexEvidence& e = evidence[static_cast<std::size_t>(m.vertex)];
      e.matrix += w * g * g.transpose();
      e.gradient += w * residual * g;
      total += w;
    };
    for (const auto& list : evaluator.Matches(state, narrow * kReach)) {
      for (const Match& m : list) add(m, static_cast<double>(m.residual));
    }
    // What was seen at the start, from where the skin is now.
    for (const Match& m : seen) {
      const auto v = static_cast<std::size_t>(m.vertex);
      Vec3d moved = Vec3d::Zero();
      for (std::size_t k = 0; k < 4; ++k) {
        const int node = node_of_joint_[static_cast<std::size_t>(actor.joint_indices[v][k])];
        if (node < 0) continue;
        moved += static_cast<double>(actor.joint_weights[v][k]) *
                 (shift[static_cast<std::size_t>(node)] - from[static_cast<std::size_t>(node)]);
      }
      add(m, static_cast<double>(m.residual) + m.gradient.cast<double>().dot(moved));
    }
    if (!(total > 0)) break;
    const double unit = total / static_cast<double>(nodes);

    // Unknown: the shifts themselves, o. A match asks for g·Σ_k w_k (o_k − now_k) = −r.
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd rhs = Eigen::VectorXd::Zero(n);
    for (std::size_t v = 0; v < evidence.size(); ++v) {
      const VertexEvidence& e = evidence[v];
      if (e.matrix(0, 0) + e.matrix(1, 1) + e.matrix(2, 2) <= 0) continue;
      std::array<int, 4> node{};
      std::array<double, 4> weight{};
      Vec3d now = Vec3d::Zero();
      for (std::size_t k = 0; k < 4; ++k) {
        node[k] = node_of_joint_[static_cast<std::size_t>(actor.joint_indices[v][k])];
        weight[k] = node[k] < 0 ? 0.0 : static_cast<double>(actor.joint_weights[v][k]);
        if (weight[k] > 0) now += weight[k] * shift[static_cast<std::size_t>(node[k])];
      }
      const Vec3d wanted = e.matrix * now - e.gradient;
      for (std::size_t a = 0; a < 4; ++a) {
        if (weight[a] <= 0) continue;
        rhs.segment<3>(Eigen::Index{3} * node[a]) += weight[a] * wanted;
        for (std::size_t b = 0; b < 4; ++b) {
          if (weight[b] <= 0) continue;
          for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
              entries.emplace_back(
                  3 * node[a] + i, 3 * node[b] + j, weight[a] * weight[b] * e.matrix(i, j));
            }
          }
        }
      }
    }
    for (const Eigen::Triplet<double>& t : smoothness_) {
      for (int i = 0; i < 3; ++i) {
        entries.emplace_back(
            3 * t.row() + i, 3 * t.col() + i, settings.stiffness * unit * t.value());
      }
    }
    const double inertia = held.empty() ? 0.0 : settings.inertia;
    for (std::size_t k = 0; k < nodes; ++k) {
      for (int i = 0; i < 3; ++i) {
        const auto row = static_cast<Eigen::Index>(3 * k) + i;
        entries.emplace_back(row, row, unit * (kAnchor + inertia));
        if (inertia > 0) rhs[row] += unit * inertia * held[k][i];
      }
    }
    Sparse matrix(n, n);
    matrix.setFromTriplets(entries.begin(), entries.end());
    solver.compute(matrix);
    if (solver.info() != Eigen::Success) break;
    const Eigen::VectorXd solution = solver.solve(rhs);
    if (!solution.allFinite()) break;
    for (std::size_t k = 0; k < nodes; ++k) {
      const Vec3d o = solution.segment<3>(static_cast<Eigen::Index>(3 * k));
      Vec3d local = frames[joint_of_node_[k]].rotation.transpose() * o;
      local = local.cwiseMax(-kLargestShift).cwiseMin(kLargestShift);
      // As it will be stored, so that what is measured here is what is played.
      for (int i = 0; i < 3; ++i) local[i] = kShiftUnit * std::round(local[i] / kShiftUnit);
      pose.shifts[k] = local;
      shift[k] = frames[joint_of_node_[k]].rotation * local;
    }
  }
  return best;
}

std::vector<Vec3d> ShiftsBeside(const std::vector<Pose>& poses, std::size_t t) {
  if (poses.size() < 2) return {};
  const Pose& left = poses[t > 0 ? t - 1 : t + 1];
  const Pose& right = poses[t + 1 < poses.size() ? t + 1 : t - 1];
  return InterpolatePoses(left, right, 0.5).shifts;
}

}  // namespace dyxel::internal
