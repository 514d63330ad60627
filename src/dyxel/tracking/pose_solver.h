// The pose of one time step by rims and contours; docs/method.md (T1)-(T5), A §V-A.
//
// Minimises over the pose's 6 + D unknowns p
//   Σ_matches w (r + g · dx(p))² / σ²  +  Σ_d ((θ_d − θ̂_d) / s)²  +  Σ_d (θ_d / s_0)²
// where a match ties a rim vertex to the observed contour along a direction g, both from the
// model's rims to the picture and from the picture's contour to the rims; matches are renewed every
// step.
#pragma once

#include <span>
#include <vector>

#include "dyxel/body/actor.h"
#include "dyxel/tracking/body_view.h"

namespace dyxel::internal {

// Triangles that poses are solved with: outlines move by a millimetre or two against the full skin.
inline constexpr int kTrackedTriangles = 6000;

// The actor with what is computed from its topology once.
struct TrackedBody {
  Actor actor;
  OutlineTopology topology;
};
// Simplified to about `triangles` (reduced_body.h); 0 keeps them all.
[[nodiscard]] TrackedBody MakeTrackedBody(const Actor& actor, int triangles = kTrackedTriangles);

// The residual r + g · dx (metres) of moving skin vertex `vertex` by dx in the world.
struct Match {
  int vertex;
  Vec3f gradient;
  float residual;  // metres
  float length;    // metres of contour that it stands for
};

// Matches of one view, both ways, none farther than `reach` (metres).
void MatchView(const View& view,
               std::span<const Vec3f> positions,
               std::span<const Rim> rims,
               float reach,
               std::vector<Match>& matches);

// Geman-McClure: 1 at 0, falling beyond `scale`.
[[nodiscard]] inline float RobustWeight(float residual, float scale) {
  const float s = residual / scale;
  const float q = 1 / (1 + s * s);
  return q * q;
}

// Σ Jᵀ W J and Σ Jᵀ W r of the unknowns.
struct NormalEquations {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd gradient;
  double weight = 0;  // Σ w
};

// All that is known at one pose.
struct PoseState {
  std::vector<Vec3f> positions;   // (V)
  std::vector<Overlap> overlaps;  // [views]
  double mismatch = 1;            // mean over the views of XOR / observed area
  [[nodiscard]] double MeanIou() const;
};

// Draws and measures poses of one body in one time step's views; keeps its buffers.
class PoseEvaluator {
 public:
  PoseEvaluator(const Observation& observation, const TrackedBody& body);
  [[nodiscard]] PoseState Evaluate(const Pose& pose);
  // Matches of all views at the pose last evaluated (its positions), [views].
  [[nodiscard]] std::vector<std::vector<Match>> Matches(const PoseState& state, float reach);
  [[nodiscard]] const Observation& observation() const { return *observation_; }
  [[nodiscard]] const TrackedBody& body() const { return *body_; }
  [[nodiscard]] std::vector<BodyView>& views() { return views_; }

 private:
  const Observation* observation_;
  const TrackedBody* body_;
  std::vector<BodyView> views_;
};

// The normal equations of matches at a pose, weights robust with `scale` (metres).
[[nodiscard]] NormalEquations BuildPoseEquations(const Actor& actor,
                                                 const Pose& pose,
                                                 std::span<const std::vector<Match>> matches,
                                                 float scale);

struct SolveSettings {
  int max_iterations = 30;
  float reach = 0.35F;        // metres: farthest match
  float scale_start = 0.12F;  // metres: robust scale of the first step and the last
  float scale_end = 0.025F;
  double angle_sigma = 0.6;    // radians: spread about the prediction
  double neutral_sigma = 2.5;  // radians: spread about the middle posture (zero angles)
  bool root_only = false;
};

struct PoseSolution {
  Pose pose;
  double mismatch = 1;
  double iou = 0;
  int iterations = 0;
};

// From `start`, drawn towards `prediction`'s angles. The pose of the least energy (T5) on the way
// is returned; its mismatch may be a little above that of `start`.
[[nodiscard]] PoseSolution SolvePose(PoseEvaluator& evaluator,
                                     const Pose& start,
                                     const Pose& prediction,
                                     const SolveSettings& settings = {});

}  // namespace dyxel::internal
