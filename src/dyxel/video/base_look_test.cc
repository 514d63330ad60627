#include "dyxel/video/base_look.h"

#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/error.h"

namespace dyxel {
namespace {

Material Make(const std::vector<float>& specular, float albedo = 0.3F) {
  return {"m", specular, Rgb::Constant(albedo), 1};
}

TEST(BaseLookTest, GgxKeepsItsRoughnessAndFresnel) {
  const Material a = Make({0.45F, 0.04F});
  const Material b = Make({0.7F, 0.02F});
  const std::vector<Material> materials = {a, b};
  const BaseLooks looks = FitBaseLooks("ggx", materials);
  ASSERT_EQ(looks.looks.size(), 2U);
  EXPECT_NEAR(std::pow((looks.ior - 1) / (looks.ior + 1), 2), 0.04, 1e-6);
  EXPECT_FLOAT_EQ(looks.looks[0].roughness, 0.45F);
  EXPECT_NEAR(looks.looks[0].specular, 1, 1e-6);
  EXPECT_FLOAT_EQ(looks.looks[1].roughness, 0.7F);
  EXPECT_NEAR(looks.looks[1].specular, 0.5, 1e-6);
  // Burley's diffuse at roughness 0.45 lies a little below Lambert's towards grazing angles.
  EXPECT_NEAR(looks.looks[0].diffuse_gain, 1, 0.15);
}

// ∫ n·l f dω by quadrature for light at `theta`, azimuth against the view at phi.
double PhongAlbedo(double k_s, double m, double theta) {
  double sum = 0;
  const int n = 400;
  for (int i = 0; i < n; ++i) {
    const double n_v = (i + 0.5) / n;
    const double sin_v = std::sqrt(1 - n_v * n_v);
    for (int j = 0; j < n; ++j) {
      const double phi = 2 * kPiD * (j + 0.5) / n;
      const double l_v = std::cos(theta) * n_v + std::sin(theta) * sin_v * std::cos(phi);
      const double r_v = std::max(0.0, 2 * std::cos(theta) * n_v - l_v);
      sum += n_v * k_s * (m + 2) / (2 * kPiD) * std::pow(r_v, m) * 2 * kPiD / n / n;
    }
  }
  return sum;
}
double BaseAlbedo(const BaseLook& look, double f0, double theta) {
  double sum = 0;
  const int n = 400;
  for (int i = 0; i < n; ++i) {
    const double n_v = (i + 0.5) / n;
    const double sin_v = std::sqrt(1 - n_v * n_v);
    for (int j = 0; j < n; ++j) {
      const double phi = 2 * kPiD * (j + 0.5) / n;
      const double l_v = std::cos(theta) * n_v + std::sin(theta) * sin_v * std::cos(phi);
      sum += n_v * 2 * kPiD / n / n *
             EvaluateBaseLook(static_cast<double>(look.roughness),
                              static_cast<double>(look.specular),
                              f0,
                              std::cos(theta),
                              n_v,
                              l_v)
                 .specular;
    }
  }
  return sum;
}

TEST(BaseLookTest, PhongLobesKeepTheirEnergyAndSharpness) {
  float last_roughness = 1;
  for (const float m : {10.0F, 20.0F, 80.0F}) {
    const std::vector<Material> materials = {Make({0.1F, m})};
    const BaseLooks looks = FitBaseLooks("phong", materials);
    const BaseLook& look = looks.looks[0];
    const auto ior = static_cast<double>(looks.ior);
    const double f0 = std::pow((ior - 1) / (ior + 1), 2);
    EXPECT_LT(look.roughness, last_roughness);
    last_roughness = look.roughness;
    const double phong = PhongAlbedo(0.1, static_cast<double>(m), 0.5);
    EXPECT_NEAR(BaseAlbedo(look, f0, 0.5), phong, 0.3 * phong) << m;
    EXPECT_LT(look.rms, 0.05F) << m;
  }
}

TEST(BaseLookTest, NoSpecularNeedsNone) {
  const std::vector<Material> materials = {Make({0.0F, 20.0F})};
  const BaseLooks looks = FitBaseLooks("phong", materials);
  const auto ior = static_cast<double>(looks.ior);
  const double f0 = std::pow((ior - 1) / (ior + 1), 2);
  EXPECT_LT(static_cast<double>(looks.looks[0].specular) * f0, 1e-3);
  EXPECT_NEAR(looks.looks[0].diffuse_gain, 1, 0.03);
  EXPECT_LT(looks.looks[0].rms, 0.005F);
}

TEST(BaseLookTest, RefusesWhatTheTableLacks) {
  const std::vector<Material> materials = {Make({0.1F})};
  EXPECT_THROW((void)FitBaseLooks("phong", materials), Error);
  EXPECT_THROW((void)FitBaseLooks("velvet", materials), Error);
}

}  // namespace
}  // namespace dyxel
