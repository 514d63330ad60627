#include "dyxel/reflectance/materials.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/random.h"
#include "dyxel/reflectance/synthetic_dyxels.h"

namespace dyxel {
namespace {

constexpr int kWidth = 60;
constexpr int kHeight = 40;

struct Coloured {
  std::array<std::vector<float>, 3> diffuse;
  std::vector<int> truth;
};

// Three stripes of falling width, their brightness varying as badly removed shading does.
Coloured Stripes(float noise) {
  const std::array<std::array<float, 3>, 3> colours = {
      {{0.5F, 0.3F, 0.2F}, {0.1F, 0.15F, 0.4F}, {0.6F, 0.6F, 0.55F}}};
  Coloured out;
  Random random(5);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const int x = i % kWidth;
    const int stripe = x < 30 ? 0 : x < 48 ? 1 : 2;
    out.truth.push_back(stripe);
    const float brightness = std::exp(noise * random.Normal());
    for (std::size_t c = 0; c < 3; ++c) {
      out.diffuse[c].push_back(colours[static_cast<std::size_t>(stripe)][c] * brightness);
    }
  }
  return out;
}

TEST(ClusterMaterials, FindsColoursAndTheirNumber) {
  const Coloured stripes = Stripes(0.1F);
  const std::vector<float> confidence(stripes.truth.size(), 1.0F);
  const TexelGraph graph = MakeGridGraph(kWidth, kHeight);
  EXPECT_EQ(ClusterMaterials(stripes.diffuse, confidence, graph), stripes.truth);
  EXPECT_EQ(ClusterMaterials(stripes.diffuse, confidence, graph, {.materials = 3}), stripes.truth);
}

TEST(ClusterMaterials, OneColourIsOneMaterial) {
  Coloured plain = Stripes(0.02F);
  for (auto& channel : plain.diffuse) channel.assign(channel.size(), 0.4F);
  const std::vector<float> confidence(plain.truth.size(), 1.0F);
  EXPECT_THAT(ClusterMaterials(plain.diffuse, confidence, MakeGridGraph(kWidth, kHeight)),
              testing::Each(0));
}

TEST(ClusterMaterials, UnknownTexelsHaveNone) {
  const Coloured stripes = Stripes(0.1F);
  std::vector<float> confidence(stripes.truth.size(), 1.0F);
  confidence[7] = 0;
  const auto label = ClusterMaterials(stripes.diffuse, confidence, MakeGridGraph(kWidth, kHeight));
  EXPECT_EQ(label[7], -1);
  EXPECT_EQ(label[8], 0);
}

TEST(ClusterMaterials, LoneTexelsFollowTheirNeighbours) {
  Coloured stripes = Stripes(0.05F);
  for (std::size_t c = 0; c < 3; ++c) {
    stripes.diffuse[c][10 * kWidth + 10] = stripes.diffuse[c][10 * kWidth + 55];
  }
  const std::vector<float> confidence(stripes.truth.size(), 1.0F);
  const TexelGraph graph = MakeGridGraph(kWidth, kHeight);
  EXPECT_EQ(ClusterMaterials(stripes.diffuse, confidence, graph, {.materials = 3}), stripes.truth);
  EXPECT_NE(ClusterMaterials(stripes.diffuse, confidence, graph, {.materials = 3, .smoothing = 0}),
            stripes.truth);
}

TEST(ClusterMaterials, SmallPatchesJoinTheirSurroundings) {
  Coloured stripes = Stripes(0.05F);
  for (int y = 10; y < 14; ++y) {
    for (int x = 10; x < 14; ++x) {
      const auto i = static_cast<std::size_t>(y * kWidth + x);
      for (std::size_t c = 0; c < 3; ++c) stripes.diffuse[c][i] = stripes.diffuse[c][i + 45];
    }
  }
  const std::vector<float> confidence(stripes.truth.size(), 1.0F);
  const TexelGraph graph = MakeGridGraph(kWidth, kHeight);
  EXPECT_NE(ClusterMaterials(stripes.diffuse, confidence, graph, {.materials = 3}), stripes.truth);
  EXPECT_EQ(
      ClusterMaterials(stripes.diffuse, confidence, graph, {.materials = 3, .min_patch = 0.02}),
      stripes.truth);
}

// Published: sRGB primaries and white in CIELAB (D65).
TEST(Lab, AgreesWithPublishedValues) {
  EXPECT_THAT(internal::Lab(1, 1, 1),
              testing::ElementsAre(testing::FloatNear(100, 0.01F),
                                   testing::FloatNear(0, 0.02F),
                                   testing::FloatNear(0, 0.02F)));
  EXPECT_THAT(internal::Lab(1, 0, 0),
              testing::ElementsAre(testing::FloatNear(53.24F, 0.02F),
                                   testing::FloatNear(80.09F, 0.05F),
                                   testing::FloatNear(67.20F, 0.05F)));
}

}  // namespace
}  // namespace dyxel
