#include "dyxel/studio/optics.h"

#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/random.h"

namespace dyxel::studio {
namespace {

// capture-format.md: x_cam = R x + t, OpenCV axes, pixel = f x/z + c.
TEST(StudioOptics, RaysPassThroughProjectedPoints) {
  const Camera camera = AimCamera("c", {2.0, -1.5, 1.2}, {0.1, 0.2, 0.9}, 400, 1.3);
  const PinholeRays rays(camera);
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const Vec3d x(random.Uniform() - 0.5, random.Uniform() - 0.5, 2 * random.Uniform());
    const Vec3d in_cam = camera.cam_from_world.rotation * x + camera.cam_from_world.translation;
    const double u = camera.fx * in_cam.x() / in_cam.z() + camera.cx;
    const double v = camera.fy * in_cam.y() / in_cam.z() + camera.cy;
    const Vec3d along = rays.Direction(static_cast<float>(u), static_cast<float>(v)).cast<double>();
    const Vec3d to_point = x - rays.origin().cast<double>();
    EXPECT_LT((to_point - along * along.dot(to_point)).norm(), 2e-6);
    EXPECT_GT(along.dot(to_point), 0);
  }
  // The world's up is up in the picture (y down), and the rotation is one.
  EXPECT_LT((camera.cam_from_world.rotation * Vec3d::UnitZ()).y(), -0.5);
  EXPECT_NEAR(camera.cam_from_world.rotation.determinant(), 1, 1e-12);
}

TEST(StudioOptics, SpotFallsWithDistanceAndCone) {
  const Light spot = AimSpot("s", {0, 0, 2}, {0, 0, 0}, Rgb(4, 8, 12), 0.3, 0.5);
  EXPECT_NEAR(LampAt(spot, {0, 0, 0}).irradiance[1], 2.0F, 1e-6F);
  // Half-way between the cone's cosines the smoothstep is one half.
  const double cosine = 0.5 * (std::cos(0.3) + std::cos(0.5));
  const double angle = std::acos(cosine);
  const auto beside = static_cast<float>(2 * std::tan(angle));
  const LampRay at = LampAt(spot, {beside, 0, 0});
  EXPECT_NEAR(at.irradiance[1], 0.5 * 8 * cosine * cosine / 4, 1e-4);
  EXPECT_EQ(LampAt(spot, {2, 0, 0}).irradiance[1], 0);
}

// The file's centre is +x, a quarter left of it +y, the top +z; rotation turns counter-clockwise.
TEST(StudioOptics, EnvironmentFollowsTheFormat) {
  ImageF map(64, 32, 3);
  const auto paint = [&](int x, int y, int channel) {
    for (int v = y - 2; v < y + 2; ++v) {
      for (int u = x - 2; u < x + 2; ++u) map.At(u, v, channel) = 1;
    }
  };
  paint(32, 16, 0);
  paint(16, 16, 1);
  for (int x = 0; x < 64; ++x) map.At(x, 0, 2) = map.At(x, 1, 2) = 1;
  const StudioEnvironment still(map, 0);
  EXPECT_NEAR(still.Lookup(Vec3f::UnitX())[0], 1, 1e-5F);
  EXPECT_NEAR(still.Lookup(Vec3f::UnitY())[1], 1, 1e-5F);
  EXPECT_NEAR(still.Lookup(Vec3f::UnitZ())[2], 1, 1e-5F);
  const StudioEnvironment turned(map, kPiD / 2);
  EXPECT_NEAR(turned.Lookup(Vec3f::UnitY())[0], 1, 1e-5F);
  EXPECT_NEAR(turned.Lookup(-Vec3f::UnitX())[1], 1, 1e-5F);
}

TEST(StudioOptics, EnvironmentSamplesEstimateItsIntegral) {
  const StudioEnvironment environment(MakeEnvironmentMap(64), 0.4);
  const ImageF& map = environment.radiance();
  double exact = 0;  // Σ luminance · solid angle, green only
  for (int y = 0; y < map.height; ++y) {
    const double area = 2 * kPiD / map.width *
                        (std::cos(kPiD * y / map.height) - std::cos(kPiD * (y + 1) / map.height));
    for (int x = 0; x < map.width; ++x) exact += static_cast<double>(map.At(x, y, 1)) * area;
  }
  Random random(5);
  double sum = 0;
  constexpr int kSamples = 100000;
  for (int i = 0; i < kSamples; ++i) {
    const float u = random.Uniform();
    const StudioEnvironment::Sample s = environment.Draw(u, random.Uniform());
    EXPECT_NEAR(s.direction.norm(), 1, 1e-4F);
    sum += static_cast<double>(environment.Lookup(s.direction)[1] / s.pdf);
  }
  EXPECT_NEAR(sum / kSamples / exact, 1, 0.01);
}

}  // namespace
}  // namespace dyxel::studio
