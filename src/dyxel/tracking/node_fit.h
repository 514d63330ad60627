// What poses leave: the nodes' shifts of a time step from rims and contours; docs/method.md (G3).
#pragma once

#include <vector>

#include <Eigen/SparseCore>

#include "dyxel/tracking/pose_solver.h"

namespace dyxel::internal {

struct NodeSettings {
  int rounds = 4;
  double stiffness = 0.02;  // of the shifts' smoothness over the nodes, against the contours
  double inertia = 0;       // of staying near `towards`
};

// Where the silhouettes say nothing the shifts follow their neighbours, and are none far from all
// that is seen. Keeps what depends on the actor's topology only; Solve() may be called from several
// threads. Embedded deformation after Sumner, Schmid and Pauly (2007).
class NodeFit {
 public:
  // `body` is an actor with nodes, simplified or not; it must outlive this.
  explicit NodeFit(const TrackedBody& body);

  struct Solution {
    Pose pose;                        // with shifts (N)
    double before = 1, mismatch = 1;  // (T1), without any shift and with these
  };
  // From pose.shifts (or none); `towards` (N, nodes' frames) is what inertia holds to, or empty.
  // `seen` are further residuals (metres), of where the pose puts the skin. The shifts that overlap
  // best on the way are taken; with inertia or further residuals, which the overlap does not judge,
  // the last round's.
  [[nodiscard]] Solution Solve(const Observation& observation,
                               const Pose& pose,
                               const std::vector<Vec3d>& towards,
                               const NodeSettings& settings,
                               std::span<const Match> seen = {}) const;

 private:
  const TrackedBody* body_;
  std::vector<int> node_of_joint_;                  // -1 for bones
  std::vector<std::size_t> joint_of_node_;          // (N)
  std::vector<Eigen::Triplet<double>> smoothness_;  // of LᵀL (N, N), L the graph's Laplacian
};

// The mean of the shifts (N) of the time steps beside frame `t`; empty where there are none.
[[nodiscard]] std::vector<Vec3d> ShiftsBeside(const std::vector<Pose>& poses, std::size_t t);

}  // namespace dyxel::internal
