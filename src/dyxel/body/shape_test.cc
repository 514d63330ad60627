#include "dyxel/body/shape.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/random.h"
#include "dyxel/body/template_parts.h"

namespace dyxel {
namespace {

Vec3d RandomPoint(Random& random, const Vec3d& low, const Vec3d& high) {
  const Vec3d u(random.Uniform(), random.Uniform(), random.Uniform());
  return low + u.cwiseProduct(high - low);
}

TEST(Shape, RoundConeIsExact) {
  ShapePrimitive cone;
  cone.a = {0, 0, 0};
  cone.b = {0, 0, 0.4};
  cone.radius_a = 0.1;
  cone.radius_b = 0.05;
  // The least over the balls that it is the hull of.
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Vec3d x = RandomPoint(random, {-0.3, -0.3, -0.3}, {0.3, 0.3, 0.7});
    double least = 1e9;
    for (int k = 0; k <= 4000; ++k) {
      const double t = k / 4000.0;
      least = std::min(least, (x - cone.b * t).norm() - (0.1 - 0.05 * t));
    }
    EXPECT_NEAR(cone.Distance(x), least, 1e-5);
  }
}

TEST(Shape, EllipsoidAndLoftVanishOnTheirSurfaces) {
  ShapePrimitive ellipsoid;
  ellipsoid.kind = ShapePrimitive::Kind::kEllipsoid;
  ellipsoid.a = {0.1, 0.2, 0.3};
  ellipsoid.radii = {0.05, 0.1, 0.2};
  ShapePrimitive cylinder;  // elliptic, as a loft
  cylinder.kind = ShapePrimitive::Kind::kLoft;
  cylinder.segment = 1;
  cylinder.a = {1, 0, 1};
  cylinder.sections = {{0, 0.1, 0.1, 0.2, 0.2, 0}, {0.5, 0.1, 0.1, 0.2, 0.2, 0}};
  const Shape shape({ellipsoid, cylinder});
  Random random(2);
  for (int i = 0; i < 100; ++i) {
    const Vec3d u = RandomPoint(random, {-1, -1, -1}, {1, 1, 1}).normalized();
    const Vec3d on = ellipsoid.a + u.cwiseProduct(ellipsoid.radii);
    EXPECT_NEAR(shape.SegmentDistance(0, on), 0, 1e-12);
    // To first order it is the distance.
    const Vec3d normal = u.cwiseQuotient(ellipsoid.radii).normalized();
    EXPECT_NEAR(shape.SegmentDistance(0, on + 1e-4 * normal), 1e-4, 1e-6);
    const double angle = 2 * kPiD * static_cast<double>(random.Uniform());
    EXPECT_NEAR(
        shape.SegmentDistance(
            1, Vec3d(1 + 0.1 * std::cos(angle), 0.2 * std::sin(angle), 1.1 + 0.3 * u[2] * u[2])),
        0,
        1e-12);
  }
  EXPECT_NEAR(shape.SegmentDistance(1, {1, 0, 0.7}), 0.3, 1e-12);  // below its end
}

// What the search leaves out must change nothing.
TEST(Shape, SkippingChangesNothing) {
  const Shape shape = TemplateShape();
  auto smooth_min = [](double a, double b, double k) {
    if (k <= 0) return std::min(a, b);
    const double h = std::max(k - std::abs(a - b), 0.0) / k;
    return std::min(a, b) - h * h * k / 4;
  };
  Random random(3);
  for (int i = 0; i < 20000; ++i) {
    const Vec3d x = RandomPoint(random, {-0.2, -0.7, 0.0}, {0.3, 0.7, 1.8});
    double d = 1e3;
    for (const ShapePrimitive& part : shape.primitives()) {
      d = part.op == ShapePrimitive::Op::kJoin ? smooth_min(d, part.Distance(x), part.blend)
                                               : -smooth_min(-d, part.Distance(x), part.blend);
    }
    EXPECT_NEAR(shape.Distance(x), -smooth_min(-d, x[2], 0.006), 1e-12);
  }
}

// From 3 mm away, as far as relaxing moves a vertex; in creases Newton may leave a little.
TEST(Shape, ProjectionLandsOnTheSurface) {
  const Shape shape = TemplateShape();
  Random random(4);
  int checked = 0;
  int missed = 0;
  for (int i = 0; i < 40000; ++i) {
    const Vec3d x = RandomPoint(random, {-0.2, -0.7, 0.05}, {0.3, 0.7, 1.8});
    if (std::abs(shape.Distance(x)) > 0.003) continue;
    const Vec3d y = shape.Project(x, 4);
    missed += std::abs(shape.Distance(y)) > 5e-5 ? 1 : 0;
    EXPECT_LT((y - x).norm(), 0.012);
    ++checked;
  }
  EXPECT_GT(checked, 300);
  EXPECT_LT(missed, 0.05 * checked);
}

TEST(Shape, MirroredIsTheOtherSide) {
  const Shape shape = TemplateShape();
  Random random(5);
  for (int i = 0; i < 2000; ++i) {
    const Vec3d x = RandomPoint(random, {-0.2, -0.7, 0.0}, {0.3, 0.7, 1.8});
    const Vec3d image(x[0], -x[1], x[2]);
    for (int segment = 0; segment < kNumSegments; ++segment) {
      EXPECT_NEAR(shape.SegmentDistance(segment, x),
                  shape.SegmentDistance(MirrorSegment(segment), image),
                  1e-12);
    }
    EXPECT_NEAR(shape.Distance(x), shape.Distance(image), 2e-3);  // smooth joints keep an order
  }
}

}  // namespace
}  // namespace dyxel
