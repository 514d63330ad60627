// FitActor: start, proportions, skin; docs/method.md (T6), (T8), (T9).
#include <algorithm>
#include <cmath>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/tracking/actor_fit.h"
#include "dyxel/tracking/sequence_tracker.h"
#include "dyxel/tracking/track.h"

namespace dyxel {
namespace {

using internal::FitFrames;
using internal::HullSummary;

// At most `most` of `count` frames, spread evenly, the first among them.
std::vector<std::size_t> SpreadFrames(std::size_t count, std::size_t most) {
  std::vector<std::size_t> frames;
  const std::size_t n = std::min(count, most);
  for (std::size_t k = 0; k < n; ++k) frames.push_back(k * count / n);
  return frames;
}

// Height of the person: the median of the hulls', which hold raised arms at times.
double EstimateHeight(const SilhouetteSet& silhouettes) {
  std::vector<double> heights;
  const std::size_t frames = silhouettes.masks.size();
  for (const std::size_t t : SpreadFrames(frames, 5)) {
    const HullSummary hull = internal::FindPerson(silhouettes, t);
    if (hull.found) heights.push_back(hull.top - hull.bottom);
  }
  Require(!heights.empty(),
          Fault::kStage,
          "no person found: the silhouettes of no frame meet in space. Look at the silhouettes and "
          "at the cameras' calibration (`dyxel check`)");
  std::sort(heights.begin(), heights.end());
  return heights[heights.size() / 2];
}

double SkinHeight(const Actor& actor) {
  float low = 1e9F, high = -1e9F;
  for (const Vec3f& x : actor.skin.positions) {
    low = std::min(low, x.z());
    high = std::max(high, x.z());
  }
  return static_cast<double>(high - low);
}

}  // namespace

ActorFit FitActor(const SilhouetteSet& silhouettes,
                  const Actor& body_template,
                  const ActorOptions& actor_options,
                  const MotionOptions& motion_options,
                  const ProgressFn& progress) {
  CheckOptions("actor", actor_options);
  CheckOptions("motion", motion_options);
  internal::CheckSilhouettes(silhouettes);
  const auto report = [&](double share) {
    if (progress) progress(share);
  };
  const std::size_t count = silhouettes.masks.size();
  const std::vector<std::size_t> chosen =
      SpreadFrames(count, static_cast<std::size_t>(actor_options.max_frames));
  SilhouetteSet subset{silhouettes.cameras, {}, silhouettes.up};
  for (const std::size_t t : chosen) subset.masks.push_back(silhouettes.masks[t]);

  ActorFit fit;
  fit.proportions = TemplateProportions();
  fit.proportions.height = std::clamp(EstimateHeight(subset) / SkinHeight(body_template), 0.5, 1.6);
  fit.actor = ApplyProportions(body_template, fit.proportions);
  report(0.02);

  // Poses with the scaled template, start found.
  FitFrames frames;
  std::vector<std::size_t> known;  // the frames' numbers in the sequence
  {
    internal::SequenceTracker tracker(subset, fit.actor, motion_options);
    tracker.Start();
    report(0.1);
    tracker.Forward([&](double share) { report(0.1 + 0.25 * share); });
    for (std::size_t t = 0; t < chosen.size(); ++t) {
      if (tracker.solutions()[t].iou <= 0) continue;
      frames.observations.push_back(internal::ObserveFrame(subset, t));
      frames.poses.push_back(tracker.solutions()[t].pose);
      frames.mismatch.push_back(tracker.solutions()[t].mismatch);
      known.push_back(chosen[t]);
    }
  }

  internal::SolveSettings settings;
  settings.max_iterations = 10;
  settings.scale_start = 0.05F;
  for (int round = 0; round < actor_options.rounds; ++round) {
    const float scale = round == 0 ? 0.06F : 0.03F;
    internal::FitProportions(body_template, fit.proportions, frames, 4, scale);
    fit.actor = ApplyProportions(body_template, fit.proportions);
    internal::SolveFrames(fit.actor, frames, settings);
    report(0.35 + 0.35 * (round + 1) / actor_options.rounds);
  }

  if (actor_options.refine > 0) {
    const std::vector<Vec3f> base = fit.actor.skin.positions;
    std::vector<float> displacement;
    settings.max_iterations = 6;
    settings.scale_start = 0.03F;
    for (int round = 0; round < actor_options.refine; ++round) {
      const double share =
          actor_options.refine > 1 ? static_cast<double>(round) / (actor_options.refine - 1) : 1.0;
      const double smoothness =
          actor_options.smoothness * (round == 0 ? 3.0 : 1.0 + 2.0 * (1 - share));
      internal::RefineSkin(fit.actor,
                           base,
                           displacement,
                           frames,
                           round < 2 ? 0.04F : 0.02F,
                           smoothness,
                           static_cast<float>(actor_options.max_displacement));
      internal::SolveFrames(fit.actor, frames, settings);
      report(0.7 + 0.15 * (round + 1) / actor_options.refine);
    }
  }

  // All frames of the sequence, from the fitted ones.
  internal::SequenceTracker tracker(silhouettes, fit.actor, motion_options);
  tracker.Adopt(known, frames.poses);
  tracker.Fill([&](double share) { report(0.85 + 0.08 * share); });
  tracker.Revisit([&](double share) { report(0.93 + 0.03 * share); });
  tracker.Smooth([&](double share) { report(0.96 + 0.04 * share); });
  fit.motion = tracker.MakeMotion();
  return fit;
}

}  // namespace dyxel
