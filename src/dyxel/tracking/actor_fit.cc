#include "dyxel/tracking/actor_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Cholesky>

#include "dyxel/base/parallel.h"
#include "dyxel/tracking/reduced_body.h"

namespace dyxel::internal {
namespace {

constexpr double kContourSigma = 0.015;  // as in the pose solver
constexpr double kCorrelation = 0.1;
constexpr double kHeightSpread = 0.2;
constexpr double kLengthSpread = 0.1;
constexpr double kGirthSpread = 0.25;
constexpr double kSmallest = 0.6;
constexpr double kLargest = 1.7;
constexpr double kDifference = 0.02;  // step of the numeric derivatives

// Derivative of the drawn vertices by each proportion: [parameters] of (V).
std::vector<std::vector<Vec3f>> ShapeDerivatives(const std::vector<Actor>& bigger,
                                                 const std::vector<Vec3f>& positions,
                                                 const Pose& pose) {
  std::vector<std::vector<Vec3f>> derivatives(bigger.size());
  for (std::size_t k = 0; k < bigger.size(); ++k) {
    derivatives[k] = SkinPositions(bigger[k], pose);
    for (std::size_t v = 0; v < positions.size(); ++v) {
      derivatives[k][v] = (derivatives[k][v] - positions[v]) / static_cast<float>(kDifference);
    }
  }
  return derivatives;
}

struct FrameSystem {
  Eigen::MatrixXd pose_pose, pose_shape, shape_shape;
  Eigen::VectorXd pose_gradient, shape_gradient;
};

}  // namespace

double FitFrames::MeanMismatch() const {
  return std::accumulate(mismatch.begin(), mismatch.end(), 0.0) /
         std::max<double>(1, static_cast<double>(mismatch.size()));
}

Eigen::VectorXd PackProportions(const Proportions& proportions) {
  const std::size_t kinds = proportions.lengths.size();
  Eigen::VectorXd packed(static_cast<Eigen::Index>(1 + 2 * kinds));
  packed[0] = proportions.height;
  for (std::size_t k = 0; k < kinds; ++k) {
    packed[static_cast<Eigen::Index>(1 + k)] = proportions.lengths[k];
    packed[static_cast<Eigen::Index>(1 + kinds + k)] = proportions.girths[k];
  }
  return packed;
}

Proportions UnpackProportions(const Eigen::VectorXd& packed, std::size_t kinds) {
  Proportions proportions;
  proportions.height = packed[0];
  for (std::size_t k = 0; k < kinds; ++k) {
    proportions.lengths.push_back(packed[static_cast<Eigen::Index>(1 + k)]);
    proportions.girths.push_back(packed[static_cast<Eigen::Index>(1 + kinds + k)]);
  }
  return proportions;
}

void SolveFrames(const Actor& actor, FitFrames& frames, const SolveSettings& settings) {
  const TrackedBody body = MakeTrackedBody(actor);
  frames.mismatch.resize(frames.poses.size());
  ParallelFor(frames.poses.size(), [&](std::size_t t) {
    PoseEvaluator evaluator(frames.observations[t], body);
    const PoseSolution s = SolvePose(evaluator, frames.poses[t], frames.poses[t], settings);
    frames.poses[t] = s.pose;
    frames.mismatch[t] = s.mismatch;
  });
}

void FitProportions(const Actor& full_template,
                    Proportions& proportions,
                    FitFrames& frames,
                    int iterations,
                    float scale) {
  const Actor body_template = ReduceBody(full_template, kTrackedTriangles);
  const std::size_t kinds = proportions.lengths.size();
  const std::size_t count = frames.poses.size();
  Eigen::VectorXd shape = PackProportions(proportions);
  const Eigen::Index s = shape.size();
  Eigen::VectorXd precision(s);
  for (Eigen::Index k = 0; k < s; ++k) {
    const double spread = k == 0                                  ? kHeightSpread
                          : k <= static_cast<Eigen::Index>(kinds) ? kLengthSpread
                                                                  : kGirthSpread;
    // One body, seen in `count` time steps that make much the same mistakes.
    precision[k] = static_cast<double>(count) / (spread * spread);
  }
  const auto make = [&](const Eigen::VectorXd& packed) {
    return ApplyProportions(body_template, UnpackProportions(packed, kinds));
  };
  const auto measure = [&](const Actor& actor, const std::vector<Pose>& poses) {
    const TrackedBody body = MakeTrackedBody(actor, 0);
    std::vector<double> mismatch(count);
    ParallelFor(count, [&](std::size_t t) {
      PoseEvaluator evaluator(frames.observations[t], body);
      mismatch[t] = evaluator.Evaluate(poses[t]).mismatch;
    });
    return mismatch;
  };
  Actor actor = make(shape);
  frames.mismatch = measure(actor, frames.poses);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const TrackedBody body = MakeTrackedBody(actor, 0);
    std::vector<Actor> bigger;
    for (Eigen::Index k = 0; k < s; ++k) {
      Eigen::VectorXd more = shape;
      more[k] += kDifference;
      bigger.push_back(make(more));
    }
    std::vector<FrameSystem> systems(count);
    ParallelFor(count, [&](std::size_t t) {
      FrameSystem& f = systems[t];
      PoseEvaluator evaluator(frames.observations[t], body);
      const PoseState state = evaluator.Evaluate(frames.poses[t]);
      const auto matches = evaluator.Matches(state, 5 * scale);
      const PoseDerivatives derivatives = ComputePoseDerivatives(actor.skeleton, frames.poses[t]);
      const auto by_shape = ShapeDerivatives(bigger, state.positions, frames.poses[t]);
      const Eigen::Index n = derivatives.NumUnknowns();
      std::size_t total = 0;
      for (const auto& list : matches) total += list.size();
      Eigen::MatrixXf rows(n + s, static_cast<Eigen::Index>(total));
      Eigen::VectorXf values(static_cast<Eigen::Index>(total));
      PointJacobian jacobian;
      Eigen::Index at = 0;
      for (const auto& list : matches) {
        for (const Match& m : list) {
          (void)SkinVertexJacobian(actor, derivatives, m.vertex, jacobian);
          const float root = std::sqrt(m.length * RobustWeight(m.residual, scale));
          rows.col(at).head(n) =
              root * (jacobian.transpose() * m.gradient.cast<double>()).cast<float>();
          for (Eigen::Index k = 0; k < s; ++k) {
            rows(n + k, at) =
                root *
                m.gradient.dot(
                    by_shape[static_cast<std::size_t>(k)][static_cast<std::size_t>(m.vertex)]);
          }
          values[at++] = root * m.residual;
        }
      }
      const double unit = 1 / (kContourSigma * kContourSigma * kCorrelation);
      const Eigen::MatrixXd all = unit * (rows * rows.transpose()).cast<double>();
      const Eigen::VectorXd gradient = unit * (rows * values).cast<double>();
      f.pose_pose = all.topLeftCorner(n, n);
      f.pose_shape = all.topRightCorner(n, s);
      f.shape_shape = all.bottomRightCorner(s, s);
      f.pose_gradient = gradient.head(n);
      f.shape_gradient = gradient.tail(s);
      for (Eigen::Index d = 0; d < n; ++d) f.pose_pose(d, d) += d < 6 ? 1e-3 : 3.0;
    });
    Eigen::MatrixXd matrix = precision.asDiagonal();
    Eigen::VectorXd rhs = -precision.cwiseProduct(shape - Eigen::VectorXd::Ones(s));
    std::vector<Eigen::MatrixXd> eliminated(count);
    for (std::size_t t = 0; t < count; ++t) {
      const FrameSystem& f = systems[t];
      const Eigen::LDLT<Eigen::MatrixXd> solver(f.pose_pose);
      eliminated[t] = solver.solve(f.pose_shape);
      matrix += f.shape_shape - f.pose_shape.transpose() * eliminated[t];
      rhs += -f.shape_gradient + eliminated[t].transpose() * f.pose_gradient;
    }
    const Eigen::VectorXd step = matrix.ldlt().solve(rhs);
    if (!step.allFinite()) return;
    bool accepted = false;
    const double before = frames.MeanMismatch();
    for (double share = 1; share > 0.2 && !accepted; share *= 0.5) {
      const Eigen::VectorXd next = (shape + share * step).cwiseMax(kSmallest).cwiseMin(kLargest);
      std::vector<Pose> poses(count);
      for (std::size_t t = 0; t < count; ++t) {
        const Eigen::VectorXd move =
            share *
            (systems[t].pose_pose.ldlt().solve(-systems[t].pose_gradient) - eliminated[t] * step);
        poses[t] = ClampToLimits(
            actor.skeleton,
            MovePose(frames.poses[t],
                     std::span<const double>(move.data(), static_cast<std::size_t>(move.size()))));
      }
      Actor candidate = make(next);
      std::vector<double> mismatch = measure(candidate, poses);
      const double after =
          std::accumulate(mismatch.begin(), mismatch.end(), 0.0) / static_cast<double>(count);
      if (after < before + 0.002) {
        accepted = true;
        shape = next;
        actor = std::move(candidate);
        frames.poses = std::move(poses);
        frames.mismatch = std::move(mismatch);
      }
    }
    if (!accepted) break;
  }
  proportions = UnpackProportions(shape, kinds);
}

}  // namespace dyxel::internal
