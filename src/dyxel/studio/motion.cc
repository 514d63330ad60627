#include "dyxel/studio/motion.h"

#include <algorithm>
#include <cmath>

namespace dyxel::studio {
namespace {

// At rest the arms hang this far from the vertical.
constexpr float kRestRaise = kPi / 4;

// A posture as plain numbers, for interpolation between keys.
constexpr int kNumChannels = 22;
using Channels = std::array<float, kNumChannels>;

Channels ToChannels(const Posture& p) {
  Channels c = {p.yaw, p.jump, p.lean, p.side, p.twist, p.nod, p.look, p.squat};
  for (std::size_t s = 0; s < 2; ++s) {
    const std::size_t at = 8 + 7 * s;
    c[at] = p.arm[s].raise;
    c[at + 1] = p.arm[s].swing;
    c[at + 2] = p.arm[s].elbow;
    c[at + 3] = p.arm[s].turn;
    c[at + 4] = p.leg[s].swing;
    c[at + 5] = p.leg[s].spread;
    c[at + 6] = p.leg[s].knee;
  }
  return c;
}

Posture FromChannels(const Channels& c) {
  Posture p{c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], {}, {}};
  for (std::size_t s = 0; s < 2; ++s) {
    const std::size_t at = 8 + 7 * s;
    p.arm[s] = {c[at], c[at + 1], c[at + 2], c[at + 3]};
    p.leg[s] = {c[at + 4], c[at + 5], c[at + 6]};
  }
  return p;
}

// Keys of the lively motion at equal shares of its time, closed.
std::vector<Posture> LivelyKeys() {
  std::vector<Posture> keys;
  const auto key = [&](Posture p) { keys.push_back(p); };
  // A step out, arms opening.
  key({.yaw = 0.0F,
       .lean = 0.04F,
       .arm = {{{0.70F, 0.10F, 0.35F, 0}, {0.70F, 0.10F, 0.35F, 0}}},
       .leg = {{{0, 0.10F, 0.05F}, {0, 0.10F, 0.05F}}}});
  // Trunk twists left, arms swing with it.
  key({.yaw = 0.15F,
       .lean = 0.06F,
       .twist = 0.45F,
       .look = 0.2F,
       .arm = {{{0.95F, -0.35F, 0.55F, 0}, {0.85F, 0.75F, 0.75F, 0}}},
       .leg = {{{-0.05F, 0.12F, 0.10F}, {0.08F, 0.12F, 0.12F}}}});
  // And right.
  key({.yaw = 0.05F,
       .lean = 0.08F,
       .side = -0.10F,
       .twist = -0.45F,
       .look = -0.2F,
       .squat = 0.15F,
       .arm = {{{0.85F, 0.80F, 0.70F, 0}, {1.00F, -0.30F, 0.50F, 0}}},
       .leg = {{{0.08F, 0.12F, 0.12F}, {-0.05F, 0.12F, 0.10F}}}});
  // Down into a squat, arms in front.
  key({.yaw = -0.05F,
       .lean = 0.32F,
       .nod = -0.15F,
       .squat = 0.85F,
       .arm = {{{0.45F, 0.75F, 0.65F, 0}, {0.45F, 0.75F, 0.65F, 0}}},
       .leg = {{{0, 0.16F, 0}, {0, 0.16F, 0}}}});
  // A jump, arms thrown up.
  key({.yaw = -0.10F,
       .jump = 0.16F,
       .lean = -0.05F,
       .nod = -0.10F,
       .squat = 0.08F,
       .arm = {{{2.10F, 0.15F, 0.35F, 0}, {2.20F, 0.15F, 0.30F, 0}}},
       .leg = {{{0.05F, 0.20F, 0.15F}, {-0.10F, 0.20F, 0.35F}}}});
  // Landing.
  key({.yaw = -0.05F,
       .lean = 0.18F,
       .squat = 0.50F,
       .arm = {{{1.30F, 0.20F, 0.45F, 0}, {1.25F, 0.25F, 0.45F, 0}}},
       .leg = {{{0, 0.14F, 0}, {0, 0.14F, 0}}}});
  // Bending sideways, one arm up.
  key({.yaw = 0.0F,
       .side = 0.28F,
       .twist = 0.10F,
       .look = 0.15F,
       .squat = 0.12F,
       .arm = {{{0.55F, 0.05F, 0.60F, 0}, {2.00F, 0.10F, 0.45F, 0}}},
       .leg = {{{0, 0.14F, 0.05F}, {0.05F, 0.10F, 0.15F}}}});
  return keys;
}

Quatf About(const Vec3f& axis, float angle) { return Quatf(Eigen::AngleAxisf(angle, axis)); }

}  // namespace

