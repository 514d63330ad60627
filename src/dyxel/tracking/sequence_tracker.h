// A whole sequence: start, forward pass, bad frames from both sides, smoothing.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "dyxel/tracking/frame_tracker.h"
#include "dyxel/tracking/track.h"

namespace dyxel::internal {

// Throws Error(kInput) where masks and cameras don't fit together.
void CheckSilhouettes(const SilhouetteSet& silhouettes);

// The hull of a time step; where parts of the person are lost in the dark in some cameras, the
// lenient one (visual_hull.h).
[[nodiscard]] HullSummary FindPerson(const SilhouetteSet& silhouettes, std::size_t frame);

// What an observation needs of the hull: where the person is, and whose view of him is partial.
struct PersonPlace {
  Vec3d center = Vec3d::Zero();
  std::vector<char> partial;  // [cameras]
};
[[nodiscard]] PersonPlace PlaceOf(const SilhouetteSet& silhouettes,
                                  std::size_t frame,
                                  const HullSummary& hull);

// The views of one time step, grids of at most about `max_cells` cells a side.
[[nodiscard]] Observation ObserveFrame(const SilhouetteSet& silhouettes,
                                       std::size_t frame,
                                       int max_cells = 500);
[[nodiscard]] Observation ObserveFrame(const SilhouetteSet& silhouettes,
                                       std::size_t frame,
                                       const PersonPlace& place,
                                       int max_cells = 500);

class SequenceTracker {
 public:
  // Keeps references; both must outlive it.
  SequenceTracker(const SilhouetteSet& silhouettes, const Actor& actor, const MotionOptions&);

  // Finds the pose of the first frame that shows a person, without a guess; where the facing stays
  // doubtful, the next frames decide. Throws Error(kStage) where no person is found.
  void Start();
  // The next frames from the last ones.
  void Forward(const ProgressFn& progress);
  // Takes known poses of some frames (ascending), measured with this actor.
  void Adopt(std::span<const std::size_t> frames, std::span<const Pose> poses);
  // The frames between the adopted ones, from the nearest known on both sides.
  void Fill(const ProgressFn& progress);
  [[nodiscard]] Motion MakeMotion() const;
  // Frames that came out worse than most, again from their neighbours on both sides.
  void Revisit(const ProgressFn& progress);
  // Draws each pose to the mean of its neighbours as far as the silhouettes let it.
  void Smooth(const ProgressFn& progress);

  // [frames]; mismatch 1 and iou 0 for a frame without silhouettes.
  [[nodiscard]] const std::vector<PoseSolution>& solutions() const { return solutions_; }
  [[nodiscard]] std::size_t first() const { return first_; }

  // Tracks from `from` with `solutions_[from]` known, up to `end` (exclusive). Returns the mean
  // mismatch of those frames.
  double Run(std::size_t from, std::size_t end, const ProgressFn& progress);

 private:
  [[nodiscard]] std::vector<Pose> Guesses(std::size_t frame) const;
  // ObserveFrame, the hull carved once a frame.
  [[nodiscard]] Observation See(std::size_t frame);

  const SilhouetteSet& silhouettes_;
  TrackedBody body_;
  std::vector<Limb> limbs_;
  SolveSettings settings_;
  std::vector<PoseSolution> solutions_;
  std::vector<std::optional<PersonPlace>> places_;
  LimbPatience patience_;
  std::size_t first_ = 0;
  std::vector<std::size_t> adopted_;
};

}  // namespace dyxel::internal
