// The studio's motion: postures by name, keyframed procedurally, and the joints that follow.
#pragma once

#include <array>
#include <vector>

#include "dyxel/math/types.h"
#include "dyxel/studio/body_shape.h"

namespace dyxel::studio {

enum class MotionKind {
  kTurn,   // a fixed posture turns once, counter-clockwise from above, with a small sway
  kLively  // arm swings, a squat, a small jump, a twist of the trunk
};

// What the body does, in radians from standing with the arms hanging; metres for the jump.
struct Posture {
  float yaw = 0;    // of the whole body about up
  float jump = 0;   // height of the feet above the floor
  float lean = 0;   // trunk forward
  float side = 0;   // trunk towards its left
  float twist = 0;  // trunk about its axis, towards its left
  float nod = 0;    // head forward
  float look = 0;   // head towards its left
  float squat = 0;  // hips and knees bend, feet stay below
  struct Arm {
    float raise = 0;  // sideways, from hanging
    float swing = 0;  // forward
    float elbow = 0;
    float turn = 0;  // about its own axis
  };
  struct Leg {
    float swing = 0;   // forward
    float spread = 0;  // outward
    float knee = 0;
  };
  std::array<Arm, 2> arm;  // left, right
  std::array<Leg, 2> leg;
};

// The posture at a share [0, 1) of a sequence of `duration` seconds. `variant` shifts the sway and
// the start of a turn, so that two turns differ.
[[nodiscard]] Posture PostureAt(MotionKind kind, double share, double duration, int variant);

// A rotation and a translation that carries rest points into the posture.
struct JointMotion {
  Quatf rotation = Quatf::Identity();
  Vec3f translation = Vec3f::Zero();
  [[nodiscard]] Vec3f operator*(const Vec3f& x) const { return rotation * x + translation; }
};

// Joint by joint, world from rest. The lowest of both soles stands `jump` above the floor.
[[nodiscard]] std::array<JointMotion, kNumJoints> MoveJoints(const Posture& posture);

}  // namespace dyxel::studio
