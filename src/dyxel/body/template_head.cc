// Head and hand of the built-in template.
#include <array>
#include <cstddef>

#include "dyxel/body/template_parts.h"

namespace dyxel {
namespace {

using Op = ShapePrimitive::Op;

ShapePrimitive Ellipsoid(int segment,
                         double blend,
                         const Vec3d& center,
                         const Vec3d& radii,
                         const Mat3d& frame = Mat3d::Identity(),
                         Op op = Op::kJoin) {
  ShapePrimitive part;
  part.kind = ShapePrimitive::Kind::kEllipsoid;
  part.op = op;
  part.segment = segment;
  part.blend = blend;
  part.a = center;
  part.radii = radii;
  part.frame = frame;
  return part;
}

ShapePrimitive RoundCone(
    int segment, double blend, const Vec3d& a, double radius_a, const Vec3d& b, double radius_b) {
  ShapePrimitive part;
  part.segment = segment;
  part.blend = blend;
  part.a = a;
  part.b = b;
  part.radius_a = radius_a;
  part.radius_b = radius_b;
  return part;
}

// Columns: `x` made unit, `y` made perpendicular to it, and their cross product.
Mat3d Frame(const Vec3d& x, const Vec3d& y) {
  Mat3d frame;
  frame.col(0) = x.normalized();
  frame.col(1) = (y - frame.col(0) * frame.col(0).dot(y)).normalized();
  frame.col(2) = frame.col(0).cross(frame.col(1));
  return frame;
}

}  // namespace

// Head breadth 0.155 m, length 0.195 m, chin to vertex 0.228 m (Drillis and Contini: 0.130 H).
void AddHead(std::vector<ShapePrimitive>& parts) {
  auto add = [&](const ShapePrimitive& part) { parts.push_back(part); };
  auto both = [&](const ShapePrimitive& part) {
    parts.push_back(part);
    parts.push_back(Mirrored(part, part.segment));
  };
  const Vec3d x = Vec3d::UnitX();
  const Vec3d z = Vec3d::UnitZ();
  // Skull, forehead, jaw, cheeks, chin.
  add(Ellipsoid(kHead, 0.02, {-0.006, 0, 1.658}, {0.096, 0.0755, 0.090}));
  add(Ellipsoid(kHead, 0.03, {-0.018, 0, 1.670}, {0.081, 0.0765, 0.072}));
  add(Ellipsoid(kHead, 0.03, {0.030, 0, 1.635}, {0.062, 0.066, 0.080}));
  add(Ellipsoid(kHead, 0.03, {0.036, 0, 1.578}, {0.052, 0.050, 0.053}));
  both(Ellipsoid(kHead, 0.02, {0.058, 0.040, 1.612}, {0.026, 0.024, 0.024}));
  add(RoundCone(kHead, 0.022, {0.074, -0.010, 1.541}, 0.016, {0.074, 0.010, 1.541}, 0.016));
  both(RoundCone(kHead, 0.025, {0.000, 0.047, 1.583}, 0.016, {0.050, 0.027, 1.547}, 0.015));
  // Brow, sockets, eyes.
  both(RoundCone(kHead, 0.012, {0.084, 0.012, 1.662}, 0.010, {0.068, 0.050, 1.661}, 0.009));
  both(Ellipsoid(
      kHead, 0.014, {0.094, 0.031, 1.641}, {0.017, 0.018, 0.012}, Mat3d::Identity(), Op::kCarve));
  both(Ellipsoid(kHead, 0.004, {0.0715, 0.0315, 1.6405}, {0.0135, 0.0150, 0.0125}));
  // Nose: bridge, tip, wings.
  add(RoundCone(kHead, 0.010, {0.084, 0, 1.650}, 0.0075, {0.101, 0, 1.604}, 0.0095));
  both(Ellipsoid(kHead, 0.006, {0.092, 0.0115, 1.5990}, {0.0110, 0.0070, 0.0075}));
  // Lips and the line between.
  add(Ellipsoid(kHead, 0.006, {0.083, 0, 1.5755}, {0.0115, 0.0225, 0.0075}));
  add(Ellipsoid(kHead, 0.006, {0.081, 0, 1.5615}, {0.0115, 0.0195, 0.0080}));
  add(Ellipsoid(
      kHead, 0.005, {0.0970, 0, 1.5685}, {0.0090, 0.0215, 0.0026}, Mat3d::Identity(), Op::kCarve));
  // Ears.
  const Mat3d ear = Frame(x + Vec3d(0, 0.35, 0), z - 0.15 * x);
  both(Ellipsoid(kHead, 0.006, {-0.012, 0.0815, 1.633}, {0.0190, 0.0320, 0.0085}, ear));
  both(Ellipsoid(kHead, 0.005, {-0.004, 0.0925, 1.637}, {0.0090, 0.0180, 0.0060}, ear, Op::kCarve));
}

// Hand length 0.189 m (Drillis and Contini: 0.108 H): palm, four fingers side by side that touch,
// so that the skin stays simple, and a thumb.
void AddHand(const Vec3d& wrist, std::vector<ShapePrimitive>& parts) {
  const Vec3d bone = BoneDirection(kLeftHand);
  const Vec3d thumb_side = Vec3d::UnitX();
  const Vec3d palm_side = bone.cross(thumb_side);
  // Metres along the hand, towards the thumb, towards the palm's side.
  auto at = [&](double along, double across, double down) {
    return Vec3d(wrist + along * bone + across * thumb_side + down * palm_side);
  };
  auto both = [&](const ShapePrimitive& part) {
    parts.push_back(part);
    parts.push_back(Mirrored(part, MirrorSegment(part.segment)));
  };
  ShapePrimitive palm;
  palm.kind = ShapePrimitive::Kind::kLoft;
  palm.segment = kLeftHand;
  palm.blend = 0.010;
  palm.a = wrist;
  palm.frame.col(2) = bone;
  palm.frame.col(0) = thumb_side;
  palm.frame.col(1) = palm_side;
  palm.sections = {{-0.025, 0.018, 0.018, 0.011, 0.011, 0.2},
                   {0.010, 0.029, 0.028, 0.018, 0.018, 0.4},
                   {0.040, 0.036, 0.036, 0.017, 0.018, 0.6},
                   {0.070, 0.040, 0.040, 0.015, 0.016, 0.8},
                   {0.090, 0.039, 0.039, 0.011, 0.011, 0.8},
                   {0.110, 0.034, 0.033, 0.006, 0.006, 0.8}};
  both(palm);
  struct Finger {
    double across, length, radius;
    [[nodiscard]] double Middle() const { return 0.5 * (0.085 + length); }
    [[nodiscard]] double Tip() const { return length - 0.8 * radius; }
    // How far it has bent at a distance from the wrist.
    [[nodiscard]] double Down(double along) const {
      const double bend = (along - Middle()) / (Tip() - Middle());
      return 0.004 + 0.012 * (bend > 0 ? bend : 0);
    }
  };
  const std::array<Finger, 4> fingers = {Finger{0.030, 0.170, 0.0102},
                                         Finger{0.0102, 0.184, 0.0106},
                                         Finger{-0.010, 0.175, 0.0102},
                                         Finger{-0.0295, 0.154, 0.0094}};
  for (const Finger& f : fingers) {
    const Vec3d middle = at(f.Middle(), f.across, f.Down(0));
    both(RoundCone(kLeftHand, 0.004, at(0.080, f.across, 0), 1.06 * f.radius, middle, f.radius));
    both(RoundCone(kLeftHand,
                   0.003,
                   middle,
                   f.radius,
                   at(f.Tip(), 0.97 * f.across, f.Down(f.Tip())),
                   0.82 * f.radius));
  }
  // Between two fingers a web nearly to the shorter one's tip leaves a groove, never a gap, so that
  // the skin keeps the topology of a ball.
  for (std::size_t i = 0; i + 1 < fingers.size(); ++i) {
    const Finger& f = fingers[i];
    const Finger& g = fingers[i + 1];
    const Finger& shorter = f.length < g.length ? f : g;
    const double across = 0.5 * (f.across + g.across);
    const double end = shorter.Tip() + 0.001;
    const Vec3d middle = at(shorter.Middle(), across, 0.004);
    const Vec3d tip = at(end, 0.97 * across, 0.5 * (f.Down(end) + g.Down(end)));
    both(RoundCone(kLeftHand, 0.003, at(0.080, across, 0), 0.0085, middle, 0.0070));
    both(RoundCone(kLeftHand, 0.003, middle, 0.0070, tip, 0.0058));
  }
  // Thumb.
  both(RoundCone(
      kLeftHand, 0.014, at(0.022, 0.020, 0.006), 0.0165, at(0.062, 0.044, 0.014), 0.0135));
  both(RoundCone(
      kLeftHand, 0.006, at(0.062, 0.044, 0.014), 0.0130, at(0.108, 0.056, 0.018), 0.0095));
}

}  // namespace dyxel
