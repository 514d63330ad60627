// Many time steps: proportions and poses in one system, then the skin: docs/method.md (T8, T9).
#pragma once

#include <span>
#include <vector>

#include "dyxel/tracking/pose_solver.h"

namespace dyxel::internal {

// Poses and observations of the time steps that the actor is fitted to.
struct FitFrames {
  std::vector<Observation> observations;
  std::vector<Pose> poses;
  std::vector<double> mismatch;  // at the poses
  [[nodiscard]] double MeanMismatch() const;
};

// The proportions as a vector: height, lengths, girths; and back.
[[nodiscard]] Eigen::VectorXd PackProportions(const Proportions& proportions);
[[nodiscard]] Proportions UnpackProportions(const Eigen::VectorXd& packed, std::size_t kinds);

// Gauss-Newton over the proportions and all poses at once: the poses, which only their own time
// step sees, are eliminated (Schur complement). Derivatives by the proportions are differences of
// bodies made with them. Steps that raise the mean mismatch by 0.002 or more are shortened, then
// dropped. The template's sizes (1) draw with the spreads given in the source.
void FitProportions(const Actor& body_template,
                    Proportions& proportions,
                    FitFrames& frames,
                    int iterations,
                    float scale);

// Moves the rest skin along its normals by smooth displacements so that its rims meet the contours
// of all time steps: least squares over the vertices with the displacements' Laplacian small
// (spread over about `smoothness` metres). `displacement` (V, metres) is kept between calls so that
// the sum stays smooth and below `limit`.
void RefineSkin(Actor& actor,
                const std::vector<Vec3f>& base_positions,
                std::vector<float>& displacement,
                FitFrames& frames,
                float scale,
                double smoothness,
                float limit);

// Poses of all frames solved again with the given actor.
void SolveFrames(const Actor& actor, FitFrames& frames, const SolveSettings& settings);

}  // namespace dyxel::internal
