#include "dyxel/body/shape.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace dyxel {
namespace {

constexpr double kFloorBlend = 0.006;
constexpr std::size_t kMaxPrimitives = 255;

double SmoothMin(double a, double b, double k) {
  if (k <= 0) return std::min(a, b);
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k * 0.25;
}

double SmoothMax(double a, double b, double k) { return -SmoothMin(-a, -b, k); }

double Square(double x) { return x * x; }

// Quilez, "Round cone": exact.
double RoundConeDistance(const ShapePrimitive& s, const Vec3d& x) {
  const Vec3d ba = s.b - s.a;
  const double l2 = ba.squaredNorm();
  const double rr = s.radius_a - s.radius_b;
  const double a2 = l2 - rr * rr;
  const double il2 = 1 / l2;
  const Vec3d pa = x - s.a;
  const double y = pa.dot(ba);
  const double z = y - l2;
  const double x2 = (pa * l2 - ba * y).squaredNorm();
  const double y2 = y * y * l2;
  const double z2 = z * z * l2;
  const double k = (rr < 0 ? -1.0 : 1.0) * rr * rr * x2;
  if ((z < 0 ? -1.0 : 1.0) * a2 * z2 > k) return std::sqrt(x2 + z2) * il2 - s.radius_b;
  if ((y < 0 ? -1.0 : 1.0) * a2 * y2 < k) return std::sqrt(x2 + y2) * il2 - s.radius_a;
  return (std::sqrt(x2 * a2 * il2) + y * rr) * il2 - s.radius_a;
}

// Quilez, "Ellipsoid": first order.
double EllipsoidDistance(const ShapePrimitive& s, const Vec3d& x) {
  const Vec3d q = s.frame.transpose() * (x - s.a);
  const double k0 = q.cwiseQuotient(s.radii).norm();
  const double k1 = q.cwiseQuotient(s.radii.cwiseProduct(s.radii)).norm();
  if (k1 < 1e-9) return -s.radii.minCoeff();
  return k0 * (k0 - 1) / k1;
}

// Cubic Hermite between the stations around `at`.
LoftSection SectionAt(const ShapePrimitive& s, double at) {
  const std::vector<LoftSection>& k = s.sections;
  std::size_t i = 0;
  while (i + 2 < k.size() && at > k[i + 1].at) ++i;
  const double h = k[i + 1].at - k[i].at;
  const double t = (at - k[i].at) / h;
  const double h00 = (1 + 2 * t) * Square(1 - t);
  const double h10 = t * Square(1 - t) * h;
  const double h01 = t * t * (3 - 2 * t);
  const double h11 = t * t * (t - 1) * h;
  auto blend = [&](double LoftSection::*f) {
    return h00 * k[i].*f + h10 * s.slopes[i].*f + h01 * k[i + 1].*f + h11 * s.slopes[i + 1].*f;
  };
  return {at,
          blend(&LoftSection::front),
          blend(&LoftSection::back),
          blend(&LoftSection::left),
          blend(&LoftSection::right),
          blend(&LoftSection::square)};
}

// Distance along the ray from the axis, with the caps of a solid of revolution.
double LoftDistance(const ShapePrimitive& s, const Vec3d& x) {
  const Vec3d q = s.frame.transpose() * (x - s.a);
  const LoftSection c = SectionAt(s, std::clamp(q[2], s.first, s.last));
  const double u2 = Square(q[0] / (q[0] > 0 ? c.front : c.back));
  const double v2 = Square(q[1] / (q[1] > 0 ? c.left : c.right));
  const double round = std::sqrt(u2 + v2);
  const double boxy = std::sqrt(std::sqrt(u2 * u2 + v2 * v2));
  const double rho = round + c.square * (boxy - round);
  const double r = std::sqrt(q[0] * q[0] + q[1] * q[1]);
  const double radial =
      rho < 1e-9 ? -std::min(std::min(c.front, c.back), std::min(c.left, c.right)) : r - r / rho;
  const double beyond = std::max(s.first - q[2], q[2] - s.last);
  if (beyond <= 0) return std::max(radial, beyond);
  return radial <= 0 ? beyond : std::sqrt(radial * radial + beyond * beyond);
}

void Prepare(ShapePrimitive& s) {
  switch (s.kind) {
    case ShapePrimitive::Kind::kRoundCone:
      s.bound_center = (s.a + s.b) / 2;
      s.bound_radius = (s.a - s.b).norm() / 2 + std::max(s.radius_a, s.radius_b);
      break;
    case ShapePrimitive::Kind::kEllipsoid:
      s.bound_center = s.a;
      s.bound_radius = s.radii.maxCoeff();
      {
        // Along a ray u the formula grows by |u/r|² / |u/r²|; Kantorovich's inequality bounds that.
        const double flatness = s.radii.minCoeff() / s.radii.maxCoeff();
        s.bound_slope = 2 * flatness / (1 + flatness * flatness);
      }
      break;
    case ShapePrimitive::Kind::kLoft: {
      const std::size_t n = s.sections.size();
      double widest = 0;
      s.slopes.assign(n, {});
      for (std::size_t i = 0; i < n; ++i) {
        const LoftSection& c = s.sections[i];
        widest = std::max(widest, std::hypot(std::max(c.front, c.back), std::max(c.left, c.right)));
        const LoftSection& before = s.sections[i > 0 ? i - 1 : 0];
        const LoftSection& after = s.sections[i + 1 < n ? i + 1 : n - 1];
        for (double LoftSection::*f : {&LoftSection::front,
                                       &LoftSection::back,
                                       &LoftSection::left,
                                       &LoftSection::right,
                                       &LoftSection::square}) {
          s.slopes[i].*f = (after.*f - before.*f) / (after.at - before.at);
        }
      }
      s.first = std::max(s.first, s.sections.front().at);
      s.last = std::min(s.last, s.sections.back().at);
      s.bound_center = s.a + s.frame.col(2) * (s.first + s.last) / 2;
      // The cubic may overshoot its stations a little.
      s.bound_radius = std::hypot((s.last - s.first) / 2, 1.1 * widest);
      break;
    }
  }
}

// Joins or carves the primitive at a point where the others so far give `d`.
double Add(const ShapePrimitive& s, double d, const Vec3d& x) {
  return s.op == ShapePrimitive::Op::kJoin ? SmoothMin(d, s.Distance(x), s.blend)
                                           : SmoothMax(d, -s.Distance(x), s.blend);
}

}  // namespace

