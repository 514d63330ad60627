#include "dyxel/image/sampling.h"

#include <limits>

#include <gtest/gtest.h>

namespace dyxel {
namespace {

// Bilinear look-ups reproduce a linear image between the pixel centres exactly.
TEST(Sampling, BilinearOfARamp) {
  ImageF image(8, 6, 2);
  const auto ramp = [](float x, float y, int c) {
    return 1 + 2 * x - 3 * y + static_cast<float>(c);
  };
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 8; ++x) {
      for (int c = 0; c < 2; ++c) {
        image.At(x, y, c) = ramp(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F, c);
      }
    }
  }
  float out[2];
  for (float x = 0.5F; x <= 7.5F; x += 0.25F) {
    SampleBilinear(image, x, 2.75F, out);
    EXPECT_NEAR(out[0], ramp(x, 2.75F, 0), 1e-5F);
    EXPECT_NEAR(out[1], ramp(x, 2.75F, 1), 1e-5F);
    EXPECT_NEAR(SampleBilinear(image, x, 2.75F, 1), out[1], 1e-6F);
  }
  // Beyond the centres the border goes on.
  EXPECT_EQ(SampleBilinear(image, -3.0F, 2.5F), image.At(0, 2));
  EXPECT_EQ(SampleBilinear(image, 99.0F, 99.0F), image.At(7, 5));
}

TEST(Sampling, AreaMeanKeepsTheMeanAndLinearity) {
  ImageF image(10, 7, 3);
  double sum = 0;
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = static_cast<float>(i * 37 % 101);
    sum += static_cast<double>(image.data[i]);
  }
  for (const auto& [w, h] : {std::pair{5, 7}, std::pair{4, 3}, std::pair{10, 7}, std::pair{1, 1}}) {
    const ImageF small = ResizeArea(image, w, h);
    double total = 0;
    for (const float value : small.data) total += static_cast<double>(value);
    EXPECT_NEAR(total / static_cast<double>(small.data.size()),
                sum / static_cast<double>(image.data.size()),
                1e-4);
  }
  // Two to one: plain means of two.
  const ImageF half = ResizeArea(image, 5, 7);
  EXPECT_FLOAT_EQ(half.At(2, 3, 1), 0.5F * (image.At(4, 3, 1) + image.At(5, 3, 1)));
  EXPECT_EQ(ResizeArea(image, 10, 7).data, image.data);
}

TEST(Sampling, AreaMeanOfAWindowIsACropOfTheWhole) {
  ImageF image(31, 23, 2);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = static_cast<float>(i * 37 % 101);
  }
  const int w = 12;
  const int h = 9;
  const ImageF whole = ResizeArea(image, w, h);
  for (const Rect window : {Rect{0, 0, 12, 9}, Rect{3, 2, 5, 4}, Rect{11, 8, 1, 1}}) {
    const Rect source = SourceWindow(window, w, h, 31, 23);
    const ImageF part = ResizeAreaWindow(Crop(image, source), window, w, h, 31, 23);
    EXPECT_EQ(part.data, Crop(whole, window).data);
  }
}

TEST(Sampling, AreaMeanOfBytesRounds) {
  ImageU8 mask(4, 1, 1);
  mask.data = {255, 0, 255, 254};
  EXPECT_EQ(ResizeArea(mask, 2, 1).data, (std::vector<std::uint8_t>{128, 255}));
}

TEST(Sampling, SrgbBothWays) {
  EXPECT_FLOAT_EQ(SrgbFromLinear(0.0F), 0.0F);
  EXPECT_NEAR(SrgbFromLinear(1.0F), 1.0F, 1e-6F);
  EXPECT_NEAR(SrgbFromLinear(0.18F), 0.46135613F, 1e-6F);  // the standard's formula in double
  for (float x = -0.2F; x < 2; x += 0.01F) {
    EXPECT_NEAR(LinearFromSrgb(SrgbFromLinear(x)), x, 3e-6F);
  }
}

TEST(Sampling, DisplayImageClamps) {
  ImageF image(4, 1, 1);
  image.data = {-1, 0.5F, 7, std::numeric_limits<float>::quiet_NaN()};
  const ImageU8 shown = DisplayImage(image);
  EXPECT_EQ(shown.data, (std::vector<std::uint8_t>{0, 188, 255, 0}));
  EXPECT_EQ(DisplayImage(image, 0.5F).At(1, 0), 137);
}

}  // namespace
}  // namespace dyxel
