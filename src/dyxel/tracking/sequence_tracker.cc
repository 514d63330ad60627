#include "dyxel/tracking/sequence_tracker.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dyxel/base/error.h"
#include "dyxel/tracking/silhouettes.h"

namespace dyxel::internal {
namespace {

bool Better(const PoseSolution& a, const PoseSolution& b, double margin = 1e-4) {
  return a.mismatch < b.mismatch - margin;
}

// Where the strict hull has less than this share of the lenient one, silhouettes are incomplete.
constexpr double kLostInTheDark = 0.5;
// A view is partial where so much of the hull is unknown to it.
constexpr double kPartialView = 0.25;

}  // namespace

void CheckSilhouettes(const SilhouetteSet& silhouettes) {
  Require(!silhouettes.cameras.empty() && !silhouettes.masks.empty(),
          Fault::kInput,
          "tracking needs silhouettes; the sequence has no frames or no cameras for estimation");
  for (std::size_t t = 0; t < silhouettes.masks.size(); ++t) {
    const auto& masks = silhouettes.masks[t];
    Require(masks.size() == silhouettes.cameras.size(),
            Fault::kInput,
            "frame {} has {} silhouettes for {} cameras",
            t,
            masks.size(),
            silhouettes.cameras.size());
    for (std::size_t c = 0; c < masks.size(); ++c) {
      const Camera& camera = silhouettes.cameras[c];
      Require(
          masks[c].empty() || (masks[c].width == camera.width && masks[c].height == camera.height),
          Fault::kInput,
          "silhouette of frame {}, camera {} is {}x{}, the camera {}x{}",
          t,
          camera.name,
          masks[c].width,
          masks[c].height,
          camera.width,
          camera.height);
    }
  }
}

HullSummary FindPerson(const SilhouetteSet& silhouettes, std::size_t frame) {
  const auto& masks = silhouettes.masks[frame];
  const HullSummary strict = FindHull(silhouettes.cameras, masks, silhouettes.up);
  bool dark = false;
  for (const ImageU8& mask : masks) {
    dark |= std::find(mask.data.begin(), mask.data.end(), kMaskUnknown) != mask.data.end();
  }
  if (!dark) return strict;
  const HullSummary lenient =
      FindHull(silhouettes.cameras, masks, silhouettes.up, 0.03, Dark::kUnknown);
  const double ratio = std::pow(0.025 / 0.03, 3);
  const bool lost = static_cast<double>(strict.voxels) * ratio <
                    kLostInTheDark * static_cast<double>(lenient.voxels);
  if (!lenient.found || (strict.found && !lost)) return strict;
  return lenient;
}

PersonPlace PlaceOf(const SilhouetteSet& silhouettes, std::size_t frame, const HullSummary& hull) {
  const auto& masks = silhouettes.masks[frame];
  PersonPlace place;
  place.partial.assign(masks.size(), 0);
  for (std::size_t c = 0; c < hull.unknown.size(); ++c) {
    place.partial[c] = hull.unknown[c] > kPartialView ? 1 : 0;
  }
  place.center = hull.found ? hull.center : MeetingPoint(silhouettes.cameras, masks);
  return place;
}

Observation ObserveFrame(const SilhouetteSet& silhouettes, std::size_t frame, int max_cells) {
  const HullSummary hull = FindPerson(silhouettes, frame);
  return ObserveFrame(silhouettes, frame, PlaceOf(silhouettes, frame, hull), max_cells);
}

Observation ObserveFrame(const SilhouetteSet& silhouettes,
                         std::size_t frame,
                         const PersonPlace& place,
                         int max_cells) {
  return Observe(
      silhouettes.cameras, silhouettes.masks[frame], place.center, max_cells, place.partial);
}

SequenceTracker::SequenceTracker(const SilhouetteSet& silhouettes,
                                 const Actor& actor,
                                 const MotionOptions& options)
    : silhouettes_(silhouettes),
      body_(MakeTrackedBody(actor)),
      limbs_(FindLimbs(body_.actor)),
      solutions_(silhouettes.masks.size()),
      places_(silhouettes.masks.size()) {
  settings_.max_iterations = options.max_iterations;
}

Observation SequenceTracker::See(std::size_t frame) {
  std::optional<PersonPlace>& place = places_[frame];
  if (!place) place = PlaceOf(silhouettes_, frame, FindPerson(silhouettes_, frame));
  return ObserveFrame(silhouettes_, frame, *place);
}

void SequenceTracker::Start() {
  const std::size_t frames = silhouettes_.masks.size();
  std::vector<PoseSolution> starts;
  for (first_ = 0; first_ < frames; ++first_) {
    const HullSummary hull = FindPerson(silhouettes_, first_);
    if (!hull.found) continue;
    places_[first_] = PlaceOf(silhouettes_, first_, hull);
    const Observation observation = ObserveFrame(silhouettes_, first_, *places_[first_], 200);
    PoseEvaluator evaluator(observation, body_);
    starts = FindStarts(evaluator, hull, silhouettes_.up, limbs_, 3);
    if (!starts.empty()) break;
  }
  Require(!starts.empty(),
          Fault::kStage,
          "no person found: the silhouettes of no frame meet in space. Look at the silhouettes and "
          "at the cameras' calibration (`dyxel check`)");
  // Front and back look alike in one time step; over several, the wrong one fits worse.
  const std::size_t end = std::min(frames, first_ + 5);
  double least = 1e9;
  std::vector<PoseSolution> best;
  for (const PoseSolution& start : starts) {
    if (start.mismatch > 1.6 * starts[0].mismatch) break;
    const Observation observation = See(first_);
    PoseEvaluator evaluator(observation, body_);
    solutions_[first_] = SolvePose(evaluator, start.pose, start.pose, settings_);
    const double mismatch = Run(first_, end, {});
    if (mismatch >= least) continue;
    least = mismatch;
    best = solutions_;
  }
  solutions_ = best;
}

std::vector<Pose> SequenceTracker::Guesses(std::size_t frame) const {
  std::vector<Pose> guesses;
  const Pose& last = solutions_[frame - 1].pose;
  if (frame >= first_ + 2) {
    const Pose& before = solutions_[frame - 2].pose;
    guesses.push_back(InterpolatePoses(before, last, 1.8));
    guesses.push_back(InterpolatePoses(before, last, 1.4));
  }
  guesses.push_back(last);
  return guesses;
}

double SequenceTracker::Run(std::size_t from, std::size_t end, const ProgressFn& progress) {
  double sum = solutions_[from].mismatch;
  patience_.clear();
  for (std::size_t t = from + 1; t < end; ++t) {
    const Observation observation = See(t);
    const std::vector<Pose> guesses = Guesses(t);
    if (observation.views.empty()) {
      solutions_[t] = {guesses.back(), 1, 0, 0};
    } else {
      PoseEvaluator evaluator(observation, body_);
      solutions_[t] = TrackFrame(evaluator, guesses, limbs_, settings_, patience_);
    }
    sum += solutions_[t].mismatch;
    if (progress) progress(static_cast<double>(t - from) / static_cast<double>(end - from));
  }
  return sum / static_cast<double>(std::max<std::size_t>(1, end - from));
}

void SequenceTracker::Forward(const ProgressFn& progress) {
  (void)Run(first_, silhouettes_.masks.size(), progress);
  // Frames before the first that showed the person.
  for (std::size_t t = 0; t < first_; ++t) solutions_[t] = {solutions_[first_].pose, 1, 0, 0};
}

void SequenceTracker::Adopt(std::span<const std::size_t> frames, std::span<const Pose> poses) {
  adopted_.assign(frames.begin(), frames.end());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const Observation observation = See(frames[k]);
    solutions_[frames[k]] = {poses[k], 1, 0, 0};
    if (observation.views.empty()) continue;
    PoseEvaluator evaluator(observation, body_);
    const PoseState state = evaluator.Evaluate(poses[k]);
    solutions_[frames[k]] = {poses[k], state.mismatch, state.MeanIou(), 0};
  }
  first_ = adopted_.empty() ? 0 : adopted_.front();
}

