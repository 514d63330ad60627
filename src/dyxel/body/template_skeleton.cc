#include <cmath>
#include <string>

#include "dyxel/body/template_parts.h"

namespace dyxel {
namespace {

constexpr double kStature = 1.75;
constexpr double kUpperArm = 0.186 * kStature;
constexpr double kLowerArm = 0.146 * kStature;
constexpr double kThigh = 0.245 * kStature;
constexpr double kShank = 0.246 * kStature;
constexpr double kAnkleHeight = 0.043 * kStature;  // with a sole
constexpr double kHipHalfWidth = 0.088;

double Radians(double degrees) { return degrees * kPiD / 180; }

Dof Hinge(const std::string& name, const Vec3d& axis, double min_deg, double max_deg) {
  return {name, axis.normalized(), Radians(min_deg), Radians(max_deg)};
}

// `side` is +1 for the left and −1 for the right. A rotation about `left_axis` mirrored in the
// plane y = 0 turns about the axis (−x, y, −z) for the same angle.
Vec3d Axis(const Vec3d& left_axis, double side) {
  return side > 0 ? left_axis : Vec3d(-left_axis[0], left_axis[1], -left_axis[2]);
}

Vec3d Side(const Vec3d& left, double side) { return {left[0], side * left[1], left[2]}; }

// Three hinges of which the last turns about the bone lock where the bone lies along the first.
// The first is therefore level and points backwards-outwards, where no arm goes; raising the arm,
// sideways or forwards, turns about it.
std::vector<Dof> ShoulderDofs(const std::string& prefix, double side) {
  const Vec3d bone = BoneDirection(kLeftUpperArm);
  const Vec3d pole = Vec3d(-0.84, 0.7, 0).normalized();
  const Vec3d swing = pole.cross(bone).normalized();
  return {Hinge(prefix + "shoulder_elevation", Axis(-pole, side), -85, 155),
          Hinge(prefix + "shoulder_swing", Axis(swing, side), -50, 95),
          Hinge(prefix + "shoulder_twist", Axis(bone, side), -90, 90)};
}

void AddArm(const std::string& prefix, double side, Skeleton& skeleton) {
  const Vec3d bone = BoneDirection(kLeftUpperArm);
  const Vec3d forward = Vec3d::UnitX();
  const Vec3d palm = bone.cross(forward);  // the palm faces inwards-down, the thumb forward
  const int shoulder = static_cast<int>(skeleton.joints.size());
  skeleton.joints.push_back({prefix + "upper_arm",
                             kChest,
                             Side(Vec3d(0.005, 0.178, 0.215), side),
                             ShoulderDofs(prefix, side)});
  skeleton.joints.push_back(
      {prefix + "lower_arm",
       shoulder,
       Side(kUpperArm * bone, side),
       {Hinge(prefix + "elbow_flexion", Axis(bone.cross(forward), side), -5, 150),
        Hinge(prefix + "forearm_pronation", Axis(bone, side), -85, 85)}});
  skeleton.joints.push_back(
      {prefix + "hand",
       shoulder + 1,
       Side(kLowerArm * bone, side),
       {Hinge(prefix + "wrist_flexion", Axis(bone.cross(palm), side), -70, 80),
        Hinge(prefix + "wrist_deviation", Axis(bone.cross(forward), side), -35, 20)}});
}

void AddLeg(const std::string& prefix, double side, Skeleton& skeleton) {
  const Vec3d bone = BoneDirection(kLeftThigh);
  const Vec3d left = Vec3d::UnitY();
  const int hip = static_cast<int>(skeleton.joints.size());
  skeleton.joints.push_back({prefix + "thigh",
                             kPelvis,
                             Side(Vec3d(0.005, kHipHalfWidth, -0.025), side),
                             {Hinge(prefix + "hip_flexion", -left, -30, 125),
                              Hinge(prefix + "hip_abduction", Axis(Vec3d::UnitX(), side), -35, 55),
                              Hinge(prefix + "hip_twist", Axis(bone, side), -45, 45)}});
  const Vec3d knee_axis = (left - bone * bone.dot(left)).normalized();
  skeleton.joints.push_back({prefix + "shank",
                             hip,
                             Side(kThigh * bone, side),
                             {Hinge(prefix + "knee_flexion", Axis(knee_axis, side), -3, 145)}});
  const Vec3d toes = BoneDirection(kLeftFoot);
  skeleton.joints.push_back(
      {prefix + "foot",
       hip + 1,
       Side(kShank * bone, side),
       {Hinge(prefix + "ankle_flexion", Axis(toes.cross(Vec3d::UnitZ()), side), -50, 25),
        Hinge(prefix + "ankle_inversion", Axis(toes, side), -20, 35)}});
}

}  // namespace

int MirrorSegment(int segment) {
  if (segment >= kLeftUpperArm && segment <= kLeftHand) return segment + 3;
  if (segment >= kRightUpperArm && segment <= kRightHand) return segment - 3;
  if (segment >= kLeftThigh && segment <= kLeftFoot) return segment + 3;
  if (segment >= kRightThigh) return segment - 3;
  return segment;
}

Vec3d BoneDirection(int segment) {
  Vec3d left = Vec3d::UnitZ();
  switch (segment) {
    case kLeftUpperArm:
    case kLeftLowerArm:
    case kLeftHand:
    case kRightUpperArm:
    case kRightLowerArm:
    case kRightHand:
      left = Vec3d(0, 0.84, -1).normalized();  // 40° from the body
      break;
    case kLeftThigh:
    case kLeftShank:
    case kRightThigh:
    case kRightShank:
      left = Vec3d(0, 0.105, -1).normalized();
      break;
    case kLeftFoot:
    case kRightFoot:
      left = Vec3d(1, 0.0875, 0).normalized();  // toes 5° outwards
      break;
    default:
      return left;
  }
  return Side(left, MirrorSegment(segment) < segment ? -1 : 1);
}

Skeleton TemplateSkeleton() {
  Skeleton skeleton;
  // Positive: bending forward, to the left, turning to the left.
  auto trunk = [](const std::string& name, Vec3d flexion, Vec3d lateral, Vec3d twist) {
    return std::vector<Dof>{Hinge(name + "_flexion", Vec3d::UnitY(), flexion[0], flexion[1]),
                            Hinge(name + "_lateral", -Vec3d::UnitX(), lateral[0], lateral[1]),
                            Hinge(name + "_twist", Vec3d::UnitZ(), twist[0], twist[1])};
  };
  const double hip_height = kAnkleHeight - (kThigh + kShank) * BoneDirection(kLeftThigh)[2];
  skeleton.joints.push_back({"pelvis", -1, {0, 0, hip_height + 0.025}, {}});
  skeleton.joints.push_back({"abdomen",
                             kPelvis,
                             {-0.02, 0, 0.095},
                             trunk("abdomen", {-20, 50, 0}, {-25, 25, 0}, {-20, 20, 0})});
  skeleton.joints.push_back({"chest",
                             kAbdomen,
                             {-0.01, 0, 0.145},
                             trunk("chest", {-20, 40, 0}, {-25, 25, 0}, {-35, 35, 0})});
  skeleton.joints.push_back(
      {"head", kChest, {0.0, 0, 0.285}, trunk("head", {-60, 55, 0}, {-45, 45, 0}, {-80, 80, 0})});
  AddArm("l_", 1, skeleton);
  AddArm("r_", -1, skeleton);
  AddLeg("l_", 1, skeleton);
  AddLeg("r_", -1, skeleton);
  return skeleton;
}

}  // namespace dyxel
