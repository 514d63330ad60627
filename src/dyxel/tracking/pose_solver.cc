#include "dyxel/tracking/pose_solver.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "dyxel/base/parallel.h"
#include "dyxel/tracking/reduced_body.h"

namespace dyxel::internal {
namespace {

constexpr double kContourSigma = 0.015;   // metres: how far off a contour is, clothes included
constexpr double kCorrelation = 0.1;      // metres of contour that say one thing
constexpr float kLeastAgreement = 0.35F;  // cosine between matched outlines' normals
constexpr double kPriorInEnergy = 2e-5;   // mismatch per squared sigma of the angles

double WrappedPrior(const Pose& pose, const Pose& prediction, double sigma) {
  double sum = 0;
  for (std::size_t d = 0; d < pose.angles.size(); ++d) {
    const double e = (pose.angles[d] - prediction.angles[d]) / sigma;
    sum += e * e;
  }
  return sum;
}

// Solves for the step with angles kept within their limits: those that leave are put on the limit
// and the others solved again.
Eigen::VectorXd SolveWithinLimits(const Eigen::MatrixXd& matrix,
                                  const Eigen::VectorXd& rhs,
                                  const Eigen::VectorXd& low,
                                  const Eigen::VectorXd& high) {
  const Eigen::Index n = rhs.size();
  std::vector<char> fixed(static_cast<std::size_t>(n), 0);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
  for (int round = 0; round < 5; ++round) {
    std::vector<Eigen::Index> free;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (fixed[static_cast<std::size_t>(i)] == 0) free.push_back(i);
    }
    const auto m = static_cast<Eigen::Index>(free.size());
    Eigen::MatrixXd a(m, m);
    Eigen::VectorXd b(m);
    for (Eigen::Index i = 0; i < m; ++i) {
      b[i] = rhs[free[static_cast<std::size_t>(i)]];
      for (Eigen::Index j = 0; j < n; ++j) {
        if (fixed[static_cast<std::size_t>(j)] != 0) {
          b[i] -= matrix(free[static_cast<std::size_t>(i)], j) * step[j];
        }
      }
      for (Eigen::Index j = 0; j < m; ++j) {
        a(i, j) = matrix(free[static_cast<std::size_t>(i)], free[static_cast<std::size_t>(j)]);
      }
    }
    const Eigen::VectorXd x = a.ldlt().solve(b);
    bool more = false;
    for (Eigen::Index i = 0; i < m; ++i) {
      const Eigen::Index k = free[static_cast<std::size_t>(i)];
      step[k] = std::clamp(x[i], low[k], high[k]);
      if (step[k] != x[i]) {
        fixed[static_cast<std::size_t>(k)] = 1;
        more = true;
      }
    }
    if (!more) break;
  }
  return step;
}

}  // namespace

TrackedBody MakeTrackedBody(const Actor& actor, int triangles) {
  TrackedBody body{triangles > 0 ? ReduceBody(actor, triangles) : actor, {}};
  body.topology = MakeOutlineTopology(body.actor.skin.triangles,
                                      static_cast<int>(body.actor.skin.positions.size()));
  return body;
}

void MatchView(const View& view,
               std::span<const Vec3f> positions,
               std::span<const Rim> rims,
               float reach,
               std::vector<Match>& matches) {
  const Projector project(*view.camera);
  const float metres = view.metres_per_pixel;
  const float reach_px = reach / metres;
  std::vector<Eigen::Matrix<float, 2, 3>> jacobians(rims.size());
  for (std::size_t k = 0; k < rims.size(); ++k) {
    const Rim& rim = rims[k];
    jacobians[k] = project.Jacobian(positions[static_cast<std::size_t>(rim.vertex)]);
    // Along the rim's normal to where the silhouette ends: outwards from within, inwards from
    // without. Steps of the distance itself never jump over the contour.
    float distance = view.field.At(rim.pixel);
    const bool within = distance > 0;
    if (view.partial() && !within) {
      distance = view.outer.At(rim.pixel);
      if (distance > 0) continue;  // in the dark
    }
    const DistanceField& field = view.partial() && !within ? view.outer : view.field;
    const float direction = distance > 0 ? 1.0F : -1.0F;
    float t = 0;
    Vec2f p = rim.pixel;
    bool found = false;
    for (int i = 0; i < 40 && t < reach_px; ++i) {
      t += std::max(std::abs(distance), 0.25F);
      p = rim.pixel + direction * t * rim.normal;
      const float next = field.At(p);
      if ((next > 0) != (distance > 0)) {
        const float back = std::abs(next) / (std::abs(next) + std::abs(distance) + 1e-6F);
        t -= back * std::max(std::abs(distance), 0.25F);
        found = true;
        break;
      }
      distance = next;
    }
    if (!found || t > reach_px) continue;
    p = rim.pixel + direction * t * rim.normal;
    const Vec2f outwards = -field.Gradient(p);
    const float agreement = outwards.dot(rim.normal) / std::max(outwards.norm(), 1e-6F);
    if (agreement < kLeastAgreement) continue;
    // Moving the rim along its normal by t closes the gap.
    const Vec3f gradient = metres * (jacobians[k].transpose() * rim.normal);
    matches.push_back({rim.vertex, gradient, -direction * t * metres, rim.length * metres});
  }
  for (const ContourSample& sample : view.contour.samples) {
    float best = reach_px * reach_px;
    std::size_t at = rims.size();
    for (std::size_t k = 0; k < rims.size(); ++k) {
      const float d2 = (rims[k].pixel - sample.pixel).squaredNorm();
      if (d2 >= best) continue;
      if (rims[k].normal.dot(sample.normal) < kLeastAgreement) continue;
      best = d2;
      at = k;
    }
    if (at == rims.size()) continue;
    const Vec3f gradient = metres * (jacobians[at].transpose() * sample.normal);
    const float residual = sample.normal.dot(rims[at].pixel - sample.pixel) * metres;
    matches.push_back({rims[at].vertex, gradient, residual, view.contour.spacing * metres});
  }
}