void SequenceTracker::Fill(const ProgressFn& progress) {
  std::size_t next = 0;  // the first adopted frame not before t
  for (std::size_t t = 0; t < solutions_.size(); ++t) {
    if (progress) progress(static_cast<double>(t) / static_cast<double>(solutions_.size()));
    while (next < adopted_.size() && adopted_[next] < t) ++next;
    if (next < adopted_.size() && adopted_[next] == t) continue;
    std::vector<Pose> guesses;
    if (next > 0 && next < adopted_.size()) {
      const std::size_t a = adopted_[next - 1];
      const std::size_t b = adopted_[next];
      guesses.push_back(InterpolatePoses(solutions_[a].pose,
                                         solutions_[b].pose,
                                         static_cast<double>(t - a) / static_cast<double>(b - a)));
    } else {
      guesses.push_back(solutions_[next > 0 ? adopted_[next - 1] : adopted_[0]].pose);
    }
    if (t > 0) guesses.push_back(solutions_[t - 1].pose);
    const Observation observation = See(t);
    if (observation.views.empty()) {
      solutions_[t] = {guesses[0], 1, 0, 0};
      continue;
    }
    PoseEvaluator evaluator(observation, body_);
    solutions_[t] = TrackFrame(evaluator, guesses, limbs_, settings_, patience_);
  }
}

