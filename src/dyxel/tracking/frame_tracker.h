// One time step at a time: starts without a guess, and the step from known neighbours.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "dyxel/tracking/limb_search.h"
#include "dyxel/tracking/pose_solver.h"
#include "dyxel/tracking/visual_hull.h"

namespace dyxel::internal {

// Poses of one time step found from the hull alone: bodies turned by eighths of a circle, upright,
// standing on the hull's bottom or reaching to its top, solved, their limbs searched. Best first;
// facings differ by 60° at least. Empty where there is no hull.
[[nodiscard]] std::vector<PoseSolution> FindStarts(PoseEvaluator& evaluator,
                                                   const HullSummary& hull,
                                                   const Vec3d& up,
                                                   std::span<const Limb> limbs,
                                                   int keep);

// How badly each limb overlapped where a search of it brought nothing: it is searched again where
// it gets worse.
using LimbPatience = std::vector<LimbOverlap>;  // [limbs]

// The pose solved from that one of `guesses` (at least one) that overlaps best as it is, drawn
// towards the first one's angles; limbs whose overlap stays poor are searched.
[[nodiscard]] PoseSolution TrackFrame(PoseEvaluator& evaluator,
                                      std::span<const Pose> guesses,
                                      std::span<const Limb> limbs,
                                      const SolveSettings& settings,
                                      LimbPatience& patience);

}  // namespace dyxel::internal
