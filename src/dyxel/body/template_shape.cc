// Trunk and limbs of the built-in template.
#include <algorithm>
#include <cmath>
#include <utility>

#include "dyxel/body/template_parts.h"

namespace dyxel {
namespace {

// A loft whose u (front) is made perpendicular to `axis`.
ShapePrimitive Loft(int segment,
                    double blend,
                    const Vec3d& origin,
                    const Vec3d& axis,
                    const Vec3d& front,
                    std::vector<LoftSection> sections) {
  ShapePrimitive part;
  part.kind = ShapePrimitive::Kind::kLoft;
  part.segment = segment;
  part.blend = blend;
  part.a = origin;
  part.frame.col(2) = axis;
  part.frame.col(0) = (front - axis * axis.dot(front)).normalized();
  part.frame.col(1) = axis.cross(part.frame.col(0));
  part.sections = std::move(sections);
  return part;
}

ShapePrimitive Ellipsoid(int segment, double blend, const Vec3d& center, const Vec3d& radii) {
  ShapePrimitive part;
  part.kind = ShapePrimitive::Kind::kEllipsoid;
  part.segment = segment;
  part.blend = blend;
  part.a = center;
  part.radii = radii;
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

void AddBothSides(const ShapePrimitive& left, std::vector<ShapePrimitive>& parts) {
  parts.push_back(left);
  parts.push_back(Mirrored(left, MirrorSegment(left.segment)));
}

// The stretch of a profile between two joints as the part of one segment. Stretches overlap, so
// that no cap comes near the surface; where two of one profile overlap they are the same.
ShapePrimitive Stretch(
    ShapePrimitive profile, int segment, double blend, double first, double last) {
  profile.segment = segment;
  profile.blend = blend;
  constexpr double kOverlap = 0.06;
  profile.first = first - kOverlap;
  profile.last = last + kOverlap;
  return profile;
}

// One profile from the hips to the neck, and the swellings on it.
void AddTrunk(const Skeleton& skeleton, std::vector<ShapePrimitive>& parts) {
  // Heights in metres; front and back from x = −0.01, half width both sides.
  auto section = [](double z, double front, double back, double half_width, double square) {
    return LoftSection{z, front + 0.01, back - 0.01, half_width, half_width, square};
  };
  const ShapePrimitive trunk = Loft(kPelvis,
                                    0.0,
                                    {-0.01, 0, 0},
                                    Vec3d::UnitZ(),
                                    Vec3d::UnitX(),
                                    {section(0.850, 0.070, 0.080, 0.120, 0.2),
                                     section(0.890, 0.098, 0.112, 0.160, 0.3),
                                     section(0.940, 0.110, 0.126, 0.176, 0.3),
                                     section(1.000, 0.114, 0.122, 0.172, 0.3),
                                     section(1.060, 0.115, 0.108, 0.160, 0.3),
                                     section(1.120, 0.115, 0.102, 0.153, 0.3),
                                     section(1.180, 0.117, 0.106, 0.154, 0.3),
                                     section(1.250, 0.122, 0.116, 0.161, 0.3),
                                     section(1.320, 0.122, 0.123, 0.166, 0.3),
                                     section(1.380, 0.101, 0.120, 0.156, 0.2),
                                     section(1.430, 0.064, 0.098, 0.120, 0.1),
                                     section(1.470, 0.038, 0.080, 0.074, 0.0)});
  const std::vector<Vec3d> rest = skeleton.RestPositions();
  const double abdomen = rest[kAbdomen][2];
  const double chest = rest[kChest][2];
  parts.push_back(Stretch(trunk, kPelvis, 0.0, -1, abdomen));
  parts.push_back(Stretch(trunk, kAbdomen, 0.0, abdomen, chest));
  parts.push_back(Stretch(trunk, kChest, 0.0, chest, 2));
  // Neck, ending inside the skull.
  parts.push_back(Loft(kHead,
                       0.03,
                       {-0.037, 0, 1.42},
                       Vec3d(0.22, 0, 1).normalized(),
                       Vec3d::UnitX(),
                       {{-0.03, 0.040, 0.040, 0.045, 0.045, 0},
                        {0.02, 0.058, 0.058, 0.061, 0.061, 0},
                        {0.07, 0.056, 0.059, 0.058, 0.058, 0},
                        {0.12, 0.055, 0.060, 0.057, 0.057, 0},
                        {0.17, 0.052, 0.058, 0.054, 0.054, 0},
                        {0.21, 0.035, 0.040, 0.035, 0.035, 0}}));
  // Trapezius, pectoral, shoulder blade, buttock.
  AddBothSides(RoundCone(kChest, 0.05, {-0.045, 0.045, 1.455}, 0.042, {-0.03, 0.150, 1.414}, 0.044),
               parts);
  AddBothSides(Ellipsoid(kChest, 0.06, {0.050, 0.072, 1.310}, {0.054, 0.085, 0.085}), parts);
  AddBothSides(Ellipsoid(kChest, 0.05, {-0.075, 0.085, 1.325}, {0.050, 0.070, 0.095}), parts);
  AddBothSides(Ellipsoid(kPelvis, 0.05, {-0.066, 0.078, 0.912}, {0.068, 0.080, 0.095}), parts);
}

void AddArmParts(const Skeleton& skeleton, std::vector<ShapePrimitive>& parts) {
  const std::vector<Vec3d> rest = skeleton.RestPositions();
  const Vec3d bone = BoneDirection(kLeftUpperArm);
  const Vec3d shoulder = rest[kLeftUpperArm];
  const double elbow = (rest[kLeftLowerArm] - shoulder).norm();
  // v = bone × front points inwards-down: `left` is the inner side, `right` the outer.
  const ShapePrimitive arm = Loft(kLeftUpperArm,
                                  0.0,
                                  shoulder,
                                  bone,
                                  Vec3d::UnitX(),
                                  {{-0.060, 0.020, 0.020, 0.020, 0.020, 0},
                                   {-0.035, 0.044, 0.044, 0.040, 0.040, 0},
                                   {0.000, 0.056, 0.058, 0.056, 0.053, 0},
                                   {0.050, 0.056, 0.058, 0.056, 0.056, 0},
                                   {0.110, 0.053, 0.053, 0.053, 0.052, 0},
                                   {0.180, 0.051, 0.049, 0.047, 0.048, 0},
                                   {0.260, 0.045, 0.043, 0.042, 0.043, 0},
                                   {0.325, 0.042, 0.041, 0.042, 0.044, 0},
                                   {0.375, 0.045, 0.043, 0.044, 0.044, 0},
                                   {0.425, 0.042, 0.041, 0.040, 0.041, 0},
                                   {0.485, 0.036, 0.036, 0.033, 0.034, 0},
                                   {0.540, 0.031, 0.030, 0.026, 0.026, 0.1},
                                   {0.580, 0.029, 0.028, 0.021, 0.021, 0.2},
                                   {0.615, 0.024, 0.022, 0.014, 0.014, 0.2}});
  AddBothSides(Stretch(arm, kLeftUpperArm, 0.045, -1, elbow), parts);
  AddBothSides(Stretch(arm, kLeftLowerArm, 0.0, elbow, 1), parts);
}

void AddLegParts(const Skeleton& skeleton, std::vector<ShapePrimitive>& parts) {
  const std::vector<Vec3d> rest = skeleton.RestPositions();
  const Vec3d bone = BoneDirection(kLeftThigh);
  const double knee = (rest[kLeftShank] - rest[kLeftThigh]).norm();
  // v = bone × front points inwards (to the right): `left` is inner, `right` outer.
  const ShapePrimitive leg = Loft(kLeftThigh,
                                  0.0,
                                  rest[kLeftThigh],
                                  bone,
                                  Vec3d::UnitX(),
                                  {{-0.100, 0.030, 0.035, 0.030, 0.040, 0.0},
                                   {-0.060, 0.070, 0.075, 0.060, 0.070, 0.0},
                                   {-0.010, 0.090, 0.098, 0.078, 0.086, 0.1},
                                   {0.050, 0.096, 0.106, 0.085, 0.091, 0.1},
                                   {0.110, 0.093, 0.101, 0.083, 0.088, 0.1},
                                   {0.200, 0.084, 0.088, 0.075, 0.080, 0.05},
                                   {0.300, 0.074, 0.075, 0.066, 0.069, 0},
                                   {0.380, 0.067, 0.065, 0.060, 0.061, 0},
                                   {0.430, 0.065, 0.061, 0.058, 0.059, 0},
                                   {0.480, 0.060, 0.064, 0.057, 0.058, 0},
                                   {0.550, 0.055, 0.071, 0.056, 0.058, 0},
                                   {0.630, 0.052, 0.065, 0.052, 0.053, 0},
                                   {0.730, 0.047, 0.053, 0.046, 0.046, 0},
                                   {0.810, 0.045, 0.048, 0.042, 0.042, 0},
                                   {0.860, 0.045, 0.046, 0.039, 0.039, 0},
                                   {0.890, 0.035, 0.040, 0.032, 0.032, 0}});
  AddBothSides(Stretch(leg, kLeftThigh, 0.04, -1, knee), parts);
  AddBothSides(Stretch(leg, kLeftShank, 0.0, knee, 1), parts);
  // The foot's axis lies 35 mm above the floor: u is up, v = axis × up points to the right (inner).
  const Vec3d toes = BoneDirection(kLeftFoot);
  Vec3d sole = rest[kLeftFoot];
  sole[2] = 0.035;
  AddBothSides(Loft(kLeftFoot,
                    0.020,
                    sole,
                    toes,
                    Vec3d::UnitZ(),
                    {{-0.066, 0.012, 0.024, 0.018, 0.018, 0.5},
                     {-0.058, 0.032, 0.038, 0.029, 0.029, 0.6},
                     {-0.030, 0.056, 0.041, 0.036, 0.036, 0.6},
                     {0.020, 0.062, 0.041, 0.038, 0.038, 0.5},
                     {0.060, 0.048, 0.041, 0.039, 0.041, 0.5},
                     {0.110, 0.029, 0.041, 0.045, 0.048, 0.6},
                     {0.150, 0.019, 0.041, 0.046, 0.048, 0.6},
                     {0.185, 0.013, 0.040, 0.041, 0.039, 0.6},
                     {0.207, 0.007, 0.036, 0.030, 0.027, 0.5},
                     {0.216, 0.002, 0.026, 0.016, 0.014, 0.4}}),
               parts);
}

double SmoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

}  // namespace

Shape TemplateShape() {
  const Skeleton skeleton = TemplateSkeleton();
  std::vector<ShapePrimitive> parts;
  AddTrunk(skeleton, parts);
  AddLegParts(skeleton, parts);
  AddArmParts(skeleton, parts);
  AddHand(skeleton.RestPositions()[kLeftHand], parts);
  AddHead(parts);
  return Shape(std::move(parts));
}

double TemplateEdgeLength(const Vec3d& x) {
  constexpr double kBody = 0.012;
  double length = kBody;
  auto refine = [&](double to, double share) {
    length = std::min(length, kBody + (to - kBody) * share);
  };
  refine(0.0070, SmoothStep(1.46, 1.54, x[2]));
  refine(0.0052, SmoothStep(1.50, 1.55, x[2]) * SmoothStep(0.02, 0.07, x[0]));
  refine(0.0085, SmoothStep(0.16, 0.08, x[2]));
  // Along the arm, from the middle of the shoulder.
  const double along =
      BoneDirection(kLeftUpperArm).dot(Vec3d(x[0], std::abs(x[1]) - 0.178, x[2] - 1.40));
  if (std::abs(x[1]) > 0.35) refine(0.0062, SmoothStep(0.50, 0.59, along));
  return length;
}

}  // namespace dyxel
