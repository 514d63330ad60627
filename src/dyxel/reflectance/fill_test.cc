#include "dyxel/reflectance/fill.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/reflectance/synthetic_dyxels.h"

namespace dyxel {
namespace {

Reflectance Row(int width, int height) {
  Reflectance r;
  const auto count = static_cast<std::size_t>(width * height);
  r.materials.resize(2);
  r.materials[0].mean_diffuse = Rgb(0.7F, 0.6F, 0.5F);
  r.material.assign(count, 0);
  for (auto& channel : r.diffuse) channel.assign(count, 0.0F);
  r.normal.assign(count, Vec3f(0.6F, 0, 0.8F));
  r.filled.assign(count, 1);
  return r;
}

std::vector<float> TrustOf(const Reflectance& r) {
  std::vector<float> trust;
  for (const auto filled : r.filled) trust.push_back(filled != 0 ? 0.0F : 10.0F);
  return trust;
}

// In one dimension Laplace's equation has straight lines as solutions.
TEST(FillUnmeasured, ContinuesOneMaterialSmoothly) {
  Reflectance r = Row(5, 1);
  r.filled[0] = r.filled[4] = 0;
  r.diffuse[0][0] = 0.1F;
  r.diffuse[0][4] = 0.5F;
  r.materials[0].mean_diffuse[0] = 0.3F;
  FillUnmeasured(MakeGridGraph(5, 1), TrustOf(r), r);
  EXPECT_THAT(r.diffuse[0],
              testing::Pointwise(testing::FloatNear(2e-3F), {0.1F, 0.2F, 0.3F, 0.4F, 0.5F}));
  EXPECT_EQ(r.normal[2], Vec3f::UnitZ());
  EXPECT_EQ(r.normal[0], Vec3f(0.6F, 0, 0.8F));
}

TEST(FillUnmeasured, DoesNotMixMaterials) {
  Reflectance r = Row(6, 1);
  r.filled[0] = r.filled[5] = 0;
  r.diffuse[1][0] = 0.2F;
  r.diffuse[1][5] = 0.8F;
  r.material[5] = 1;
  r.materials[0].mean_diffuse[1] = 0.2F;
  r.materials[1].mean_diffuse[1] = 0.8F;
  FillUnmeasured(MakeGridGraph(6, 1), TrustOf(r), r);
  EXPECT_THAT(r.material, testing::ElementsAre(0, 0, 0, 1, 1, 1));
  EXPECT_THAT(r.diffuse[1],
              testing::Pointwise(testing::FloatNear(1e-6F), {0.2F, 0.2F, 0.2F, 0.8F, 0.8F, 0.8F}));
}

TEST(FillUnmeasured, FarFromMeasurementsItIsTheMaterialsMean) {
  Reflectance r = Row(100, 1);
  r.filled[0] = 0;
  r.diffuse[0][0] = 0.1F;
  FillUnmeasured(MakeGridGraph(100, 1), TrustOf(r), r);
  EXPECT_NEAR(r.diffuse[0][1], 0.1F, 0.1F);
  EXPECT_LT(r.diffuse[0][3], r.diffuse[0][20]);
  EXPECT_NEAR(r.diffuse[0][0], 0.1F, 1e-6F);
}

// A texel measured badly, of another material than all around, is no source.
TEST(FillUnmeasured, FillsFromSureTexels) {
  Reflectance r = Row(8, 1);
  for (const std::size_t x : {0, 1, 2, 3}) {
    r.filled[x] = 0;
    r.diffuse[0][x] = 0.7F;
  }
  r.material[3] = 1;
  r.diffuse[0][3] = 0.01F;
  std::vector<float> trust = TrustOf(r);
  trust[3] = 0.5F;
  FillUnmeasured(MakeGridGraph(8, 1), trust, r);
  for (const std::size_t x : {4, 5, 6, 7}) {
    EXPECT_EQ(r.material[x], 0);
    EXPECT_NEAR(r.diffuse[0][x], 0.7F, 1e-3F);
  }
}

TEST(FillUnmeasured, AnIslandGetsTheLargestMaterial) {
  Reflectance r = Row(3, 1);
  r.filled[0] = 0;
  r.material[0] = 1;
  TexelGraph graph = MakeGridGraph(3, 1);
  graph.neighbours[0] = graph.neighbours[1] = {-1, -1, -1, -1};
  FillUnmeasured(graph, TrustOf(r), r);
  EXPECT_EQ(r.material[1], 0);
  EXPECT_FLOAT_EQ(r.diffuse[0][1], 0.7F);
}

}  // namespace
}  // namespace dyxel
