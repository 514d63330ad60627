// Smooth skinning weights from hard labels; docs/method.md (B4).
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dyxel/mesh/triangle_mesh.h"

namespace dyxel {

struct SkinWeights {
  std::vector<std::array<int, 4>> joints;     // (V)
  std::vector<std::array<float, 4>> weights;  // (V) descending, sum 1
};

struct SkinWeightProblem {
  std::span<const int> labels;           // (V) the joint that each vertex lies with
  std::span<const float> blend;          // (V) metres: standard deviation of the transition there
  std::span<const int> mirror_vertices;  // (V) the vertex of the other side
  std::span<const int> mirror_joints;    // (J), J ≤ 16
};

// Heat that starts as the indicator of each label and spreads over the mesh's edges (random walk;
// every step keeps weights in [0, 1] with sum 1), made symmetric, then the four largest.
[[nodiscard]] SkinWeights DiffuseLabels(const TriangleMesh& mesh, const SkinWeightProblem& problem);

}  // namespace dyxel
