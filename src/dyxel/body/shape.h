// A body's shape as one signed-distance field: primitives of named segments, smoothly joined.
//
// Only +, −, ×, ÷ and square roots are used, so that the field has the same bits on every machine
// that runs the same program. The smooth joint: docs/method.md (B1).
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel {

// A cross section of a Loft: half extents in metres along +u, −u, +v, −v.
struct LoftSection {
  double at = 0;  // metres along the axis
  double front = 0, back = 0, left = 0, right = 0;
  double square = 0;  // 0: ellipse, 1: the superellipse of exponent 4
};

// One primitive, negative inside.
struct ShapePrimitive {
  enum class Kind { kRoundCone, kEllipsoid, kLoft };
  enum class Op { kJoin, kCarve };
  Kind kind = Kind::kRoundCone;
  Op op = Op::kJoin;
  int segment = 0;   // the joint that moves it
  double blend = 0;  // metres within which it melts into what comes before it

  // Round cone: from `a` (radius_a) to `b` (radius_b).
  // Ellipsoid: centre `a`, half axes `radii` along the columns of `frame`.
  // Loft: origin `a`, axis frame.col(2), u = frame.col(0), v = frame.col(1), `sections`, of which
  // the stretch from `first` to `last`: several segments may share one profile without a joint.
  Vec3d a = Vec3d::Zero(), b = Vec3d::Zero();
  double radius_a = 0, radius_b = 0;
  Vec3d radii = Vec3d::Zero();
  Mat3d frame = Mat3d::Identity();
  std::vector<LoftSection> sections;
  double first = -1e3, last = 1e3;
  std::vector<LoftSection> slopes;  // of the sections, per metre; set by Shape

  Vec3d bound_center = Vec3d::Zero();  // of a ball around it; set by Shape
  double bound_radius = 0;
  double bound_slope = 1;  // Distance is at least this times the distance to that ball

  // A signed distance to first order at the surface: exact for round cones, at least the true one
  // for lofts (measured across the axis).
  [[nodiscard]] double Distance(const Vec3d& x) const;
};

// The primitives in their order, joined or carved one after the other with the polynomial smooth
// minimum (Quilez 2013), cut off at the floor z = 0.
class Shape {
 public:
  explicit Shape(std::vector<ShapePrimitive> primitives);

  [[nodiscard]] const std::vector<ShapePrimitive>& primitives() const { return primitives_; }
  // Signed distance (approximately) of the whole, metres, negative inside.
  [[nodiscard]] double Distance(const Vec3d& x) const;
  // Its gradient by differences of 0.4 mm.
  [[nodiscard]] Vec3d Gradient(const Vec3d& x) const;
  // The point of the surface near `x`: at most `steps` of Newton along the gradient, 20 mm each.
  [[nodiscard]] Vec3d Project(const Vec3d& x, int steps = 3) const;
  // Distance of the joined primitives of one segment alone.
  [[nodiscard]] double SegmentDistance(int segment, const Vec3d& x) const;

 private:
  // The primitives that matter within 1 mm of a point.
  struct Near {
    std::array<unsigned char, 255> indices{};
    std::size_t count = 0;
  };
  double DistanceAndNear(const Vec3d& x, Near* near) const;
  [[nodiscard]] double DistanceOf(const Near& near, const Vec3d& x) const;
  [[nodiscard]] Vec3d GradientOf(const Near& near, const Vec3d& x) const;

  std::vector<ShapePrimitive> primitives_;
  Eigen::ArrayXd ball_x_, ball_y_, ball_z_, ball_radius_, ball_slope_;  // the primitives' bounds
};

// The mirror image in the plane y = 0, belonging to `segment`.
[[nodiscard]] ShapePrimitive Mirrored(const ShapePrimitive& primitive, int segment);

}  // namespace dyxel