double ShapePrimitive::Distance(const Vec3d& x) const {
  switch (kind) {
    case Kind::kRoundCone:
      return RoundConeDistance(*this, x);
    case Kind::kEllipsoid:
      return EllipsoidDistance(*this, x);
    case Kind::kLoft:
      return LoftDistance(*this, x);
  }
  return 0;
}

Shape::Shape(std::vector<ShapePrimitive> primitives) : primitives_(std::move(primitives)) {
  assert(primitives_.size() <= kMaxPrimitives);
  const auto n = static_cast<Eigen::Index>(primitives_.size());
  for (Eigen::ArrayXd* array : {&ball_x_, &ball_y_, &ball_z_, &ball_radius_, &ball_slope_}) {
    array->resize(n);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    ShapePrimitive& primitive = primitives_[static_cast<std::size_t>(i)];
    Prepare(primitive);
    ball_x_[i] = primitive.bound_center[0];
    ball_y_[i] = primitive.bound_center[1];
    ball_z_[i] = primitive.bound_center[2];
    ball_radius_[i] = primitive.bound_radius;
    ball_slope_[i] = primitive.bound_slope;
  }
}

// A primitive is skipped only where it would change nothing.
double Shape::DistanceAndNear(const Vec3d& x, Near* near) const {
  constexpr double kSlack = 0.002;
  using Bounds =
      Eigen::Array<double, Eigen::Dynamic, 1, Eigen::ColMajor, static_cast<int>(kMaxPrimitives)>;
  const Bounds bounds =
      0.5 *
      (((ball_x_ - x[0]).square() + (ball_y_ - x[1]).square() + (ball_z_ - x[2]).square()).sqrt() -
       ball_radius_);
  double d = 1e3;
  for (std::size_t i = 0; i < primitives_.size(); ++i) {
    const ShapePrimitive& s = primitives_[i];
    const double bound = bounds[static_cast<Eigen::Index>(i)];
    const double reach = s.blend + (s.op == ShapePrimitive::Op::kJoin ? d : -d) + kSlack;
    if (bound > 0 && bound >= reach) continue;
    d = Add(s, d, x);
    if (near != nullptr) near->indices[near->count++] = static_cast<unsigned char>(i);
  }
  return SmoothMax(d, -x[2], kFloorBlend);
}

double Shape::DistanceOf(const Near& near, const Vec3d& x) const {
  double d = 1e3;
  for (std::size_t i = 0; i < near.count; ++i) d = Add(primitives_[near.indices[i]], d, x);
  return SmoothMax(d, -x[2], kFloorBlend);
}

Vec3d Shape::GradientOf(const Near& near, const Vec3d& x) const {
  constexpr double kStep = 2e-4;
  static const std::array<Vec3d, 4> kCorners = {
      Vec3d(1, -1, -1), Vec3d(-1, -1, 1), Vec3d(-1, 1, -1), Vec3d(1, 1, 1)};
  Vec3d sum = Vec3d::Zero();
  for (const Vec3d& corner : kCorners) sum += corner * DistanceOf(near, x + kStep * corner);
  return sum / (4 * kStep);
}

double Shape::Distance(const Vec3d& x) const { return DistanceAndNear(x, nullptr); }

Vec3d Shape::Gradient(const Vec3d& x) const {
  Near near;
  DistanceAndNear(x, &near);
  return GradientOf(near, x);
}

Vec3d Shape::Project(const Vec3d& x, int steps) const {
  Vec3d y = x;
  for (int i = 0; i < steps; ++i) {
    Near near;
    const double d = DistanceAndNear(y, &near);
    if (std::abs(d) < 2e-6) break;
    const Vec3d g = GradientOf(near, y);
    const double g2 = g.squaredNorm();
    if (g2 < 1e-4) break;
    Vec3d step = g * (-d / g2);
    const double length = step.norm();
    if (length > 0.02) step *= 0.02 / length;
    y += step;
  }
  return y;
}

double Shape::SegmentDistance(int segment, const Vec3d& x) const {
  double d = 1e3;
  for (const ShapePrimitive& s : primitives_) {
    if (s.segment != segment || s.op != ShapePrimitive::Op::kJoin) continue;
    d = std::min(d, s.Distance(x));
  }
  return d;
}

ShapePrimitive Mirrored(const ShapePrimitive& primitive, int segment) {
  ShapePrimitive m = primitive;
  m.segment = segment;
  m.a[1] = -m.a[1];
  m.b[1] = -m.b[1];
  m.frame.row(1) = -m.frame.row(1);
  return m;
}

}  // namespace dyxel
