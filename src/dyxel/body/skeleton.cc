#include "dyxel/body/skeleton.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace dyxel {
namespace {

Mat3d HingeRotation(const Dof& dof, double angle) {
  return Eigen::AngleAxisd(angle, dof.axis).toRotationMatrix();
}

// The rigid motion of a node before its shift: the followed joints' rotations blended as
// quaternions, the place as skinning blends it; docs/method.md (G1).
Rigid Blend(const Joint& node,
            const std::vector<Rigid>& world_from_joint,
            const std::vector<Vec3d>& rest,
            const Vec3d& place) {
  Eigen::Vector4d turn = Eigen::Vector4d::Zero();
  Rigid frame{Mat3d::Identity(), Vec3d::Zero()};
  for (const JointShare& share : node.follows) {
    const auto j = static_cast<std::size_t>(share.joint);
    const Eigen::Vector4d q = Quatd(world_from_joint[j].rotation).coeffs();
    turn += (turn.dot(q) < 0 ? -share.weight : share.weight) * q;
    frame.translation += share.weight * (world_from_joint[j] * Vec3d(place - rest[j]));
  }
  frame.rotation = Quatd(turn).normalized().toRotationMatrix();
  return frame;
}

}  // namespace

int Skeleton::NumDofs() const {
  std::size_t count = 0;
  for (const Joint& joint : joints) count += joint.dofs.size();
  return static_cast<int>(count);
}

int Skeleton::NumNodes() const {
  return static_cast<int>(
      std::count_if(joints.begin(), joints.end(), [](const Joint& j) { return j.IsNode(); }));
}

std::vector<int> Skeleton::FirstDof() const {
  std::vector<int> first;
  first.reserve(joints.size());
  int next = 0;
  for (const Joint& joint : joints) {
    first.push_back(next);
    next += static_cast<int>(joint.dofs.size());
  }
  return first;
}

std::vector<Vec3d> Skeleton::RestPositions() const {
  std::vector<Vec3d> positions;
  positions.reserve(joints.size());
  for (const Joint& joint : joints) {
    const Vec3d base =
        joint.parent < 0 ? Vec3d::Zero() : positions[static_cast<std::size_t>(joint.parent)];
    positions.push_back(base + joint.offset);
  }
  return positions;
}

std::vector<Rigid> Skeleton::Forward(const Pose& pose) const {
  assert(static_cast<int>(pose.angles.size()) == NumDofs());
  std::vector<Rigid> world_from_joint;
  world_from_joint.reserve(joints.size());
  const std::vector<Vec3d> rest = RestPositions();
  std::size_t dof = 0;
  std::size_t node = 0;
  for (const Joint& joint : joints) {
    Rigid frame;
    if (joint.IsNode()) {
      frame = Blend(joint, world_from_joint, rest, rest[world_from_joint.size()]);
      if (!pose.shifts.empty()) frame.translation += frame.rotation * pose.shifts[node++];
    } else if (joint.parent < 0) {
      frame = {pose.root_rotation.normalized().toRotationMatrix(), pose.root_translation};
    } else {
      const Rigid& parent = world_from_joint[static_cast<std::size_t>(joint.parent)];
      frame = {parent.rotation, parent * joint.offset};
    }
    for (const Dof& hinge : joint.dofs) {
      frame.rotation = frame.rotation * HingeRotation(hinge, pose.angles[dof++]);
    }
    world_from_joint.push_back(frame);
  }
  return world_from_joint;
}

Pose Skeleton::RestPose() const {
  Pose pose;
  if (!joints.empty()) pose.root_translation = joints[0].offset;
  pose.angles.assign(static_cast<std::size_t>(NumDofs()), 0.0);
  return pose;
}

