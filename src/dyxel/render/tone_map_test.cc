#include "dyxel/render/tone_map.h"

#include <array>
#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "dyxel/image/sampling.h"

namespace dyxel {
namespace {

TEST(ToneMapTest, CurveIsTheStandardsAndInverts) {
  EXPECT_NEAR(SrgbFromLinear(0.18F), 0.46135, 1e-4);
  EXPECT_NEAR(SrgbFromLinear(0.001F), 0.01292, 1e-6);
  for (float x = 0; x <= 1; x += 0.01F) EXPECT_NEAR(LinearFromSrgb(SrgbFromLinear(x)), x, 1e-5);
}

TEST(ToneMapTest, BytesAreTheCurveAtEveryLevel) {
  ImageF picture(256, 1, 3);
  for (int i = 0; i < 256; ++i) picture.At(i, 0) = LinearFromSrgb(static_cast<float>(i) / 255) / 2;
  const ImageU8 out = ToDisplay(picture, 2);
  for (int i = 0; i < 256; ++i) EXPECT_EQ(out.At(i, 0), i);
}

TEST(ToneMapTest, AlphaIsKeptStraightOrLaidOverABackground) {
  ImageF picture(1, 1, 4);
  picture.data = {0.25F, 0, std::numeric_limits<float>::quiet_NaN(), 0.5F};
  const ImageU8 straight = ToDisplay(picture, 1);
  EXPECT_EQ(straight.channels, 4);
  EXPECT_EQ(straight.data[0], std::lround(255 * SrgbFromLinear(0.5F)));
  EXPECT_EQ(straight.data[2], 0);
  EXPECT_EQ(straight.data[3], 128);
  const ImageU8 over = ToDisplay(picture, 1, Rgb(0.5F, 1, 1));
  EXPECT_EQ(over.channels, 3);
  EXPECT_EQ(over.data[0], std::lround(255 * SrgbFromLinear(0.5F)));
  EXPECT_EQ(over.data[1], std::lround(255 * SrgbFromLinear(0.5F)));
}

TEST(ToneMapTest, MaterialsHaveColoursOfTheirOwn) {
  ImageF picture(13, 1, 4);
  for (int i = 0; i < 12; ++i) {
    for (int c = 0; c < 3; ++c) picture.At(i, 0, c) = static_cast<float>(i);
    picture.At(i, 0, 3) = i == 3 ? 0.25F : 1;  // an edge
  }
  const ImageU8 out = MaterialsToDisplay(picture);
  ASSERT_EQ(out.channels, 3);
  std::set<std::array<int, 3>> colours;
  for (int i = 0; i < 13; ++i) {
    colours.insert({out.At(i, 0, 0), out.At(i, 0, 1), out.At(i, 0, 2)});
  }
  EXPECT_EQ(colours.size(), 13U);
  EXPECT_EQ(out.At(12, 0, 0) + out.At(12, 0, 1) + out.At(12, 0, 2), 0);  // the ground
}

}  // namespace
}  // namespace dyxel
