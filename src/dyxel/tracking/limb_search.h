// A coarse search over one limb's angles where its overlap is poor; docs/method.md (T7).
#pragma once

#include <string>
#include <vector>

#include "dyxel/tracking/pose_solver.h"

namespace dyxel::internal {

// An arm or a leg: its dofs and what it draws.
struct Limb {
  std::string name;            // "l_arm", …
  std::vector<int> joints;     // upper, lower, end
  std::vector<int> dofs;       // all of those joints
  std::vector<int> search;     // the dofs that the search turns, at most four: the first joint's,
                               // and the second's first
  std::vector<int> triangles;  // moved mainly by them
  std::vector<int> others;     // the rest of the triangles
};
// The limbs that the skeleton's joint names give ("l_upper_arm", "l_lower_arm", "l_hand", …).
[[nodiscard]] std::vector<Limb> FindLimbs(const Actor& actor);

// Shares in [0, 1], mean over the views: `outside` of the limb's drawing that is not on the
// silhouette, `missed` silhouette area (in limb areas) within the limb's reach that nothing covers.
struct LimbOverlap {
  double outside = 0;
  double missed = 0;
};
[[nodiscard]] LimbOverlap MeasureLimb(PoseEvaluator& evaluator, const Pose& pose, const Limb& limb);

// The best of a grid over the limb's angles: candidates are ranked by points along its bones
// against the distance fields and by the silhouette that only it can explain, and the best few are
// drawn. Returns them, best first (least mismatch), at most `keep`; the given pose competes too.
struct LimbCandidate {
  Pose pose;
  double mismatch;
};
[[nodiscard]] std::vector<LimbCandidate> SearchLimb(PoseEvaluator& evaluator,
                                                    const Pose& pose,
                                                    const Limb& limb,
                                                    int keep = 2);

}  // namespace dyxel::internal