int Skeleton::FindJoint(const std::string& name) const {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (joints[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

std::vector<Rigid> SkinTransforms(const Skeleton& skeleton, const Pose& pose) {
  std::vector<Rigid> transforms = skeleton.Forward(pose);
  const std::vector<Vec3d> rest = skeleton.RestPositions();
  for (std::size_t j = 0; j < transforms.size(); ++j) {
    transforms[j].translation -= transforms[j].rotation * rest[j];
  }
  return transforms;
}

PoseDerivatives ComputePoseDerivatives(const Skeleton& skeleton, const Pose& pose) {
  PoseDerivatives result;
  result.world_from_joint = skeleton.Forward(pose);
  result.world_from_rest = result.world_from_joint;
  const std::vector<Vec3d> rest = skeleton.RestPositions();
  const std::size_t num_joints = skeleton.joints.size();
  result.chains.resize(num_joints);
  int dof = 0;
  for (std::size_t j = 0; j < num_joints; ++j) {
    const Joint& joint = skeleton.joints[j];
    Rigid& skin = result.world_from_rest[j];
    skin.translation -= skin.rotation * rest[j];
    const Rigid& frame = result.world_from_joint[j];
    Mat3d rotation = pose.root_rotation.normalized().toRotationMatrix();
    if (joint.parent >= 0) {
      const auto parent = static_cast<std::size_t>(joint.parent);
      rotation = result.world_from_joint[parent].rotation;
      result.chains[j] = result.chains[parent];
    }
    for (const Dof& hinge : joint.dofs) {
      result.axes.push_back(rotation * hinge.axis);
      result.origins.push_back(frame.translation);
      result.chains[j].push_back(dof);
      rotation = rotation * HingeRotation(hinge, pose.angles[static_cast<std::size_t>(dof)]);
      ++dof;
    }
  }
  return result;
}

void JointPointJacobian(const PoseDerivatives& derivatives,
                        int joint,
                        const Vec3d& x,
                        PointJacobian& jacobian) {
  jacobian.setZero(3, derivatives.NumUnknowns());
  jacobian.leftCols<3>().setIdentity();
  const Vec3d arm = x - derivatives.world_from_joint[0].translation;
  for (int i = 0; i < 3; ++i) jacobian.col(3 + i) = Vec3d::Unit(i).cross(arm);
  for (const int dof : derivatives.chains[static_cast<std::size_t>(joint)]) {
    const auto d = static_cast<std::size_t>(dof);
    jacobian.col(6 + dof) = derivatives.axes[d].cross(x - derivatives.origins[d]);
  }
}

Pose MovePose(const Pose& pose, std::span<const double> step) {
  assert(step.size() == 6 + pose.angles.size());
  Pose moved = pose;
  moved.root_translation += Vec3d(step[0], step[1], step[2]);
  const Vec3d turn(step[3], step[4], step[5]);
  if (const double angle = turn.norm(); angle > 0) {
    moved.root_rotation = Quatd(Eigen::AngleAxisd(angle, turn / angle)) * pose.root_rotation;
    moved.root_rotation.normalize();
  }
  for (std::size_t d = 0; d < moved.angles.size(); ++d) moved.angles[d] += step[6 + d];
  return moved;
}

Pose InterpolatePoses(const Pose& a, const Pose& b, double share) {
  Pose p = a;
  p.root_translation += share * (b.root_translation - a.root_translation);
  const Eigen::AngleAxisd turn(b.root_rotation * a.root_rotation.conjugate());
  p.root_rotation = Quatd(Eigen::AngleAxisd(share * turn.angle(), turn.axis())) * a.root_rotation;
  p.root_rotation.normalize();
  for (std::size_t d = 0; d < p.angles.size(); ++d) {
    p.angles[d] += share * (b.angles[d] - a.angles[d]);
  }
  const std::size_t nodes = std::max(a.shifts.size(), b.shifts.size());
  p.shifts.resize(nodes, Vec3d::Zero());
  for (std::size_t k = 0; k < nodes; ++k) {
    const Vec3d end = b.shifts.empty() ? Vec3d(Vec3d::Zero()) : b.shifts[k];
    p.shifts[k] += share * (end - p.shifts[k]);
  }
  return p;
}

Pose ClampToLimits(const Skeleton& skeleton, const Pose& pose) {
  Pose limited = pose;
  std::size_t dof = 0;
  for (const Joint& joint : skeleton.joints) {
    for (const Dof& hinge : joint.dofs) {
      limited.angles[dof] = std::clamp(limited.angles[dof], hinge.min, hinge.max);
      ++dof;
    }
  }
  return limited;
}

}  // namespace dyxel
