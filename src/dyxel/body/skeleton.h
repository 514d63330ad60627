// The kinematic chain: joints with limited degrees of freedom, and poses; docs/method.md (B2, B5).
//
// Body frame: x forward, y to the body's left, z up; the rest pose stands upright with the arms
// held away from the body, the origin on the floor under the pelvis. At rest every joint frame is
// the body frame moved to the joint.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "dyxel/math/rigid.h"

namespace dyxel {

// One hinge. A joint's rotation is the product of its hinges' in their order, the first outermost.
struct Dof {
  std::string name;  // "l_knee_flexion"
  Vec3d axis;        // unit, joint frame
  double min = 0;    // radians
  double max = 0;
};

// A part of a joint's motion.
struct JointShare {
  int joint = 0;
  double weight = 0;
};

struct Joint {
  std::string name;  // segment that it moves: "pelvis", "l_upper_arm", …
  int parent = -1;   // -1 for the root (joint 0); parents come before children
  Vec3d offset;      // from the parent's joint to this one at rest, metres; root: rest position
  std::vector<Dof> dofs;  // none for the root, which is free
  // A node of the deformation graph (nodes.h) has no hinges: it follows the blend of these earlier
  // joints (weights sum to 1) and is moved on by Pose::shifts. Empty for a bone.
  std::vector<JointShare> follows;

  [[nodiscard]] bool IsNode() const { return !follows.empty(); }
};

// Shifts are whole multiples of this (metres) where they are stored.
inline constexpr double kShiftUnit = 1e-5;

struct Pose {
  Vec3d root_translation = Vec3d::Zero();   // world position of the root joint
  Quatd root_rotation = Quatd::Identity();  // world_from_body
  std::vector<double> angles;               // (D) radians, all joints' dofs in order
  // (N) metres, in the node's frame, of all nodes in order; or empty, none is shifted.
  std::vector<Vec3d> shifts;
};

struct Skeleton {
  std::vector<Joint> joints;

  [[nodiscard]] int NumDofs() const;
  [[nodiscard]] int NumNodes() const;
  // Index of the first dof of each joint (J).
  [[nodiscard]] std::vector<int> FirstDof() const;
  // Rest position of each joint in the body frame (J).
  [[nodiscard]] std::vector<Vec3d> RestPositions() const;
  // world_from_joint (J). The root joint sits at root_translation in the world, turned by
  // root_rotation: so that a pose with root_translation = joints[0].offset is the rest pose.
  [[nodiscard]] std::vector<Rigid> Forward(const Pose& pose) const;
  [[nodiscard]] Pose RestPose() const;
  [[nodiscard]] int FindJoint(const std::string& name) const;  // -1 where there is none
};

// What the derivatives of world positions by the pose's unknowns need, at one pose. The unknowns,
// in the order used by MovePose() and every Jacobian: root translation (3, world), root rotation
// (3, an increment multiplied from the left in the world, about the root joint), angles (D).
//
// A point x that moves with joint j has dx/d(translation) = I, dx/d(rotation) e_i = e_i × (x −
// root), and dx/d(angle d) = axes[d] × (x − origins[d]) for every d in chains[j], 0 for others.
struct PoseDerivatives {
  std::vector<Rigid> world_from_joint;   // (J)
  std::vector<Rigid> world_from_rest;    // (J) moves rest positions: the skinning transforms
  std::vector<Vec3d> axes;               // (D) unit, world
  std::vector<Vec3d> origins;            // (D) world
  std::vector<std::vector<int>> chains;  // (J) dofs that move the joint's points, ascending

  [[nodiscard]] int NumUnknowns() const { return 6 + static_cast<int>(axes.size()); }
};

// For skeletons of bones: a node is taken to move with its parent.
[[nodiscard]] PoseDerivatives ComputePoseDerivatives(const Skeleton& skeleton, const Pose& pose);

// 3 × (6 + D) columns of the derivative of world point `x` that moves with `joint`, written to
// `jacobian` (resized).
using PointJacobian = Eigen::Matrix<double, 3, Eigen::Dynamic>;
void JointPointJacobian(const PoseDerivatives& derivatives,
                        int joint,
                        const Vec3d& x,
                        PointJacobian& jacobian);

// world_from_rest of every joint (J): what skinning blends.
[[nodiscard]] std::vector<Rigid> SkinTransforms(const Skeleton& skeleton, const Pose& pose);

// The pose after a step of the 6 + D unknowns (order above); angles are not limited.
[[nodiscard]] Pose MovePose(const Pose& pose, std::span<const double> step);

// The pose `share` of the way from a (0) to b (1): rotations by slerp, the rest linearly; beyond 1
// it goes on at the same speed.
[[nodiscard]] Pose InterpolatePoses(const Pose& a, const Pose& b, double share);

// Angles clamped to the dofs' limits.
[[nodiscard]] Pose ClampToLimits(const Skeleton& skeleton, const Pose& pose);

// A pose and its confidence for every frame of a sequence.
struct Motion {
  std::vector<Pose> poses;         // [frames]
  std::vector<double> confidence;  // [frames] in [0, 1]: how well the silhouettes agree
};

}  // namespace dyxel
