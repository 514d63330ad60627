#include "dyxel/image/flow.h"

#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/parallel.h"

namespace dyxel {
namespace {

// A smooth texture with detail at several scales.
float Texture(float x, float y) {
  return 0.5F + 0.2F * std::sin(0.35F * x + 0.2F * y) * std::cos(0.27F * y) +
         0.15F * std::sin(0.9F * x - 0.6F * y + 1) + 0.1F * std::cos(0.13F * x * 0.7F + 0.8F * y);
}

ImageF Shifted(int width, int height, float dx, float dy) {
  ImageF image(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.At(x, y) = Texture(static_cast<float>(x) - dx, static_cast<float>(y) - dy);
    }
  }
  return image;
}

TEST(Flow, FindsATranslation) {
  const ImageF from = Shifted(160, 120, 0, 0);
  const ImageF to = Shifted(160, 120, 2.5F, -1.25F);
  const ImageF flow = OpticalFlow(from, to);
  double error = 0;
  int count = 0;
  for (int y = 10; y < 110; ++y) {
    for (int x = 10; x < 150; ++x) {
      error += static_cast<double>(std::hypot(flow.At(x, y, 0) - 2.5F, flow.At(x, y, 1) + 1.25F));
      ++count;
    }
  }
  EXPECT_LT(error / count, 0.1);
  // Moved back by it, the second picture is the first.
  const ImageF back = WarpByFlow(to, flow, 8);
  for (int y = 20; y < 100; y += 7) {
    for (int x = 20; x < 140; x += 7) EXPECT_NEAR(back.At(x, y), from.At(x, y), 0.05F);
  }
}

TEST(Flow, TheSameForAnyNumberOfThreads) {
  const ImageF from = Shifted(200, 150, 0, 0);
  const ImageF to = Shifted(200, 150, 1, 3);
  const ImageF once = OpticalFlow(from, to);
  SetJobs(1);
  const ImageF again = OpticalFlow(from, to);
  SetJobs(0);
  EXPECT_EQ(once.data, again.data);
}

TEST(Flow, SmallPicturesWork) {
  EXPECT_EQ(OpticalFlow(ImageF(5, 3, 1, 0.5F), ImageF(5, 3, 1, 0.5F)).width, 5);
  EXPECT_TRUE(OpticalFlow(ImageF(0, 0, 1), ImageF(0, 0, 1)).empty());
}

TEST(Flow, WarpIsLimited) {
  ImageF image(20, 1, 1);
  for (int x = 0; x < 20; ++x) image.At(x, 0) = static_cast<float>(x);
  ImageF flow(20, 1, 2);
  for (int x = 0; x < 20; ++x) flow.At(x, 0, 0) = x < 10 ? 3.5F : -30.0F;
  const ImageF moved = WarpByFlow(image, flow, 8);
  EXPECT_FLOAT_EQ(moved.At(4, 0), 7.5F);
  EXPECT_FLOAT_EQ(moved.At(15, 0), 7.0F);
}

// A lighting that changes the picture's level and gain smoothly leaves its normalised contrast.
TEST(Flow, ContrastIsFreeOfGainAndLevel) {
  const ImageF image = Shifted(120, 120, 0, 0);
  ImageF other = image;
  for (float& value : other.data) value = 0.35F * value + 0.4F;
  const ImageF a = NormaliseContrast(image, {}, 8);
  const ImageF b = NormaliseContrast(other, {}, 8);
  double difference = 0;
  double spread = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    difference += static_cast<double>(std::abs(a.data[i] - b.data[i]));
    spread += static_cast<double>(std::abs(a.data[i] - 0.5F));
  }
  EXPECT_LT(difference, 0.12 * spread);
  EXPECT_GT(spread / static_cast<double>(a.data.size()), 0.1);
}

TEST(Flow, ContrastKnowsOnlyTheMasksInside) {
  ImageF image = Shifted(120, 120, 0, 0);
  ImageU8 mask(120, 120, 1);
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 60; ++x) mask.At(x, y) = 255;
  }
  ImageF deviation;
  const ImageF a = NormaliseContrast(image, mask, 8, &deviation);
  for (int y = 0; y < 120; ++y) {
    for (int x = 60; x < 120; ++x) image.At(x, y) = 1000;
  }
  EXPECT_EQ(NormaliseContrast(image, mask, 8).data, a.data);
  EXPECT_EQ(a.At(100, 50), 0.5F);
  EXPECT_EQ(deviation.At(100, 50), 0);
  EXPECT_GT(deviation.At(50, 50), 0.1F);
}

}  // namespace
}  // namespace dyxel
