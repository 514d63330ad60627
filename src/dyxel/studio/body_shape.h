// The studio's person as signed distances at rest: skin, garments, shoes and hair as separate
// solids. Not the tracker's template: other proportions, other parts, other joints.
//
// Body frame: x forward, y to the person's left, z up, the floor at z = 0; at rest the arms hang
// at 45 degrees from the trunk. Metres.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel::studio {

enum Cover { kSkin, kShirt, kTrousers, kShoes, kHair, kNumCovers };

// Signed distances to the covers, negative inside.
using CoverDistances = std::array<float, kNumCovers>;

enum JointId {
  kPelvis,
  kSpine,
  kChest,
  kNeck,
  kHead,
  kLeftClavicle,
  kLeftUpperArm,
  kLeftForearm,
  kLeftHand,
  kRightClavicle,
  kRightUpperArm,
  kRightForearm,
  kRightHand,
  kLeftThigh,
  kLeftShank,
  kLeftFoot,
  kRightThigh,
  kRightShank,
  kRightFoot,
  kNumJoints
};

struct RestJoint {
  std::string name;
  int parent;      // -1 for the pelvis
  Vec3f position;  // body frame
};

[[nodiscard]] const std::vector<RestJoint>& RestSkeleton();

[[nodiscard]] CoverDistances EvaluateCovers(const Vec3f& x);
// The whole person: the nearest cover, edges rounded by a few millimetres.
[[nodiscard]] float EvaluatePerson(const Vec3f& x);
[[nodiscard]] float EvaluatePerson(const CoverDistances& distances);

// Smooth weights of all joints at a rest position; they sum to 1.
[[nodiscard]] std::array<float, kNumJoints> JointWeights(const Vec3f& x);

}  // namespace dyxel::studio
