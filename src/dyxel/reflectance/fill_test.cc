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

// In one dimension Laplace's equation has straight lines as solutions.
TEST(FillUnmeasured, ContinuesOneMaterialSmoothly) {
  Reflectance r = Row(5, 1);
  r.filled[0] = r.filled[4] = 0;
  r.diffuse[0][0] = 0.1F;
  r.diffuse[0][4] = 0.5F;
  FillUnmeasured(MakeGridGraph(5, 1), r);
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
  FillUnmeasured(MakeGridGraph(6, 1), r);
  EXPECT_THAT(r.material, testing::ElementsAre(0, 0, 0, 1, 1, 1));
  EXPECT_THAT(r.diffuse[1],
              testing::Pointwise(testing::FloatNear(1e-6F), {0.2F, 0.2F, 0.2F, 0.8F, 0.8F, 0.8F}));
}

TEST(FillUnmeasured, AnIslandGetsTheLargestMaterial) {
  Reflectance r = Row(3, 1);
  r.filled[0] = 0;
  r.material[0] = 1;
  TexelGraph graph = MakeGridGraph(3, 1);
  graph.neighbours[0] = graph.neighbours[1] = {-1, -1, -1, -1};
  FillUnmeasured(graph, r);
  EXPECT_EQ(r.material[1], 0);
  EXPECT_FLOAT_EQ(r.diffuse[0][1], 0.7F);
}

}  // namespace
}  // namespace dyxel
