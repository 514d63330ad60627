#include "dyxel/capture/light.h"

#include <cmath>

#include <gtest/gtest.h>

namespace dyxel {
namespace {

TEST(Light, PointFallsWithTheSquare) {
  Light light;
  light.type = LightType::kPoint;
  light.position = Vec3d(1, 2, 3);
  light.intensity = Rgb(90, 60, 30);
  const Illumination at = Illuminate(light, Vec3f(1, 2, -1));
  EXPECT_FLOAT_EQ(at.distance, 4);
  EXPECT_LT((at.to_light - Vec3f::UnitZ()).norm(), 1e-6F);
  EXPECT_LT((at.irradiance - Rgb(90, 60, 30) / 16).abs().maxCoeff(), 1e-5F);
  EXPECT_EQ(at.cone, 1);
}

TEST(Light, DirectionalIsTheSameEverywhere) {
  Light light;
  light.type = LightType::kDirectional;
  light.direction = Vec3d(0.6, 0, -0.8);
  light.irradiance = Rgb(3, 2, 1);
  const Illumination at = Illuminate(light, Vec3f(100, -20, 3));
  EXPECT_LT((at.to_light - Vec3f(-0.6F, 0, 0.8F)).norm(), 1e-6F);
  EXPECT_TRUE((at.irradiance == Rgb(3, 2, 1)).all());
  EXPECT_TRUE(std::isinf(at.distance));
}

TEST(Light, SpotConeIsASmoothstepInTheCosine) {
  Light light;
  light.type = LightType::kSpot;
  light.position = Vec3d(0, 0, 2);
  light.direction = Vec3d(0, 0, -1);
  light.intensity = Rgb(8, 8, 8);
  light.cone_inner = 0.3;
  light.cone_outer = 0.42;
  for (double angle = 0; angle < 0.6; angle += 0.01) {
    const double radius = 2 * std::tan(angle);
    const Vec3f x(static_cast<float>(radius * 0.6), static_cast<float>(radius * 0.8), 0);
    const double t =
        std::clamp((std::cos(angle) - std::cos(0.42)) / (std::cos(0.3) - std::cos(0.42)), 0.0, 1.0);
    const double cone = t * t * (3 - 2 * t);
    const Illumination at = Illuminate(light, x);
    EXPECT_NEAR(static_cast<double>(at.cone), cone, 2e-5);
    EXPECT_NEAR(static_cast<double>(at.irradiance[1]), cone * 8 / (4 + radius * radius), 1e-4);
  }
  light.cone_inner = light.cone_outer;  // a hard edge
  EXPECT_EQ(Illuminate(light, Vec3f(2 * std::tan(0.419F), 0, 0)).cone, 1);
  EXPECT_EQ(Illuminate(light, Vec3f(2 * std::tan(0.421F), 0, 0)).cone, 0);
}

// An environment whose pixels hold their own direction.
Environment DirectionMap(int width, int height, double rotation, const Vec3d& up) {
  Environment environment;
  environment.rotation = rotation;
  environment.up = up;
  environment.radiance = ImageF(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Vec3f d = environment.Direction((x + 0.5) / width, (y + 0.5) / height);
      for (int c = 0; c < 3; ++c) environment.radiance.At(x, y, c) = d[c];
    }
  }
  return environment;
}

TEST(Environment, DirectionsAsTheFormatSays) {
  Environment environment;
  // The centre is +x, a quarter left of it +y, the top row up.
  EXPECT_LT((environment.Direction(0.5, 0.5) - Vec3f::UnitX()).norm(), 1e-6F);
  EXPECT_LT((environment.Direction(0.25, 0.5) - Vec3f::UnitY()).norm(), 1e-6F);
  EXPECT_LT((environment.Direction(0.3, 0) - Vec3f::UnitZ()).norm(), 1e-6F);
  // Turned counter-clockwise by a quarter, the centre is +y.
  environment.rotation = kPiD / 2;
  EXPECT_LT((environment.Direction(0.5, 0.5) - Vec3f::UnitY()).norm(), 1e-6F);
  for (const double u : {0.1, 0.4, 0.77}) {
    for (const double v : {0.2, 0.5, 0.9}) {
      environment.rotation = 0;
      const Vec3f d = environment.Direction(u, v);
      EXPECT_NEAR(u, 0.5 - std::atan2(d.y(), d.x()) / (2 * kPiD), 1e-6);
      EXPECT_NEAR(v, 0.5 - std::asin(d.z()) / kPiD, 1e-6);
    }
  }
}

// Radiance() and Direction() are inverse to each other, for any rotation and up, over the seam too.
TEST(Environment, RadianceComesFromItsDirection) {
  for (const Vec3d& up : {Vec3d(0, 0, 1), Vec3d(0, 1, 0), Vec3d(0, 0, -1), Vec3d(1, 2, 3)}) {
    const Environment environment = DirectionMap(256, 128, 0.9, up.normalized());
    for (int i = 0; i < 500; ++i) {
      const double z = 0.98 * std::cos(0.7 * i);
      const double a = 1.3 * i;
      const double r = std::sqrt(1 - z * z);
      const Vec3f d = Vec3d(r * std::cos(a), r * std::sin(a), z).cast<float>();
      const float height = static_cast<float>(d.cast<double>().dot(up.normalized()));
      if (std::abs(height) > 0.99F) continue;
      EXPECT_LT((environment.Radiance(d).matrix() - d).norm(), 1e-3F);
    }
    EXPECT_LT((environment.Direction(0.5, 0) - up.normalized().cast<float>()).norm(), 1e-6F);
  }
}

}  // namespace
}  // namespace dyxel
