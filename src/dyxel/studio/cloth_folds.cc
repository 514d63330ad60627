#include "dyxel/studio/cloth_folds.h"

#include <algorithm>
#include <cmath>

#include "dyxel/studio/noise.h"

namespace dyxel::studio {
namespace {

// A train of folds: round ridges, narrow valleys; in [-1, 1].
float Train(float phase) {
  const float s = std::sin(0.5F * phase);
  return 2 * std::sqrt(s * s + 0.02F) - 1.0F;
}

// Folds heaped on the inner side of a bent joint.
struct Bend {
  Vec3f joint, along;  // at rest; unit, towards the limb's end
  Vec3f inner;         // the side that is compressed
  float reach;         // Gaussian's width along the limb
  float wave;          // between two folds
};

float BendFolds(const Bend& bend, const Vec3f& p, float amount, float seed) {
  if (amount <= 0.02F) return 0;
  const Vec3f q = p - bend.joint;
  const float s = q.dot(bend.along);
  const float gauss = std::exp(-s * s / (bend.reach * bend.reach));
  if (gauss < 0.01F) return 0;
  const Vec3f radial = (q - s * bend.along);
  const float radius = std::max(radial.norm(), 1e-4F);
  const float inner = radial.dot(bend.inner) / radius;
  const float side = radial.dot(bend.along.cross(bend.inner)) / radius;
  const float cover = std::pow(std::max(0.5F + 0.5F * inner, 0.0F), 1.5F) + 0.06F;
  const float phase = 2 * kPi * s / bend.wave + 1.5F * side + 1.1F * side * inner +
                      1.6F * Noise(p * 14 + Vec3f::Constant(seed)) + 1.8F * amount + seed;
  return amount * gauss * cover * Train(phase);
}

float Amount(float bend, float from, float to) { return SmoothStep(from, to, bend); }

float ShirtFolds(const Vec3f& p, const Posture& posture) {
  const auto& rest = RestSkeleton();
  float height = 0;
  for (int side = 0; side < 2; ++side) {
    const float mirror = side == 0 ? 1.0F : -1.0F;
    if (mirror * p.y() < 0.02F) continue;
    const Posture::Arm& arm = posture.arm[static_cast<std::size_t>(side)];
    const auto upper = static_cast<std::size_t>(side == 0 ? kLeftUpperArm : kRightUpperArm);
    const Vec3f shoulder = rest[upper].position;
    const Vec3f elbow = rest[upper + 1].position;
    const Vec3f along = (elbow - shoulder).normalized();
    const Vec3f up = along.cross(Vec3f::UnitX()).normalized() * -mirror;
    const float seed = 3.1F * static_cast<float>(side);
    height += 0.0075F * BendFolds({elbow, along, Vec3f::UnitX(), 0.075F, 0.036F},
                                  p,
                                  0.25F + 0.75F * Amount(arm.elbow, 0.2F, 1.1F),
                                  seed);
    const Vec3f up_inner = up.z() > 0 ? up : Vec3f(-up);
    height += 0.0070F * BendFolds({shoulder, along, up_inner, 0.085F, 0.045F},
                                  p,
                                  Amount(arm.raise, 1.0F, 2.0F),
                                  seed + 1);
    height += 0.0070F * BendFolds({shoulder + 0.02F * along, along, -up_inner, 0.085F, 0.040F},
                                  p,
                                  Amount(1.1F - arm.raise, 0.0F, 0.8F),
                                  seed + 2);
  }
  const float angle = std::atan2(p.y(), p.x());
  const bool trunk = std::abs(p.y()) < 0.21F;
  if (trunk) {
    const float bend = posture.lean + 0.35F * posture.squat;
    height += 0.0080F * BendFolds({{0, 0, 1.03F}, Vec3f::UnitZ(), Vec3f::UnitX(), 0.10F, 0.050F},
                                  p,
                                  0.15F + 0.85F * Amount(bend, 0.05F, 0.45F),
                                  5);
    const float side = posture.side < 0 ? -1.0F : 1.0F;
    height +=
        0.0085F * BendFolds({{0, 0, 1.04F}, Vec3f::UnitZ(), side * Vec3f::UnitY(), 0.10F, 0.045F},
                            p,
                            Amount(std::abs(posture.side), 0.03F, 0.30F),
                            7);
    // Twisting pulls diagonal folds about the waist.
    const float twisted = Amount(std::abs(posture.twist), 0.06F, 0.5F);
    const float band = SmoothStep(0.86F, 0.98F, p.z()) * SmoothStep(1.34F, 1.18F, p.z());
    const float turn = posture.twist < 0 ? -3.0F : 3.0F;
    height += 0.0055F * twisted * band *
              Train(2 * kPi * p.z() / 0.085F + turn * angle + 1.2F * Noise(p * 11));
    // The loose lower part hangs in upright folds, which follow the trunk.
    const float loose = SmoothStep(1.16F, 0.86F, p.z());
    height += 0.0052F * loose *
              std::sin(7 * angle + 1.8F * std::sin(2 * angle + 0.7F) + 7 * (p.z() - 0.84F) +
                       2.2F * posture.twist + 1.6F * posture.lean + 2.0F * posture.squat);
    // Folds from the armpits across chest and back.
    const float chest = SmoothStep(1.12F, 1.25F, p.z()) * SmoothStep(1.44F, 1.36F, p.z());
    const Posture::Arm& arm = posture.arm[p.y() > 0 ? 0 : 1];
    const float apart = SmoothStep(0.02F, 0.10F, std::abs(p.y()));
    height += 0.0035F * chest * apart * (0.4F + 0.6F * Amount(arm.raise, 0.4F, 1.8F)) *
              Train((28 + 8 * arm.raise) * (std::abs(p.y()) - 0.9F * (p.z() - 1.3F)) +
                    2.0F * Noise(p * 9));
  }
  return height;
}

float TrouserFolds(const Vec3f& p, const Posture& posture) {
  const auto& rest = RestSkeleton();
  const auto side = static_cast<std::size_t>(p.y() > 0 ? 0 : 1);
  const float mirror = side == 0 ? 1.0F : -1.0F;
  const Posture::Leg& leg = posture.leg[side];
  const auto thigh = static_cast<std::size_t>(side == 0 ? kLeftThigh : kRightThigh);
  const Vec3f hip = rest[thigh].position;
  const Vec3f knee = rest[thigh + 1].position;
  const Vec3f ankle = rest[thigh + 2].position;
  const float seed = 1 + 2.3F * static_cast<float>(side);
  const float knee_bend = leg.knee + 1.75F * posture.squat;
  const float hip_bend = leg.swing + 0.95F * posture.squat;
  float height = 0;
  height += 0.0095F * BendFolds({knee, (ankle - knee).normalized(), -Vec3f::UnitX(), 0.10F, 0.046F},
                                p,
                                0.22F + 0.78F * Amount(knee_bend, 0.05F, 1.2F),
                                seed);
  height += 0.0085F * BendFolds({hip + Vec3f(0, 0, -0.02F),
                                 Vec3f(0.1F, 0, -1).normalized(),
                                 Vec3f::UnitX(),
                                 0.085F,
                                 0.050F},
                                p,
                                0.18F + 0.82F * Amount(hip_bend, 0.05F, 0.9F),
                                seed + 1);
  // Cloth heaped on the shoe.
  const float stack = std::exp(-std::pow(std::max(p.z() - 0.08F, 0.0F) / 0.10F, 2.0F));
  const Vec3f q = p - ankle;
  const float angle = std::atan2(mirror * q.y(), q.x());
  height += 0.0060F * stack * SmoothStep(0.055F, 0.08F, p.z()) *
            Train(2 * kPi * p.z() / 0.040F + 1.4F * std::sin(angle + 0.6F) +
                  0.9F * std::sin(2 * angle) + 1.2F * knee_bend + seed);
  // Long folds down the leg, from the crotch and over the shin.
  const float leg_angle = std::atan2(mirror * (p.y() - knee.y()), p.x() - knee.x());
  const float upper = SmoothStep(0.16F, 0.30F, p.z()) * SmoothStep(0.88F, 0.75F, p.z());
  height +=
      0.0030F * upper *
      std::sin(4 * leg_angle + 14 * (p.z() - 0.5F) + 2.0F * Noise(p * 6) + 1.6F * knee_bend + seed);
  // Stretched flat over a bent knee.
  const float over = std::exp(-(p - knee - Vec3f(0.06F, 0, 0)).squaredNorm() / (0.08F * 0.08F));
  return height * (1 - 0.7F * over * Amount(knee_bend, 0.2F, 1.0F));
}

}  // namespace

float FoldHeight(const Vec3f& rest, const CoverDistances& covers, const Posture& posture) {
  // How far inside a garment's own region the point lies, in metres.
  const auto inside = [&](Cover cover) {
    float other = 1;
    for (int c = 0; c < kNumCovers; ++c) {
      if (c != cover) other = std::min(other, covers[static_cast<std::size_t>(c)]);
    }
    return other - covers[cover];
  };
  const float shirt = SmoothStep(0.001F, 0.010F, inside(kShirt));
  const float trousers = SmoothStep(0.001F, 0.010F, inside(kTrousers));
  float height = 0;
  if (shirt > 0) height += shirt * ShirtFolds(rest, posture);
  if (trousers > 0) height += trousers * TrouserFolds(rest, posture);
  const float cloth = std::max(shirt, trousers);
  if (cloth > 0) {
    // Small creases that wander with the posture.
    const Vec3f drift(0.01F * posture.lean,
                      0.012F * posture.twist,
                      0.02F * (posture.squat + 0.4F * posture.arm[rest.y() > 0 ? 0 : 1].raise));
    const Vec3f at = rest + drift;
    const float crease = Noise(Vec3f(at.x() * 24, at.y() * 24, at.z() * 34)) +
                         0.5F * Noise(at * 55 + Vec3f::Constant(7));
    height += cloth * 0.0020F * (1 - 2 * std::sqrt(crease * crease + 0.01F));
    // The collar and the waistband lie close.
    height *= 1 - SmoothStep(1.43F, 1.46F, rest.z());
  }
  return height;
}

}  // namespace dyxel::studio