Posture PostureAt(MotionKind kind, double share, double duration, int variant) {
  const double phase = 1.7 * variant;
  if (kind == MotionKind::kTurn) {
    const double turn = 2 * kPiD * share;
    const auto sway = [&](double size, double per_turn, double offset) {
      return static_cast<float>(size * std::sin(per_turn * turn + offset + phase));
    };
    Posture p;
    p.yaw = static_cast<float>(turn + 0.6 * variant);
    p.lean = 0.02F + sway(0.015, 3, 0.4);
    p.side = sway(0.018, 2, 1.1);
    p.twist = sway(0.02, 2, 2.0);
    p.nod = sway(0.03, 3, 0.2);
    p.arm[0] = {0.88F + sway(0.03, 2, 0.0), 0.06F + sway(0.03, 3, 1.0), 0.30F, 0};
    p.arm[1] = {0.88F + sway(0.03, 2, 2.5), 0.06F + sway(0.03, 3, 0.3), 0.30F, 0};
    p.leg[0] = {0, 0.10F, 0.03F};
    p.leg[1] = {0, 0.10F, 0.03F};
    return p;
  }
  static const std::vector<Posture> keys = LivelyKeys();
  // One pass of the keys takes 2.1 s; shorter sequences show its beginning.
  const int n = static_cast<int>(keys.size());
  const double at = share * duration / 0.3 + 0.4 * variant;
  const int first = static_cast<int>(std::floor(at));
  const float t = static_cast<float>(at - first);
  const auto channels = [&](int i) {
    return ToChannels(keys[static_cast<std::size_t>(((i % n) + n) % n)]);
  };
  const Channels a = channels(first - 1);
  const Channels b = channels(first);
  const Channels c = channels(first + 1);
  const Channels d = channels(first + 2);
  Channels result;
  for (std::size_t i = 0; i < kNumChannels; ++i) {
    // Catmull-Rom with the tangents halved: it overshoots less.
    const float mb = 0.35F * (c[i] - a[i]);
    const float mc = 0.35F * (d[i] - b[i]);
    const float t2 = t * t;
    const float t3 = t2 * t;
    result[i] = (2 * t3 - 3 * t2 + 1) * b[i] + (t3 - 2 * t2 + t) * mb + (3 * t2 - 2 * t3) * c[i] +
                (t3 - t2) * mc;
  }
  result[1] = std::max(result[1], 0.0F);
  return FromChannels(result);
}

std::array<JointMotion, kNumJoints> MoveJoints(const Posture& posture) {
  const std::vector<RestJoint>& rest = RestSkeleton();
  const Vec3f x = Vec3f::UnitX();
  const Vec3f y = Vec3f::UnitY();
  const Vec3f z = Vec3f::UnitZ();
  std::array<Quatf, kNumJoints> local;
  local.fill(Quatf::Identity());

  const float bend = 0.5F * posture.squat;
  local[kPelvis] = About(z, posture.yaw) * About(y, 0.35F * bend);
  local[kSpine] = About(y, 0.5F * posture.lean) * About(x, -0.5F * posture.side) *
                  About(z, 0.45F * posture.twist);
  local[kChest] = About(y, 0.5F * posture.lean) * About(x, -0.5F * posture.side) *
                  About(z, 0.55F * posture.twist);
  local[kNeck] = About(z, 0.4F * posture.look) * About(y, 0.4F * posture.nod);
  local[kHead] = About(z, 0.6F * posture.look) * About(y, 0.6F * posture.nod);
  for (int side = 0; side < 2; ++side) {
    const float mirror = side == 0 ? 1.0F : -1.0F;
    const Posture::Arm& arm = posture.arm[static_cast<std::size_t>(side)];
    const Posture::Leg& leg = posture.leg[static_cast<std::size_t>(side)];
    const int clavicle = side == 0 ? kLeftClavicle : kRightClavicle;
    const int thigh = side == 0 ? kLeftThigh : kRightThigh;
    const auto at = [&](int joint) { return static_cast<std::size_t>(joint); };
    // The shoulder girdle takes a third of what lies above the horizontal.
    const float lift = 0.30F * std::max(arm.raise - 1.0F, 0.0F);
    local[at(clavicle)] = About(x, mirror * lift);
    const Vec3f along =
        (rest[at(clavicle + 2)].position - rest[at(clavicle + 1)].position).normalized();
    local[at(clavicle + 1)] = About(y, -arm.swing) *
                              About(x, mirror * (arm.raise - lift - kRestRaise)) *
                              About(along, mirror * arm.turn);
    // The elbow folds the forearm forward.
    local[at(clavicle + 2)] = About(along.cross(x).normalized(), arm.elbow);
    local[at(thigh)] =
        About(x, mirror * leg.spread) * About(y, -(leg.swing + 0.95F * posture.squat));
    local[at(thigh + 1)] = About(y, leg.knee + 1.75F * posture.squat);
    local[at(thigh + 2)] = About(y, leg.swing - leg.knee - 0.80F * posture.squat - 0.35F * bend) *
                           About(x, -mirror * leg.spread);
  }

  std::array<JointMotion, kNumJoints> motion;
  for (std::size_t j = 0; j < kNumJoints; ++j) {
    const Vec3f& at = rest[j].position;
    if (rest[j].parent < 0) {
      motion[j].rotation = local[j];
      motion[j].translation = Vec3f(0, 0, at.z()) - local[j] * at;
    } else {
      const JointMotion& parent = motion[static_cast<std::size_t>(rest[j].parent)];
      motion[j].rotation = (parent.rotation * local[j]).normalized();
      motion[j].translation = parent * at - motion[j].rotation * at;
    }
  }
  // The soles: heel and toe of both feet.
  float lowest = 1e9F;
  for (const std::size_t foot : {std::size_t{kLeftFoot}, std::size_t{kRightFoot}}) {
    const float mirror = foot == kLeftFoot ? 1.0F : -1.0F;
    for (const float forward : {-0.08F, 0.13F}) {
      lowest = std::min(lowest, (motion[foot] * Vec3f(forward, mirror * 0.135F, 0)).z());
    }
  }
  for (JointMotion& m : motion) m.translation.z() += posture.jump - lowest;
  return motion;
}

}  // namespace dyxel::studio
