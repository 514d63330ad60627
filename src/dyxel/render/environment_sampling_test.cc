#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/error.h"
#include "dyxel/base/random.h"
#include "dyxel/render/renderer.h"

namespace dyxel {
namespace {

// A dim sky with a lobe and a small sun, and noise.
Environment Sky() {
  Environment environment;
  environment.radiance = ImageF(128, 64, 3);
  environment.rotation = 0.7;
  const Vec3f sun = Vec3f(0.5F, -0.4F, 0.6F).normalized();
  Random random(5);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 128; ++x) {
      const Vec3f d = environment.Direction((x + 0.5) / 128, (y + 0.5) / 64);
      const float lobe = std::pow(std::max(0.0F, d.dot(sun)), 8.0F);
      const float disc = d.dot(sun) > 0.995F ? 50.0F : 0.0F;
      for (int c = 0; c < 3; ++c) {
        environment.radiance.At(x, y, c) =
            0.1F * random.Uniform() + lobe * (1.0F + static_cast<float>(c)) + disc;
      }
    }
  }
  return environment;
}

// ∫ L dω, ∫ L ω dω of the first channel by fine quadrature over the sphere, from Radiance() alone.
struct Moments {
  double irradiance = 0;
  Vec3d vector = Vec3d::Zero();
};
Moments Integrate(const Environment& environment, int n) {
  Moments m;
  for (int i = 0; i < n; ++i) {
    const double theta = kPiD * (i + 0.5) / n;
    for (int j = 0; j < 2 * n; ++j) {
      const double phi = kPiD * (j + 0.5) / n;
      const Vec3d d(
          std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      const double w = std::sin(theta) * kPiD * kPiD / n / n *
                       static_cast<double>(environment.Radiance(d.cast<float>())[0]);
      m.irradiance += w;
      m.vector += w * d;
    }
  }
  return m;
}

TEST(EnvironmentSamplingTest, ConservesEnergyAndMeanDirection) {
  const Environment sky = Sky();
  const Moments truth = Integrate(sky, 400);
  for (const int count : {1, 16, 64, 256}) {
    const std::vector<Light> lights = SampleEnvironment(sky, count);
    EXPECT_EQ(static_cast<int>(lights.size()), count);
    Moments sampled;
    for (const Light& light : lights) {
      EXPECT_EQ(light.type, LightType::kDirectional);
      EXPECT_NEAR(light.direction.norm(), 1, 1e-6);
      sampled.irradiance += static_cast<double>(light.irradiance[0]);
      sampled.vector -= static_cast<double>(light.irradiance[0]) * light.direction;
    }
    EXPECT_NEAR(sampled.irradiance, truth.irradiance, 2e-3 * truth.irradiance) << count;
    // The spread within a region shortens its mean: less so the more regions there are.
    if (count >= 64) {
      EXPECT_NEAR((sampled.vector - truth.vector).norm(), 0, 0.03 * truth.irradiance) << count;
    }
  }
}

TEST(EnvironmentSamplingTest, IrradianceOfEveryNormalIsNearTheQuadrature) {
  const Environment sky = Sky();
  const std::vector<Light> lights = SampleEnvironment(sky, 256);
  Random random(2);
  for (int k = 0; k < 10; ++k) {
    const Vec3d n = Vec3d(random.Normal(), random.Normal(), random.Normal()).normalized();
    double truth = 0;
    double full = 0;
    const int steps = 200;
    for (int i = 0; i < steps; ++i) {
      const double theta = kPiD * (i + 0.5) / steps;
      for (int j = 0; j < 2 * steps; ++j) {
        const double phi = kPiD * (j + 0.5) / steps;
        const Vec3d d(
            std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
        const double w = std::sin(theta) * kPiD * kPiD / steps / steps *
                         static_cast<double>(sky.Radiance(d.cast<float>())[1]);
        truth += w * std::max(0.0, n.dot(d));
        full += w;
      }
    }
    double sampled = 0;
    for (const Light& light : lights) {
      sampled += static_cast<double>(light.irradiance[1]) * std::max(0.0, -light.direction.dot(n));
    }
    EXPECT_NEAR(sampled, truth, 0.01 * full) << n.transpose();
  }
}

TEST(EnvironmentSamplingTest, ABrightPixelGetsItsOwnLight) {
  Environment environment;
  environment.radiance = ImageF(64, 32, 3, 0.01F);
  for (int c = 0; c < 3; ++c) environment.radiance.At(10, 8, c) = 1000;
  const Vec3f sun = environment.Direction(10.5 / 64, 8.5 / 32);
  double best = 1;
  for (const Light& light : SampleEnvironment(environment, 16)) {
    best = std::min(best, (light.direction + sun.cast<double>()).norm());
  }
  EXPECT_LT(best, 0.01);
}

TEST(EnvironmentSamplingTest, ABlackEnvironmentHasNoLights) {
  Environment environment;
  environment.radiance = ImageF(8, 4, 3);
  EXPECT_TRUE(SampleEnvironment(environment, 16).empty());
  EXPECT_THROW((void)SampleEnvironment(environment, 0), Error);
}

}  // namespace
}  // namespace dyxel
