#include "dyxel/tracking/track.h"

#include "dyxel/tracking/sequence_tracker.h"

namespace dyxel {

Motion TrackMotion(const SilhouetteSet& silhouettes,
                   const Actor& actor,
                   const MotionOptions& options,
                   const ProgressFn& progress) {
  CheckOptions("motion", options);
  internal::CheckSilhouettes(silhouettes);
  internal::SequenceTracker tracker(silhouettes, actor, options);
  const auto report = [&](double share) {
    if (progress) progress(share);
  };
  tracker.Start();
  tracker.Forward([&](double share) { report(0.1 + 0.6 * share); });
  tracker.Revisit([&](double share) { report(0.7 + 0.15 * share); });
  tracker.Smooth([&](double share) { report(0.85 + 0.15 * share); });
  return tracker.MakeMotion();
}

}  // namespace dyxel
