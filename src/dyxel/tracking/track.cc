#include "dyxel/tracking/track.h"

#include <atomic>
#include <numeric>

#include "dyxel/base/parallel.h"
#include "dyxel/tracking/node_fit.h"
#include "dyxel/tracking/sequence_tracker.h"

namespace dyxel {

Motion TrackMotion(const SilhouetteSet& silhouettes,
                   const Actor& actor,
                   const MotionOptions& options,
                   const ProgressFn& progress,
                   const Motion* known) {
  CheckOptions("motion", options);
  internal::CheckSilhouettes(silhouettes);
  internal::SequenceTracker tracker(silhouettes, actor, options);
  const auto report = [&](double share) {
    if (progress) progress(share);
  };
  if (known != nullptr && known->poses.size() == silhouettes.masks.size()) {
    std::vector<std::size_t> frames(known->poses.size());
    std::iota(frames.begin(), frames.end(), std::size_t{0});
    tracker.Adopt(frames, known->poses);
  } else {
    tracker.Start();
    tracker.Forward([&](double share) { report(0.1 + 0.6 * share); });
  }
  tracker.Revisit([&](double share) { report(0.7 + 0.15 * share); });
  tracker.Smooth([&](double share) { report(0.85 + 0.15 * share); });
  return tracker.MakeMotion();
}

Motion FitShifts(const SilhouetteSet& silhouettes,
                 const Actor& actor_with_nodes,
                 Motion motion,
                 const MotionOptions& options,
                 const ProgressFn& progress) {
  CheckOptions("motion", options);
  internal::CheckSilhouettes(silhouettes);
  if (options.node_rounds == 0) return motion;
  const internal::TrackedBody body = internal::MakeTrackedBody(actor_with_nodes);
  const internal::NodeFit fit(body);
  const std::size_t frames = motion.poses.size();
  const std::vector<Pose> bare = motion.poses;
  std::vector<double> before(frames, 0);  // mismatches, without and with shifts
  std::vector<double> after(frames, 0);
  std::atomic<std::size_t> done = 0;
  // Each time step by itself, then once more near the mean of those beside it.
  for (const bool again : {false, true}) {
    const internal::NodeSettings settings{.rounds = again ? 2 : options.node_rounds,
                                          .stiffness = options.node_stiffness,
                                          .inertia = again ? options.node_inertia : 0};
    if (again && settings.inertia == 0) break;
    const std::vector<Pose> last = motion.poses;
    ParallelFor(frames, [&](std::size_t t) {
      const internal::Observation observation = internal::ObserveFrame(silhouettes, t);
      std::vector<Vec3d> towards;
      if (again) towards = internal::ShiftsBeside(last, t);
      if (observation.views.empty()) {
        motion.poses[t].shifts = towards;
      } else {
        const auto solution = fit.Solve(observation, last[t], towards, settings);
        motion.poses[t] = solution.pose;
        if (!again) {
          before[t] = solution.before;
          after[t] = solution.mismatch;
        }
      }
      if (progress) progress(static_cast<double>(++done) / static_cast<double>(2 * frames));
    });
  }
  constexpr double kLeastGain = 0.25;
  const double unexplained = std::accumulate(after.begin(), after.end(), 0.0);
  if (unexplained > (1 - kLeastGain) * std::accumulate(before.begin(), before.end(), 0.0)) {
    motion.poses = bare;
  }
  return motion;
}

}  // namespace dyxel
