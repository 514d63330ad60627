#include "dyxel/reflectance/fit.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/parallel.h"
#include "dyxel/reflectance/synthetic_dyxels.h"

namespace dyxel {
namespace {

Reflectance Fit(const SyntheticOptions& synthetic, const ReflectanceOptions& options = {}) {
  return FitReflectance(
      MakeSyntheticSource(synthetic), MakeGridGraph(synthetic.width, synthetic.height), options);
}

double AlbedoRms(const Reflectance& fit, const SyntheticTruth& truth) {
  double sum = 0;
  int count = 0;
  for (std::size_t x = 0; x < truth.material.size(); ++x) {
    if (fit.filled[x] != 0) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      sum += std::pow(static_cast<double>(fit.diffuse[c][x]) - truth.diffuse[c][x], 2);
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

double NormalRmsDeg(const Reflectance& fit, const SyntheticTruth& truth) {
  double sum = 0;
  int count = 0;
  for (std::size_t x = 0; x < truth.material.size(); ++x) {
    if (fit.filled[x] != 0) continue;
    sum += std::pow(std::acos(std::min(1.0, fit.normal[x].cast<double>().dot(truth.normal[x]))), 2);
    ++count;
  }
  return std::sqrt(sum / count) * 180 / kPiD;
}

TEST(FitReflectance, RecoversGgxFromNoiseFreeSamples) {
  const SyntheticOptions synthetic;
  const SyntheticTruth truth = MakeSyntheticTruth(synthetic);
  const Reflectance fit = Fit(synthetic, {.materials = 2, .second_pass = false});
  ASSERT_EQ(fit.materials.size(), 2U);
  for (std::size_t x = 0; x < truth.material.size(); ++x) {
    const auto& specular =
        synthetic.materials[static_cast<std::size_t>(truth.material[x])].specular;
    EXPECT_NEAR(fit.specular[0][x], specular[0], 2e-3);
    EXPECT_NEAR(fit.specular[1][x], specular[1], 5e-4);
  }
  EXPECT_LT(AlbedoRms(fit, truth), 5e-4);
}

TEST(FitReflectance, RecoversPhongFromNoiseFreeSamples) {
  SyntheticOptions synthetic;
  synthetic.model = "phong";
  synthetic.materials[0].specular = {0.1, 12};
  synthetic.materials[1].specular = {0.05, 30};
  const SyntheticTruth truth = MakeSyntheticTruth(synthetic);
  const Reflectance fit = Fit(synthetic, {.model = "phong", .materials = 2, .second_pass = false});
  for (std::size_t x = 0; x < truth.material.size(); ++x) {
    const auto& specular =
        synthetic.materials[static_cast<std::size_t>(truth.material[x])].specular;
    EXPECT_NEAR(fit.specular[0][x], specular[0], 2e-3);
    EXPECT_NEAR(fit.specular[1][x] / specular[1], 1, 0.02);
  }
  EXPECT_LT(AlbedoRms(fit, truth), 1e-3);
}

TEST(FitReflectance, RecoversNormalsAndReflectanceUnderNoise) {
  SyntheticOptions synthetic;
  synthetic.bumps = 0.12;
  synthetic.noise = 0.03;
  const SyntheticTruth truth = MakeSyntheticTruth(synthetic);
  const Reflectance flat = Fit(synthetic, {.materials = 2, .second_pass = false});
  const Reflectance fit = Fit(synthetic, {.materials = 2, .rounds = 2});
  const double before = NormalRmsDeg(flat, truth);
  const double after = NormalRmsDeg(fit, truth);
  EXPECT_GT(before, 8);
  EXPECT_LT(after, 3);
  EXPECT_LT(AlbedoRms(fit, truth), 0.7 * AlbedoRms(flat, truth));
  for (const Material& material : fit.materials) {
    EXPECT_NEAR(material.specular[1], 0.035, 0.012);
  }
}

TEST(FitReflectance, SurvivesOutliers) {
  SyntheticOptions synthetic;
  synthetic.noise = 0.02;
  synthetic.outliers = 0.1;
  const SyntheticTruth truth = MakeSyntheticTruth(synthetic);
  const Reflectance robust = Fit(synthetic, {.materials = 2, .second_pass = false});
  const Reflectance plain = Fit(synthetic, {.materials = 2, .second_pass = false, .robust = 0});
  EXPECT_LT(AlbedoRms(robust, truth), 0.008);
  EXPECT_LT(AlbedoRms(robust, truth), 0.5 * AlbedoRms(plain, truth));
}

TEST(FitReflectance, DoesNotDependOnTheExposure) {
  SyntheticOptions synthetic;
  synthetic.bumps = 0.1;
  synthetic.noise = 0.05;
  const Reflectance once = Fit(synthetic);
  synthetic.exposure = 100;
  const Reflectance bright = Fit(synthetic);  // up to rounding
  synthetic.exposure = 128;
  const Reflectance shifted = Fit(synthetic);  // scaling by 2ⁿ rounds nothing
  EXPECT_EQ(once.diffuse, shifted.diffuse);
  EXPECT_EQ(once.normal, shifted.normal);
  ASSERT_EQ(once.materials.size(), bright.materials.size());
  EXPECT_EQ(once.material, bright.material);
  for (std::size_t x = 0; x < once.filled.size(); ++x) {
    ASSERT_NEAR(once.diffuse[0][x], bright.diffuse[0][x], 2e-3);
    ASSERT_LT((once.normal[x] - bright.normal[x]).norm(), 1e-2);
  }
}

TEST(FitReflectance, IsTheSameForAnyNumberOfThreads) {
  SyntheticOptions synthetic;
  synthetic.bumps = 0.1;
  synthetic.noise = 0.05;
  SetJobs(1);
  const Reflectance one = Fit(synthetic);
  SetJobs(2);
  const Reflectance two = Fit(synthetic);
  SetJobs(0);
  EXPECT_EQ(one.diffuse, two.diffuse);
  EXPECT_EQ(one.specular, two.specular);
  EXPECT_EQ(one.normal, two.normal);
  EXPECT_EQ(one.confidence, two.confidence);
}

TEST(FitReflectance, FillsWhatNothingMeasured) {
  const SyntheticOptions synthetic;
  const Reflectance fit = Fit(synthetic, {.second_pass = false});
  const int last = synthetic.width * (synthetic.height - 1);
  for (int x = 0; x < synthetic.width * synthetic.height; ++x) {
    const auto i = static_cast<std::size_t>(x);
    EXPECT_EQ(fit.filled[i], x >= last ? 1 : 0);
    if (x < last) {
      EXPECT_GT(fit.confidence[i], 0.5);
      continue;
    }
    EXPECT_EQ(fit.confidence[i], 0);
    const auto above = static_cast<std::size_t>(x - synthetic.width);
    EXPECT_EQ(fit.material[i], fit.material[above]);
    EXPECT_NEAR(fit.diffuse[0][i], fit.diffuse[0][above], 0.1);
    EXPECT_GT(fit.diffuse[0][i], 0.05);
  }
}

TEST(FitReflectance, RefusesDyxelsWithoutLight) {
  SyntheticOptions synthetic;
  synthetic.exposure = 0;
  EXPECT_THROW((void)Fit(synthetic), Error);
  EXPECT_THROW((void)Fit(synthetic, {.model = "oren"}), Error);
}

}  // namespace
}  // namespace dyxel