double PoseState::MeanIou() const {
  double sum = 0;
  for (const Overlap& o : overlaps) sum += static_cast<double>(o.Iou());
  return overlaps.empty() ? 0 : sum / static_cast<double>(overlaps.size());
}

PoseEvaluator::PoseEvaluator(const Observation& observation, const TrackedBody& body)
    : observation_(&observation), body_(&body), views_(observation.views.size()) {}

PoseState PoseEvaluator::Evaluate(const Pose& pose) {
  PoseState state;
  state.positions = SkinPositions(body_->actor, pose);
  state.overlaps.resize(views_.size());
  ParallelFor(views_.size(), [&](std::size_t i) {
    const View& view = observation_->views[i];
    views_[i].Clear(view);
    views_[i].Draw(view, state.positions, body_->actor.skin.triangles);
    state.overlaps[i] = views_[i].Compare(view);
  });
  double sum = 0;
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const Overlap& o = state.overlaps[i];
    sum += static_cast<double>((o.either - o.both) / observation_->views[i].norm);
  }
  state.mismatch = views_.empty() ? 1 : sum / static_cast<double>(views_.size());
  return state;
}

std::vector<std::vector<Match>> PoseEvaluator::Matches(const PoseState& state, float reach) {
  std::vector<std::vector<Match>> matches(views_.size());
  const auto& triangles = body_->actor.skin.triangles;
  const std::vector<Vec3f> normals = VertexNormals(state.positions, triangles);
  ParallelFor(views_.size(), [&](std::size_t i) {
    std::vector<Rim> rims;
    const View& view = observation_->views[i];
    views_[i].FindRims(view, state.positions, normals, body_->topology, rims);
    MatchView(view, state.positions, rims, reach, matches[i]);
  });
  return matches;
}

NormalEquations BuildPoseEquations(const Actor& actor,
                                   const Pose& pose,
                                   std::span<const std::vector<Match>> matches,
                                   float scale) {
  const PoseDerivatives derivatives = ComputePoseDerivatives(actor.skeleton, pose);
  const int n = derivatives.NumUnknowns();
  // The matched vertices, once each, and their derivatives.
  std::vector<int> slot(actor.skin.positions.size(), -1);
  std::vector<int> vertices;
  for (const auto& list : matches) {
    for (const Match& m : list) {
      if (slot[static_cast<std::size_t>(m.vertex)] >= 0) continue;
      slot[static_cast<std::size_t>(m.vertex)] = static_cast<int>(vertices.size());
      vertices.push_back(m.vertex);
    }
  }
  std::vector<Eigen::Matrix<float, 3, Eigen::Dynamic>> jacobians(vertices.size());
  ParallelForBlocks(vertices.size(), 128, [&](std::size_t begin, std::size_t end) {
    PointJacobian jacobian;
    for (std::size_t k = begin; k < end; ++k) {
      (void)SkinVertexJacobian(actor, derivatives, vertices[k], jacobian);
      jacobians[k] = jacobian.cast<float>();
    }
  });
  std::vector<NormalEquations> parts(matches.size());
  ParallelFor(matches.size(), [&](std::size_t i) {
    NormalEquations& part = parts[i];
    Eigen::MatrixXf rows(n, static_cast<Eigen::Index>(matches[i].size()));
    Eigen::VectorXf values(static_cast<Eigen::Index>(matches[i].size()));
    for (std::size_t k = 0; k < matches[i].size(); ++k) {
      const Match& m = matches[i][k];
      const float w = m.length * RobustWeight(m.residual, scale);
      const float root = std::sqrt(w);
      const auto col = static_cast<Eigen::Index>(k);
      rows.col(col).noalias() =
          root * (jacobians[static_cast<std::size_t>(slot[static_cast<std::size_t>(m.vertex)])]
                      .transpose() *
                  m.gradient);
      values[col] = root * m.residual;
      part.weight += static_cast<double>(w);
    }
    part.matrix = (rows * rows.transpose()).cast<double>();
    part.gradient = (rows * values).cast<double>();
  });
  NormalEquations sum;
  sum.matrix = Eigen::MatrixXd::Zero(n, n);
  sum.gradient = Eigen::VectorXd::Zero(n);
  for (const NormalEquations& part : parts) {
    sum.matrix += part.matrix;
    sum.gradient += part.gradient;
    sum.weight += part.weight;
  }
  const double unit = 1 / (kContourSigma * kContourSigma * kCorrelation);
  sum.matrix *= unit;
  sum.gradient *= unit;
  return sum;
}

