#include "dyxel/studio/brdf.h"

#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/random.h"

namespace dyxel {
namespace {

Vec3f OnHemisphere(Random& random) {
  const float z = random.Uniform();
  const float a = 2 * kPi * random.Uniform();
  const float r = std::sqrt(1 - z * z);
  return {r * std::cos(a), r * std::sin(a), z};
}

TEST(StudioBrdf, FresnelHasItsClosedForms) {
  const float n = 1.5F;
  EXPECT_NEAR(DielectricFresnel(1, n), 0.04F, 1e-6F);
  EXPECT_NEAR(DielectricFresnel(0, n), 1.0F, 1e-5F);
  // At Brewster's angle only the perpendicular half is left: ½ ((n² − 1) / (n² + 1))².
  const float brewster = std::cos(std::atan(n));
  EXPECT_NEAR(
      DielectricFresnel(brewster, n), 0.5F * std::pow((n * n - 1) / (n * n + 1), 2.0F), 1e-6F);
}

TEST(StudioBrdf, IsReciprocal) {
  Random random(3);
  const StudioMaterial m{.albedo = Rgb(0.2F, 0.5F, 0.7F), .roughness = 0.4F};
  for (int i = 0; i < 200; ++i) {
    const Vec3f l = OnHemisphere(random);
    const Vec3f v = OnHemisphere(random);
    const StudioBrdfValue a = EvaluateStudioBrdf(m, Vec3f::UnitZ(), l, v);
    const StudioBrdfValue b = EvaluateStudioBrdf(m, Vec3f::UnitZ(), v, l);
    EXPECT_NEAR(a.specular, b.specular, 1e-4F * (1 + a.specular));
    EXPECT_LT((a.diffuse - b.diffuse).abs().maxCoeff(), 1e-5F);
  }
}

// What a rough mirror (F ≈ 1) reflects in all, against an estimate that draws facets instead of
// directions: E[G2 v·h / (n·v n·h)] over h of density D n·h (Walter et al. 2007, eq. 41).
TEST(StudioBrdf, SpecularLobeKeepsItsEnergy) {
  Random random(4);
  const StudioMaterial m{.albedo = Rgb::Zero(), .roughness = 0.5F, .ior = 1e5F};
  const double a2 = std::pow(0.5, 4);
  const auto lambda = [&](double c) {
    return 0.5 * (std::sqrt(1 + a2 * (1 - c * c) / (c * c)) - 1);
  };
  for (const float cosine : {1.0F, 0.7F, 0.4F}) {
    const Vec3f v(std::sqrt(1 - cosine * cosine), 0, cosine);
    double sum = 0;
    double reference = 0;
    constexpr int kSamples = 400000;
    for (int i = 0; i < kSamples; ++i) {
      const Vec3f l = OnHemisphere(random);
      sum += static_cast<double>(EvaluateStudioBrdf(m, Vec3f::UnitZ(), l, v).specular * l.z());

      const double u = static_cast<double>(random.Uniform());
      const double c = std::sqrt((1 - u) / (1 - u + a2 * u));
      const double s = std::sqrt(1 - c * c);
      const double turn = 2 * kPiD * static_cast<double>(random.Uniform());
      const Vec3d h(s * std::cos(turn), s * std::sin(turn), c);
      const double vh = v.cast<double>().dot(h);
      const Vec3d mirrored = 2 * vh * h - v.cast<double>();
      if (vh <= 0 || mirrored.z() <= 0) continue;
      const double nv = static_cast<double>(v.z());
      reference += vh / (nv * c) / (1 + lambda(nv) + lambda(mirrored.z()));
    }
    const double reflected = 2 * kPiD * sum / kSamples;
    EXPECT_NEAR(reflected, reference / kSamples, 0.01) << cosine;
    EXPECT_LT(reflected, 1);
    EXPECT_GT(reflected, 0.8);
  }
}

TEST(StudioBrdf, LambertAndBurleyAgreeWithTheirFormulas) {
  const Vec3f n = Vec3f::UnitZ();
  StudioMaterial m{.albedo = Rgb::Constant(0.6F), .roughness = 0.5F, .burley = false};
  EXPECT_NEAR(EvaluateStudioBrdf(m, n, n, n).diffuse[1], 0.6F / kPi, 1e-6F);
  m.burley = true;  // at normal incidence Burley's lobe is Lambert's
  EXPECT_NEAR(EvaluateStudioBrdf(m, n, n, n).diffuse[1], 0.6F / kPi, 1e-6F);
  // Retro-reflection at 60°: F_D90 = 0.5 + 2 · 0.5 = 1.5, (1 − ½)⁵ = 1/32.
  const Vec3f l(std::sqrt(0.75F), 0, 0.5F);
  const float factor = 1 + 0.5F / 32;
  EXPECT_NEAR(EvaluateStudioBrdf(m, n, l, l).diffuse[1], 0.6F / kPi * factor * factor, 1e-5F);
  EXPECT_EQ(EvaluateStudioBrdf(m, n, -l, l).specular, 0);
}

}  // namespace
}  // namespace dyxel
