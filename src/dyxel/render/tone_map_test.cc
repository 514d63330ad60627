#include "dyxel/render/tone_map.h"

#include <cmath>
#include <limits>

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

}  // namespace
}  // namespace dyxel
