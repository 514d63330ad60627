#include "dyxel/studio/body_shape.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "dyxel/studio/noise.h"

namespace dyxel::studio {
namespace {

// Distance primitives after Quilez, "distance functions" (round cone, ellipsoid, smooth minimum).
float RoundCone(const Vec3f& p, const Vec3f& a, const Vec3f& b, float ra, float rb) {
  const Vec3f ba = b - a;
  const float l2 = ba.squaredNorm();
  const float rr = ra - rb;
  const float a2 = l2 - rr * rr;
  const float il2 = 1 / l2;
  const Vec3f pa = p - a;
  const float y = pa.dot(ba);
  const float z = y - l2;
  const float x2 = (pa * l2 - ba * y).squaredNorm();
  const float y2 = y * y * l2;
  const float z2 = z * z * l2;
  const float k = std::copysign(rr * rr * x2, rr);
  if (std::copysign(a2 * z2, z) > k) return std::sqrt(x2 + z2) * il2 - rb;
  if (std::copysign(a2 * y2, y) < k) return std::sqrt(x2 + y2) * il2 - ra;
  return (std::sqrt(x2 * a2 * il2) + y * rr) * il2 - ra;
}

float Ellipsoid(const Vec3f& p, const Vec3f& center, const Vec3f& radii) {
  const Vec3f q = p - center;
  const float k0 = q.cwiseQuotient(radii).norm();
  const float k1 = q.cwiseQuotient(radii.cwiseProduct(radii)).norm();
  return k1 > 0 ? k0 * (k0 - 1) / k1 : -radii.minCoeff();
}

float SmoothMin(float a, float b, float k) {
  const float h = std::max(k - std::abs(a - b), 0.0F) / k;
  return std::min(a, b) - 0.25F * h * h * k;
}
float SmoothMax(float a, float b, float k) { return -SmoothMin(-a, -b, k); }

// One cross-section of a swept trunk: an ellipse about (forward, 0) at a height.
struct Section {
  float z, forward, half_depth, half_width;
};

// The ellipse at a height, Catmull-Rom between the sections.
Section SectionAt(std::span<const Section> s, float z) {
  const int last = static_cast<int>(s.size()) - 1;
  int i = 0;
  while (i < last - 1 && z > s[static_cast<std::size_t>(i) + 1].z) ++i;
  const auto at = [&](int j) { return s[static_cast<std::size_t>(std::clamp(j, 0, last))]; };
  const Section a = at(i - 1);
  const Section b = at(i);
  const Section c = at(i + 1);
  const Section d = at(i + 2);
  const float t = std::clamp((z - b.z) / (c.z - b.z), 0.0F, 1.0F);
  const auto blend = [t](float p, float q, float r, float u) {
    return q + 0.5F * t * (r - p + t * (2 * p - 5 * q + 4 * r - u + t * (3 * (q - r) + u - p)));
  };
  return {z,
          blend(a.forward, b.forward, c.forward, d.forward),
          blend(a.half_depth, b.half_depth, c.half_depth, d.half_depth),
          blend(a.half_width, b.half_width, c.half_width, d.half_width)};
}

float Swept(std::span<const Section> sections, const Vec3f& p) {
  const Section s = SectionAt(sections, p.z());
  const Vec2f q(p.x() - s.forward, p.y());
  const Vec2f r(s.half_depth, s.half_width);
  const float k0 = q.cwiseQuotient(r).norm();
  const float k1 = q.cwiseQuotient(r.cwiseProduct(r)).norm();
  const float side = k1 > 0 ? k0 * (k0 - 1) / k1 : -r.minCoeff();
  return SmoothMax(side, std::max(p.z() - sections.back().z, sections.front().z - p.z()), 0.012F);
}

// The left limbs; the right ones are their mirror images.
const Vec3f kShoulder(-0.005F, 0.172F, 1.395F);
const Vec3f kElbow(-0.010F, 0.372F, 1.195F);
const Vec3f kWrist(0.030F, 0.540F, 1.020F);
const Vec3f kHip(0.0F, 0.088F, 0.890F);
const Vec3f kKnee(0.005F, 0.112F, 0.480F);
const Vec3f kAnkle(-0.020F, 0.128F, 0.085F);

constexpr std::array<Section, 9> kShirtTrunk = {{{0.835F, 0.000F, 0.127F, 0.186F},
                                                 {0.920F, -0.002F, 0.129F, 0.184F},
                                                 {1.040F, 0.004F, 0.113F, 0.160F},
                                                 {1.130F, 0.006F, 0.112F, 0.155F},
                                                 {1.250F, 0.004F, 0.122F, 0.168F},
                                                 {1.340F, -0.004F, 0.118F, 0.172F},
                                                 {1.410F, -0.012F, 0.095F, 0.150F},
                                                 {1.455F, -0.014F, 0.070F, 0.085F},
                                                 {1.485F, -0.012F, 0.062F, 0.064F}}};

Vec3f Mirror(const Vec3f& p) { return {p.x(), std::abs(p.y()), p.z()}; }

float Hand(const Vec3f& p) {  // p mirrored to the left
  const Vec3f along = (kWrist - kElbow).normalized();
  const Vec3f across = (Vec3f::UnitX() - along * along.x()).normalized();  // towards the thumb
  const Vec3f back = along.cross(across);                                  // away from the trunk
  const Vec3f q = p - kWrist;
  const Vec3f local(q.dot(along), q.dot(across), q.dot(back));
  if (local.norm() > 0.32F) return local.norm() - 0.22F;
  float d = Ellipsoid(local, {0.048F, 0.0F, 0.0F}, {0.058F, 0.039F, 0.0165F});
  constexpr std::array<float, 4> kLength = {0.070F, 0.079F, 0.074F, 0.058F};
  for (int f = 0; f < 4; ++f) {
    const float offset = 0.028F - 0.0185F * static_cast<float>(f);
    const float length = kLength[static_cast<std::size_t>(f)];
    const Vec3f root(0.092F - 0.25F * std::abs(offset - 0.005F), offset, 0.001F);
    const Vec3f middle = root + Vec3f(0.55F * length, 0.10F * offset, -0.006F);
    const Vec3f tip = middle + Vec3f(0.45F * length, 0.06F * offset, -0.016F);
    const float finger = std::min(RoundCone(local, root, middle, 0.0092F, 0.0085F),
                                  RoundCone(local, middle, tip, 0.0085F, 0.0072F));
    d = SmoothMin(d, finger, 0.008F);
  }
  const Vec3f thumb_root(0.025F, 0.030F, -0.004F);
  const Vec3f thumb_middle(0.062F, 0.058F, -0.012F);
  const Vec3f thumb_tip(0.094F, 0.066F, -0.020F);
  d = SmoothMin(d, RoundCone(local, thumb_root, thumb_middle, 0.0135F, 0.0105F), 0.015F);
  return SmoothMin(d, RoundCone(local, thumb_middle, thumb_tip, 0.0105F, 0.0085F), 0.006F);
}

float HeadAndNeck(const Vec3f& p) {  // p mirrored
  float d = Ellipsoid(p, {-0.004F, 0, 1.652F}, {0.096F, 0.077F, 0.098F});
  d = SmoothMin(d, Ellipsoid(p, {0.034F, 0, 1.595F}, {0.060F, 0.057F, 0.070F}), 0.045F);
  d = SmoothMin(d, Ellipsoid(p, {0.072F, 0, 1.546F}, {0.020F, 0.024F, 0.017F}), 0.030F);  // chin
  d = SmoothMin(
      d, Ellipsoid(p, {0.062F, 0.038F, 1.605F}, {0.024F, 0.020F, 0.022F}), 0.03F);  // cheek
  d = SmoothMin(
      d, Ellipsoid(p, {0.084F, 0.026F, 1.662F}, {0.010F, 0.026F, 0.008F}), 0.018F);  // brow
  d = SmoothMax(d, -Ellipsoid(p, {0.100F, 0.032F, 1.640F}, {0.014F, 0.019F, 0.012F}), 0.016F);
  d = SmoothMin(d, Ellipsoid(p, {0.075F, 0.032F, 1.639F}, {0.0135F, 0.0150F, 0.0120F}), 0.004F);
  d = SmoothMin(
      d, RoundCone(p, {0.092F, 0, 1.650F}, {0.112F, 0, 1.607F}, 0.0075F, 0.0115F), 0.014F);
  d = SmoothMin(d, Ellipsoid(p, {0.100F, 0.010F, 1.603F}, {0.010F, 0.009F, 0.008F}), 0.010F);
  d = SmoothMin(d, Ellipsoid(p, {0.091F, 0, 1.5775F}, {0.010F, 0.022F, 0.0060F}), 0.006F);
  d = SmoothMin(d, Ellipsoid(p, {0.090F, 0, 1.5665F}, {0.010F, 0.018F, 0.0060F}), 0.006F);
  d = SmoothMin(d, Ellipsoid(p, {-0.008F, 0.079F, 1.630F}, {0.020F, 0.010F, 0.031F}), 0.008F);
  const float neck = RoundCone(p, {-0.018F, 0, 1.42F}, {-0.004F, 0, 1.575F}, 0.058F, 0.051F);
  return SmoothMin(d, neck, 0.035F);
}

float Skin(const Vec3f& x) {
  const Vec3f p = Mirror(x);
  float d = HeadAndNeck(p);
  const Vec3f bulge = kElbow + 0.3F * (kWrist - kElbow);
  float arm = SmoothMin(RoundCone(p, kElbow, bulge, 0.040F, 0.041F),
                        RoundCone(p, bulge, kWrist, 0.041F, 0.0265F),
                        0.02F);
  arm = SmoothMin(arm, Hand(p), 0.022F);
  return std::min(d, arm);
}

float Shirt(const Vec3f& x) {
  const Vec3f p = Mirror(x);
  // A hem that is not quite level, longer at the back.
  Vec3f trunk_point = p;
  trunk_point.z() +=
      0.012F * std::sin(3 * std::atan2(x.y(), x.x()) + 0.6F) * SmoothStep(1.0F, 0.85F, p.z());
  float d = Swept(kShirtTrunk, trunk_point);
  // Over the seat.
  const float seat = Ellipsoid(p, {-0.050F, 0.072F, 0.895F}, {0.092F, 0.096F, 0.106F});
  d = SmoothMin(d, SmoothMax(seat, 0.835F - trunk_point.z(), 0.012F), 0.04F);
  d = SmoothMin(d, Ellipsoid(p, {0.062F, 0.075F, 1.275F}, {0.060F, 0.075F, 0.070F}), 0.05F);
  d = SmoothMin(d, Ellipsoid(p, {-0.055F, 0.080F, 1.320F}, {0.060F, 0.080F, 0.100F}), 0.05F);
  const Vec3f trapezius(-0.020F, 0.060F, 1.440F);
  d = SmoothMin(d, RoundCone(p, trapezius, kShoulder, 0.042F, 0.058F), 0.045F);
  // Sleeves that end below the elbow.
  const Vec3f along = (kWrist - kElbow).normalized();
  const Vec3f cuff = kElbow + 0.075F * along;
  float sleeve = SmoothMin(RoundCone(p, kShoulder, kElbow, 0.0640F, 0.0545F),
                           RoundCone(p, kElbow, kElbow + 0.12F * along, 0.0545F, 0.0560F),
                           0.02F);
  sleeve = SmoothMax(sleeve, (p - cuff).dot(along), 0.008F);
  d = SmoothMin(d, sleeve, 0.055F);
  // The neckline: wider than the neck.
  d = SmoothMax(d, -RoundCone(p, {0.015F, 0, 1.468F}, {0.05F, 0, 1.60F}, 0.058F, 0.10F), 0.008F);
  // A ribbed collar.
  const Vec3f ring = p - Vec3f(-0.006F, 0, 1.463F);
  const Vec3f tilted(
      ring.x() * 0.94F - ring.z() * 0.34F, ring.y(), ring.z() * 0.94F + ring.x() * 0.34F);
  const float radius = std::hypot(tilted.x() / 1.02F, tilted.y()) - 0.066F;
  return SmoothMin(d, std::hypot(radius, tilted.z()) - 0.0085F, 0.006F);
}

float Trousers(const Vec3f& x) {
  const Vec3f p = Mirror(x);
  float d = Ellipsoid(p, {0.000F, 0, 0.945F}, {0.108F, 0.158F, 0.115F});
  d = SmoothMin(d, Ellipsoid(p, {-0.050F, 0.072F, 0.895F}, {0.078F, 0.082F, 0.092F}), 0.05F);
  const Vec3f cuff = kAnkle + Vec3f(0, 0, -0.02F);
  float leg = SmoothMin(RoundCone(p, kHip, kKnee, 0.0920F, 0.0680F),
                        RoundCone(p, kKnee, cuff, 0.0680F, 0.0640F),
                        0.02F);
  const Vec3f calf = kKnee + 0.3F * (kAnkle - kKnee) + Vec3f(-0.012F, 0, 0);
  leg = SmoothMin(leg, Ellipsoid(p, calf, {0.065F, 0.062F, 0.12F}), 0.04F);
  leg = SmoothMax(leg, 0.062F + 0.10F * (p.x() + 0.02F) - p.z(), 0.008F);
  return SmoothMin(d, leg, 0.035F);
}

float Shoes(const Vec3f& x) {
  const Vec3f p = Mirror(x);
  const Vec3f heel(-0.058F, 0.126F, 0.040F);
  const Vec3f ball(0.070F, 0.142F, 0.036F);
  const Vec3f toe(0.128F, 0.146F, 0.030F);
  float d = SmoothMin(
      RoundCone(p, heel, ball, 0.040F, 0.047F), RoundCone(p, ball, toe, 0.047F, 0.034F), 0.02F);
  d = SmoothMin(d, RoundCone(p, heel + Vec3f(0.03F, 0, 0.02F), kAnkle, 0.044F, 0.042F), 0.05F);
  d = SmoothMin(
      d, RoundCone(p, {0.0F, 0.130F, 0.075F}, {0.08F, 0.143F, 0.045F}, 0.030F, 0.03F), 0.03F);
  return SmoothMax(d, -p.z(), 0.010F);
}

float Hair(const Vec3f& x) {
  const Vec3f p = Mirror(x);
  float d = Ellipsoid(p, {-0.012F, 0, 1.668F}, {0.108F, 0.089F, 0.098F});
  d = SmoothMin(d, Ellipsoid(p, {-0.052F, 0, 1.615F}, {0.058F, 0.080F, 0.090F}), 0.04F);
  // A quiff to the person's right.
  d = SmoothMin(d, Ellipsoid(x, {0.062F, -0.018F, 1.738F}, {0.042F, 0.060F, 0.026F}), 0.03F);
  // Strands.
  const float angle = std::atan2(x.y(), x.x() + 0.02F);
  d += 0.0022F * std::sin(26 * angle + 9 * Noise(x * 22) + 40 * (x.z() - 1.6F));
  // The face and the ears stay free.
  const Vec3f face(0.130F, 0, 1.600F);
  d = SmoothMax(d, -Ellipsoid(p, face, {0.112F, 0.076F, 0.103F}), 0.014F);
  d = SmoothMax(d, -Ellipsoid(p, {0.010F, 0.095F, 1.615F}, {0.036F, 0.030F, 0.050F}), 0.010F);
  return SmoothMax(d, 1.535F - p.z(), 0.02F);
}

}  // namespace

const std::vector<RestJoint>& RestSkeleton() {
  static const std::vector<RestJoint> skeleton = [] {
    const auto right = [](const Vec3f& p) { return Vec3f(p.x(), -p.y(), p.z()); };
    const Vec3f clavicle(-0.010F, 0.030F, 1.430F);
    return std::vector<RestJoint>{
        {"hips", -1, {0, 0, 0.935F}},
        {"lumbar", kPelvis, {-0.012F, 0, 1.050F}},
        {"thorax", kSpine, {-0.015F, 0, 1.190F}},
        {"cervical", kChest, {-0.016F, 0, 1.455F}},
        {"skull", kNeck, {0.000F, 0, 1.565F}},
        {"clavicle.l", kChest, clavicle},
        {"shoulder.l", kLeftClavicle, kShoulder},
        {"elbow.l", kLeftUpperArm, kElbow},
        {"wrist.l", kLeftForearm, kWrist},
        {"clavicle.r", kChest, right(clavicle)},
        {"shoulder.r", kRightClavicle, right(kShoulder)},
        {"elbow.r", kRightUpperArm, right(kElbow)},
        {"wrist.r", kRightForearm, right(kWrist)},
        {"hip.l", kPelvis, kHip},
        {"knee.l", kLeftThigh, kKnee},
        {"ankle.l", kLeftShank, kAnkle},
        {"hip.r", kPelvis, right(kHip)},
        {"knee.r", kRightThigh, right(kKnee)},
        {"ankle.r", kRightShank, right(kAnkle)},
    };
  }();
  return skeleton;
}

CoverDistances EvaluateCovers(const Vec3f& x) {
  // Far parts need no exact distance: bounds keep the evaluation cheap.
  CoverDistances d;
  d[kSkin] = Skin(x);
  d[kShirt] = x.z() < 0.70F ? 0.835F - x.z() : Shirt(x);
  d[kTrousers] = x.z() > 1.20F ? x.z() - 1.06F : Trousers(x);
  d[kShoes] = x.z() > 0.30F ? x.z() - 0.14F : Shoes(x);
  d[kHair] = x.z() < 1.40F ? 1.53F - x.z() : Hair(x);
  return d;
}

float EvaluatePerson(const CoverDistances& distances) {
  float d = distances[0];
  for (int c = 1; c < kNumCovers; ++c) {
    d = SmoothMin(d, distances[static_cast<std::size_t>(c)], 0.004F);
  }
  return d;
}
float EvaluatePerson(const Vec3f& x) { return EvaluatePerson(EvaluateCovers(x)); }

std::array<float, kNumJoints> JointWeights(const Vec3f& x) {
  const bool left = x.y() >= 0;
  const Vec3f p = Mirror(x);
  const Vec3f fingers = kWrist + 0.17F * (kWrist - kElbow).normalized();
  // Depth of the point in each part; the trunk, both arms' and both legs' bones.
  const float trunk =
      SmoothMin(Swept(kShirtTrunk, p),
                std::min(RoundCone(p, {0, 0, 1.45F}, {0.01F, 0, 1.65F}, 0.06F, 0.09F),
                         Ellipsoid(p, {0, 0, 0.95F}, {0.11F, 0.15F, 0.11F})),
                0.03F);
  constexpr std::array<float, 6> kSoftness = {0.016F, 0.012F, 0.008F, 0.018F, 0.014F, 0.010F};
  std::array<std::array<float, 6>, 2> limb;  // left, right
  float nearest = trunk;
  for (std::size_t side = 0; side < 2; ++side) {
    const Vec3f q(x.x(), side == 0 ? x.y() : -x.y(), x.z());
    limb[side] = {RoundCone(q, kShoulder, kElbow, 0.060F, 0.046F),
                  RoundCone(q, kElbow, kWrist, 0.046F, 0.028F),
                  RoundCone(q, kWrist, fingers, 0.026F, 0.030F),
                  RoundCone(q, kHip, kKnee, 0.085F, 0.062F),
                  RoundCone(q, kKnee, kAnkle, 0.062F, 0.050F),
                  RoundCone(q, kAnkle, {0.12F, 0.145F, 0.03F}, 0.045F, 0.04F)};
    for (const float d : limb[side]) nearest = std::min(nearest, d);
  }
  const float trunk_weight = std::exp(-(trunk - nearest) / 0.018F);
  std::array<float, kNumJoints> w{};
  float sum = trunk_weight;
  for (std::size_t side = 0; side < 2; ++side) {
    for (std::size_t i = 0; i < 6; ++i) {
      const float weight = std::exp(-(limb[side][i] - nearest) / kSoftness[i]);
      const int first = i < 3 ? (side == 0 ? kLeftUpperArm : kRightUpperArm)
                              : (side == 0 ? kLeftThigh : kRightThigh) - 3;
      w[static_cast<std::size_t>(first) + i] = weight;
      sum += weight;
    }
  }
  for (float& weight : w) weight /= sum;
  // The trunk's share goes up the spine, and at the shoulders to the clavicles.
  const float share = trunk_weight / sum;
  const float spine = SmoothStep(0.97F, 1.12F, p.z());
  const float chest = SmoothStep(1.11F, 1.27F, p.z());
  const float neck = SmoothStep(1.435F, 1.505F, p.z());
  const float head = SmoothStep(1.525F, 1.595F, p.z() + 0.25F * std::max(p.x(), 0.0F));
  const float clavicle =
      (1 - neck) * SmoothStep(0.03F, 0.17F, p.y()) * SmoothStep(1.22F, 1.40F, p.z());
  w[kPelvis] += share * (1 - spine);
  w[kSpine] += share * spine * (1 - chest);
  w[kChest] += share * chest * (1 - neck) * (1 - clavicle);
  w[left ? kLeftClavicle : kRightClavicle] += share * chest * (1 - neck) * clavicle;
  w[kNeck] += share * chest * neck * (1 - head);
  w[kHead] += share * chest * neck * head;
  return w;
}

}  // namespace dyxel::studio
