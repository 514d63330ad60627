// The actor: a closed single skin on a skeleton; and skinning: docs/method.md (B3, B5).
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "dyxel/body/skeleton.h"
#include "dyxel/mesh/triangle_mesh.h"

namespace dyxel {

// Linear blend skinning with at most four influences a vertex (what every glTF viewer plays).
struct Actor {
  Skeleton skeleton;
  TriangleMesh skin;                                // rest pose, body frame; closed, one component
  std::vector<std::array<int, 4>> joint_indices;    // (V)
  std::vector<std::array<float, 4>> joint_weights;  // (V) descending, sum 1
};

// Skin positions in the world (V).
[[nodiscard]] std::vector<Vec3f> SkinPositions(const Actor& actor, const Pose& pose);
// The same into `out` (V), without allocating more than the joints' transforms.
void SkinPositions(const Actor& actor, const Pose& pose, std::span<Vec3f> out);

// World position of one skin vertex and its 3 × (6 + D) derivative by the pose (skeleton.h says
// the order), written to `jacobian` (resized).
Vec3d SkinVertexJacobian(const Actor& actor,
                         const PoseDerivatives& derivatives,
                         int vertex,
                         PointJacobian& jacobian);

// Sizes of a body relative to the template's, symmetric left and right.
struct Proportions {
  double height = 1;  // scales everything
  std::vector<double>
      lengths;  // per kind of segment (see SegmentKinds()), along the bone; 1 = template
  std::vector<double> girths;  // per kind of segment, across the bone
};

// The kinds of segments whose proportions vary: "pelvis", "abdomen", "chest", "head", "upper_arm",
// "lower_arm", "hand", "thigh", "shank", "foot".
[[nodiscard]] std::span<const std::string_view> SegmentKinds();

// The built-in template (docs/method.md B): one signed-distance part per segment, blended and
// meshed isotropically, with smooth weights; made by code, the same on every machine.
[[nodiscard]] Actor MakeBuiltInTemplate();

// The template with other proportions: same topology and weights, joints and skin moved.
// Throws Error(kUsage) where the sizes of `proportions` don't fit.
[[nodiscard]] Actor ApplyProportions(const Actor& body_template, const Proportions& proportions);
[[nodiscard]] Proportions TemplateProportions();

}  // namespace dyxel
