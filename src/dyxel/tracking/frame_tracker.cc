#include "dyxel/tracking/frame_tracker.h"

#include <algorithm>
#include <cmath>

namespace dyxel::internal {
namespace {

// A limb whose drawing lies off the silhouette by more than this share, or beside which this share
// of its area is seen and not covered, is searched.
constexpr double kPoorOutside = 0.2;
constexpr double kPoorMissed = 0.35;
constexpr double kWorse = 0.08;        // worse than where a search brought nothing
constexpr double kWorthwhile = 0.002;  // mismatch that a searched limb has to gain

double FacingDifference(const Pose& a, const Pose& b, const Vec3d& up) {
  const auto forward = [&](const Pose& p) {
    Vec3d x = p.root_rotation * Vec3d(Vec3d::UnitX());
    x -= up * up.dot(x);
    return Vec3d(x.normalized());
  };
  return std::acos(std::clamp(forward(a).dot(forward(b)), -1.0, 1.0));
}

void SortByMismatch(std::vector<PoseSolution>& solutions) {
  std::sort(solutions.begin(), solutions.end(), [](const auto& a, const auto& b) {
    return a.mismatch < b.mismatch;
  });
}

PoseSolution SearchOneLimb(PoseEvaluator& evaluator,
                           PoseSolution solution,
                           const Pose& prediction,
                           const Limb& limb,
                           const SolveSettings& settings,
                           int candidates) {
  SolveSettings local = settings;
  local.scale_start = 0.06F;
  local.max_iterations = std::min(settings.max_iterations, 12);
  for (const LimbCandidate& candidate : SearchLimb(evaluator, solution.pose, limb, candidates)) {
    // The searched limb is drawn to what was found, the rest of the body to the prediction.
    Pose towards = prediction;
    for (const int d : limb.dofs) {
      towards.angles[static_cast<std::size_t>(d)] =
          candidate.pose.angles[static_cast<std::size_t>(d)];
    }
    const PoseSolution next = SolvePose(evaluator, candidate.pose, towards, local);
    if (next.mismatch < solution.mismatch - kWorthwhile) solution = next;
  }
  return solution;
}

// Searches every limb that `poor` names, one after the other, and solves on.
template <class Poor>
PoseSolution SearchLimbs(PoseEvaluator& evaluator,
                         PoseSolution solution,
                         const Pose& prediction,
                         std::span<const Limb> limbs,
                         const SolveSettings& settings,
                         int candidates,
                         Poor&& poor) {
  for (const Limb& limb : limbs) {
    if (!poor(solution.pose, limb)) continue;
    solution = SearchOneLimb(evaluator, solution, prediction, limb, settings, candidates);
  }
  return solution;
}

}  // namespace

std::vector<PoseSolution> FindStarts(PoseEvaluator& evaluator,
                                     const HullSummary& hull,
                                     const Vec3d& up,
                                     std::span<const Limb> limbs,
                                     int keep) {
  std::vector<PoseSolution> solutions;
  if (!hull.found || evaluator.observation().views.empty()) return solutions;
  const Actor& actor = evaluator.body().actor;
  const Mat3d upright = UprightFrame(up);
  const double trunk_x = upright.col(0).dot(hull.trunk);
  const double trunk_y = upright.col(1).dot(hull.trunk);
  float lowest = 1e9F, highest = -1e9F;
  for (const Vec3f& x : actor.skin.positions) {
    lowest = std::min(lowest, x.z());
    highest = std::max(highest, x.z());
  }
  const double root = actor.skeleton.joints[0].offset.z();
  const double standing = hull.bottom + root - static_cast<double>(lowest);
  const double reaching = hull.top - (static_cast<double>(highest) - root);
  std::vector<double> heights = {standing};
  if (std::abs(standing - reaching) > 0.08) heights.push_back(reaching);

  SolveSettings rough;
  rough.scale_start = 0.25F;
  rough.scale_end = 0.1F;
  rough.reach = 0.6F;
  constexpr int kFacings = 8;
  for (const double height : heights) {
    for (int k = 0; k < kFacings; ++k) {
      Pose pose = actor.skeleton.RestPose();
      pose.root_translation = upright * Vec3d(trunk_x, trunk_y, height);
      const double turn = 2 * kPiD * k / kFacings;
      pose.root_rotation = Quatd(upright * Eigen::AngleAxisd(turn, Vec3d::UnitZ()).matrix());
      const Pose rest = pose;
      rough.root_only = true;
      rough.max_iterations = 4;
      PoseSolution s = SolvePose(evaluator, pose, rest, rough);
      rough.root_only = false;
      rough.max_iterations = 8;
      solutions.push_back(SolvePose(evaluator, s.pose, rest, rough));
    }
  }
  SortByMismatch(solutions);
  const auto distinct = [&](std::vector<PoseSolution>& list, int most, double angle) {
    std::vector<PoseSolution> kept;
    for (PoseSolution& s : list) {
      bool fresh = true;
      for (const PoseSolution& k : kept) {
        fresh &= FacingDifference(s.pose, k.pose, up) > angle;
      }
      if (fresh && static_cast<int>(kept.size()) < most) kept.push_back(std::move(s));
    }
    list = std::move(kept);
  };
  distinct(solutions, keep + 2, 0.35);
  SolveSettings fine;
  fine.max_iterations = 8;
  for (PoseSolution& s : solutions) {
    fine.max_iterations = 8;
    for (int round = 0; round < 2; ++round) {
      s = SearchLimbs(
          evaluator, s, s.pose, limbs, fine, 1, [&](const Pose& pose, const Limb& limb) {
            if (round == 0) return true;
            const LimbOverlap overlap = MeasureLimb(evaluator, pose, limb);
            return overlap.outside > kPoorOutside || overlap.missed > kPoorMissed;
          });
    }
    fine.max_iterations = 20;
    const PoseSolution on = SolvePose(evaluator, s.pose, s.pose, fine);
    if (on.mismatch < s.mismatch) s = on;
  }
  SortByMismatch(solutions);
  distinct(solutions, keep, kPiD / 3);
  return solutions;
}

PoseSolution TrackFrame(PoseEvaluator& evaluator,
                        std::span<const Pose> guesses,
                        std::span<const Limb> limbs,
                        const SolveSettings& settings,
                        LimbPatience& patience) {
  // Only the guess that overlaps best is solved.
  std::vector<PoseSolution> starts;
  for (const Pose& guess : guesses) {
    const Pose limited = ClampToLimits(evaluator.body().actor.skeleton, guess);
    const PoseState state = evaluator.Evaluate(limited);
    starts.push_back({limited, state.mismatch, state.MeanIou(), 0});
  }
  SortByMismatch(starts);
  PoseSolution best = SolvePose(evaluator, starts[0].pose, guesses[0], settings);
  patience.resize(limbs.size());
  for (std::size_t l = 0; l < limbs.size(); ++l) {
    const LimbOverlap overlap = MeasureLimb(evaluator, best.pose, limbs[l]);
    LimbOverlap& known = patience[l];
    const bool poor = overlap.outside > std::max(kPoorOutside, known.outside + kWorse) ||
                      overlap.missed > std::max(kPoorMissed, known.missed + kWorse);
    if (!poor) {
      known.outside = std::min(known.outside, overlap.outside);
      known.missed = std::min(known.missed, overlap.missed);
      continue;
    }
    const PoseSolution next =
        SearchOneLimb(evaluator, best, guesses[0], limbs[l], settings, /*candidates=*/2);
    known = next.mismatch < best.mismatch ? LimbOverlap{} : overlap;
    best = next;
  }
  return best;
}

}  // namespace dyxel::internal