PoseSolution SolvePose(PoseEvaluator& evaluator,
                       const Pose& start,
                       const Pose& prediction,
                       const SolveSettings& settings) {
  const Actor& actor = evaluator.body().actor;
  std::vector<const Dof*> dofs;
  for (const Joint& joint : actor.skeleton.joints) {
    for (const Dof& dof : joint.dofs) dofs.push_back(&dof);
  }
  const auto energy = [&](const Pose& pose, const PoseState& state) {
    return state.mismatch + kPriorInEnergy * WrappedPrior(pose, prediction, settings.angle_sigma);
  };
  Pose pose = ClampToLimits(actor.skeleton, start);
  PoseState state = evaluator.Evaluate(pose);
  double current = energy(pose, state);
  PoseSolution best{pose, state.mismatch, state.MeanIou(), 0};
  double best_energy = current;
  int idle = 0;
  double damping = 1e-3;
  for (int i = 0; i < settings.max_iterations; ++i) {
    const float share = std::min(1.0F, static_cast<float>(i) / 8.0F);
    const float scale =
        settings.scale_start * std::pow(settings.scale_end / settings.scale_start, share);
    const auto matches = evaluator.Matches(state, std::min(settings.reach, 5 * scale));
    NormalEquations system = BuildPoseEquations(actor, pose, matches, scale);
    const Eigen::Index n = system.gradient.size();
    Eigen::VectorXd low = Eigen::VectorXd::Constant(n, -1e9);
    Eigen::VectorXd high = Eigen::VectorXd::Constant(n, 1e9);
    for (Eigen::Index d = 0; d < n - 6; ++d) {
      const double angle = pose.angles[static_cast<std::size_t>(d)];
      const double near = 1 / (settings.angle_sigma * settings.angle_sigma);
      const double neutral = 1 / (settings.neutral_sigma * settings.neutral_sigma);
      system.matrix(6 + d, 6 + d) += near + neutral;
      system.gradient[6 + d] +=
          near * (angle - prediction.angles[static_cast<std::size_t>(d)]) + neutral * angle;
      low[6 + d] = settings.root_only ? 0 : dofs[static_cast<std::size_t>(d)]->min - angle;
      high[6 + d] = settings.root_only ? 0 : dofs[static_cast<std::size_t>(d)]->max - angle;
    }
    for (Eigen::Index k = 0; k < n; ++k) {
      system.matrix(k, k) += damping * system.matrix(k, k) + 1e-6;
    }
    Eigen::VectorXd step = SolveWithinLimits(system.matrix, -system.gradient, low, high);
    if (!step.allFinite()) break;
    // The overlap is the judge; matches may have been wrong.
    bool accepted = false;
    Pose next;
    PoseState next_state;
    double next_energy = 0;
    for (int halving = 0; halving < 3; ++halving) {
      next = MovePose(pose, std::span<const double>(step.data(), static_cast<std::size_t>(n)));
      next_state = evaluator.Evaluate(next);
      next_energy = energy(next, next_state);
      // Early steps may cross a little ridge on their way.
      const double ridge = i < 5 ? 0.02 : 0.001;
      if (next_energy < current + ridge) {
        accepted = true;
        break;
      }
      step *= 0.4;
      damping *= 3;
    }
    best.iterations = i + 1;
    if (!accepted) {
      if (share >= 1) break;
      state = evaluator.Evaluate(pose);  // the drawing that Matches() reads
      ++idle;
      continue;
    }
    damping = std::max(1e-4, damping * 0.5);
    pose = next;
    state = std::move(next_state);
    current = next_energy;
    if (next_energy < best_energy - 2e-4) {
      idle = 0;
    } else if (share >= 1) {
      ++idle;
    }
    if (next_energy < best_energy) {
      best_energy = next_energy;
      best.pose = pose;
      best.mismatch = state.mismatch;
      best.iou = state.MeanIou();
    }
    if (idle >= 3) break;
  }
  return best;
}

}  // namespace dyxel::internal