Motion SequenceTracker::MakeMotion() const {
  Motion motion;
  for (const PoseSolution& s : solutions_) {
    motion.poses.push_back(s.pose);
    motion.confidence.push_back(s.iou);
  }
  return motion;
}

void SequenceTracker::Revisit(const ProgressFn& progress) {
  const std::size_t frames = solutions_.size();
  std::vector<double> sorted;
  for (const PoseSolution& s : solutions_) sorted.push_back(s.mismatch);
  std::sort(sorted.begin(), sorted.end());
  const double limit = sorted[sorted.size() / 2] * 1.05;
  SolveSettings settings = settings_;
  settings.scale_start = 0.08F;
  for (std::size_t k = 0; k < frames; ++k) {
    const std::size_t t = frames - 1 - k;
    if (progress) progress(static_cast<double>(k) / static_cast<double>(frames));
    if (solutions_[t].mismatch < limit) continue;
    const Observation observation = See(t);
    if (observation.views.empty()) {
      if (t > 0 && t + 1 < frames) {
        solutions_[t].pose = InterpolatePoses(solutions_[t - 1].pose, solutions_[t + 1].pose, 0.5);
      }
      continue;
    }
    PoseEvaluator evaluator(observation, body_);
    std::vector<Pose> guesses;
    if (t + 1 < frames) guesses.push_back(solutions_[t + 1].pose);
    if (t > 0 && t + 1 < frames) {
      guesses.push_back(InterpolatePoses(solutions_[t - 1].pose, solutions_[t + 1].pose, 0.5));
    }
    if (t + 2 < frames) {
      guesses.push_back(InterpolatePoses(solutions_[t + 2].pose, solutions_[t + 1].pose, 1.7));
    }
    if (guesses.empty()) continue;
    for (const Pose& guess : guesses) {
      const std::array<Pose, 1> one = {guess};
      const PoseSolution again = TrackFrame(evaluator, one, limbs_, settings, patience_);
      if (Better(again, solutions_[t], 5e-4)) solutions_[t] = again;
    }
  }
}

void SequenceTracker::Smooth(const ProgressFn& progress) {
  constexpr double kAllowed = 0.001;  // mismatch that smoothness may cost a frame
  SolveSettings settings = settings_;
  settings.scale_start = 0.03F;
  settings.angle_sigma = 0.12;
  settings.max_iterations = 6;
  const std::vector<PoseSolution> before = solutions_;
  for (std::size_t t = 1; t + 1 < solutions_.size(); ++t) {
    if (progress) progress(static_cast<double>(t) / static_cast<double>(solutions_.size()));
    const Pose middle = InterpolatePoses(before[t - 1].pose, before[t + 1].pose, 0.5);
    const Pose towards = InterpolatePoses(before[t].pose, middle, 0.5);
    const Observation observation = See(t);
    if (observation.views.empty()) continue;
    PoseEvaluator evaluator(observation, body_);
    // The angles that the silhouettes leave open take the neighbours' mean, the others stay.
    const PoseSolution smooth = SolvePose(evaluator, towards, towards, settings);
    if (smooth.mismatch < before[t].mismatch + kAllowed) solutions_[t] = smooth;
  }
}

}  // namespace dyxel::internal
