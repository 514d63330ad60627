#include "dyxel/image/metrics.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "dyxel/image/sampling.h"

namespace dyxel {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

ImageU8 Box(int width, int height, const Rect& box) {
  ImageU8 mask(width, height, 1);
  for (int y = box.y; y < box.y + box.height; ++y) {
    for (int x = box.x; x < box.x + box.width; ++x) mask.At(x, y) = 255;
  }
  return mask;
}

// A textured picture shifted by whole or part pixels.
ImageF Texture(int width, int height, float dx, float dy) {
  ImageF image(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float u = static_cast<float>(x) - dx;
      const float v = static_cast<float>(y) - dy;
      const float value = 0.4F + 0.25F * std::sin(0.5F * u + 0.2F * v) * std::cos(0.4F * v) +
                          0.1F * std::sin(0.9F * u - 0.6F * v + 1);
      for (int c = 0; c < 3; ++c) image.At(x, y, c) = value * (1 - 0.1F * static_cast<float>(c));
    }
  }
  return image;
}

TEST(Metrics, DisplayScaleIsThePercentileOverTheMask) {
  ImageF image(20, 10, 3, 50.0F);  // outside: far brighter
  const ImageU8 mask = Box(20, 10, {0, 0, 10, 10});
  float value = 0;
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 10; ++x) {
      for (int c = 0; c < 3; ++c) image.At(x, y, c) = value += 1;  // 1 … 300
    }
  }
  // 99.5 % of 300 is 298.5: the 299th smallest.
  EXPECT_NEAR(1 / DisplayScale(image, mask), 299, 1e-4);
  image.At(3, 3, 1) = kNaN;  // its pixel drops out
  EXPECT_NEAR(1 / DisplayScale(image, mask), 299, 1e-4);
  EXPECT_TRUE(std::isnan(DisplayScale(ImageF(4, 4, 3), Box(4, 4, {0, 0, 2, 2}))));
  EXPECT_TRUE(std::isnan(DisplayScale(image, ImageU8(20, 10, 1))));
}

TEST(Metrics, CropIsTheBoxAndEightPixels) {
  EXPECT_EQ(CropOf(Box(100, 50, {30, 5, 20, 10})), (Rect{22, 0, 36, 23}));
  EXPECT_EQ(CropOf(ImageU8(100, 50, 1)), Rect{});
}

// A constant difference of display values has a known ratio: d = 0.1 is 20 dB.
TEST(Metrics, PsnrOfConstantDifferences) {
  const int size = 40;
  const ImageU8 mask = Box(size, size, {10, 10, 20, 20});
  const ImageF recorded(size, size, 3, 2 * LinearFromSrgb(0.6F));
  const ImageF rendered(size, size, 3, 2 * LinearFromSrgb(0.5F));
  EXPECT_NEAR(PsnrInside(rendered, mask, recorded, mask, 0.5), 20, 1e-3);
  EXPECT_NEAR(Psnr(rendered, mask, recorded, mask, 0.5), 20, 1e-3);
  const double linear = static_cast<double>(LinearFromSrgb(0.6F) - LinearFromSrgb(0.5F));
  EXPECT_NEAR(PsnrLinear(rendered, mask, recorded, mask, 0.5), -20 * std::log10(linear), 1e-3);
  // Values beyond white are equal once clamped.
  EXPECT_EQ(PsnrInside(ImageF(size, size, 3, 7), mask, ImageF(size, size, 3, 9), mask, 1), 100);
  // Negative values are black.
  EXPECT_EQ(PsnrInside(ImageF(size, size, 3, -7), mask, ImageF(size, size, 3, 0), mask, 1), 100);
}

// A wrong shape is paid for both ways by psnr and not at all by psnr_inside.
TEST(Metrics, PsnrPaysForTheShape) {
  const ImageU8 mask = Box(40, 20, {0, 0, 20, 20});
  const ImageU8 rendered_mask = Box(40, 20, {10, 0, 20, 20});
  const ImageF image(40, 20, 3, LinearFromSrgb(0.8F));
  EXPECT_EQ(PsnrInside(image, rendered_mask, image, mask, 1), 100);
  // Two thirds of the union differ by 0.8.
  EXPECT_NEAR(Psnr(image, rendered_mask, image, mask, 1), -10 * std::log10(0.64 * 2 / 3), 1e-3);
  EXPECT_NEAR(Iou(mask, rendered_mask), 1.0 / 3, 1e-12);
  EXPECT_NEAR(InsideShare(rendered_mask, mask), 0.5, 1e-12);
  EXPECT_TRUE(std::isnan(Iou(ImageU8(3, 3, 1), ImageU8(3, 3, 1))));
  // Nothing rendered at all: no pixel inside, and a black picture against the recorded one.
  const ImageU8 nothing(40, 20, 1);
  EXPECT_TRUE(std::isnan(PsnrInside(image, nothing, image, mask, 1)));
  EXPECT_NEAR(Psnr(image, nothing, image, mask, 1), -20 * std::log10(0.8), 1e-3);
}

TEST(Metrics, PixelsWithoutAValueCountNowhere) {
  const ImageU8 mask = Box(20, 20, {0, 0, 20, 20});
  ImageF recorded(20, 20, 3, LinearFromSrgb(0.6F));
  const ImageF rendered(20, 20, 3, LinearFromSrgb(0.5F));
  recorded.At(5, 5, 2) = kNaN;
  EXPECT_NEAR(PsnrInside(rendered, mask, recorded, mask, 1), 20, 1e-3);
  EXPECT_NEAR(Psnr(rendered, mask, recorded, mask, 1), 20, 1e-3);
}

// SSIM of flat pictures is its luminance term, and of equal ones 1.
TEST(Metrics, SsimKnownValues) {
  const int size = 80;
  const ImageU8 all = Box(size, size, {0, 0, size, size});
  const ImageF a(size, size, 3, LinearFromSrgb(0.4F));
  const ImageF b(size, size, 3, LinearFromSrgb(0.6F));
  EXPECT_NEAR(Ssim(a, all, a, all, 1), 1, 1e-6);
  EXPECT_NEAR(
      Ssim(a, all, b, all, 1), (2 * 0.4 * 0.6 + 1e-4) / (0.4 * 0.4 + 0.6 * 0.6 + 1e-4), 1e-4);
  // A checkerboard against its negative about the same mean: structure −1, so far below 0.
  ImageF board(size, size, 3);
  ImageF negative(size, size, 3);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      for (int c = 0; c < 3; ++c) {
        board.At(x, y, c) = LinearFromSrgb((x + y) % 2 == 0 ? 0.7F : 0.3F);
        negative.At(x, y, c) = LinearFromSrgb((x + y) % 2 == 0 ? 0.3F : 0.7F);
      }
    }
  }
  // Variance 0.04 each: (2 · −0.04 + C2) / (2 · 0.04 + C2).
  EXPECT_NEAR(Ssim(board, all, negative, all, 1), (-0.08 + 9e-4) / (0.08 + 9e-4), 2e-3);
  // What lies outside the masks does not count.
  const ImageU8 part = Box(size, size, {20, 20, 40, 40});
  ImageF other = a;
  other.At(5, 5) = 100;
  EXPECT_NEAR(Ssim(other, part, a, part, 1), 1, 1e-6);
}

// A shifted rendering is poor inside and good once it is moved back; beyond 8 px it stays poor.
TEST(Metrics, AlignedForgivesAShift) {
  const ImageU8 mask = Box(160, 160, {20, 20, 120, 120});
  const ImageF recorded = Texture(160, 160, 0, 0);
  const double scale = DisplayScale(recorded, mask);
  const auto compare = [&](int dx, int dy) {
    const ImageF rendered = Texture(160, 160, static_cast<float>(dx), static_cast<float>(dy));
    const ImageU8 moved = Box(160, 160, {20 + dx, 20 + dy, 120, 120});
    return MeasurePicture(rendered, moved, recorded, mask);
  };
  const PictureMeasures near = compare(4, 2);
  EXPECT_LT(near.psnr_inside, 20);
  EXPECT_GT(near.psnr_aligned, near.psnr_inside + 10);
  const PictureMeasures far = compare(14, 7);
  EXPECT_LT(far.psnr_aligned, near.psnr_aligned - 10);
  EXPECT_GT(compare(0, 0).psnr_aligned, 45);
  // A wrong brightness is not forgiven: display values off by about a tenth.
  ImageF dark = recorded;
  for (float& value : dark.data) value *= 0.7F;
  EXPECT_NEAR(PsnrAligned(dark, mask, recorded, mask, scale),
              PsnrInside(dark, mask, recorded, mask, scale),
              1.5);
}

TEST(Metrics, FlowMeasureIsTheShift) {
  const ImageU8 mask = Box(200, 200, {20, 20, 160, 160});
  const ImageF recorded = Texture(200, 200, 0, 0);
  const double scale = DisplayScale(recorded, mask);
  EXPECT_NEAR(MeasureFlow(recorded, mask, recorded, mask, scale).mean_px, 0, 0.02);
  ImageF model = Texture(200, 200, 3, 0);
  for (float& value : model.data) value *= 0.8F;  // another light does not matter
  const FlowMeasure measure = MeasureFlow(recorded, mask, model, mask, scale);
  EXPECT_NEAR(measure.mean_px, 3, 0.3);
  EXPECT_GT(measure.pixels, 0.9 * 160 * 160);
  // Without contrast nothing is measured.
  const ImageF flat(200, 200, 3, 0.5F);
  EXPECT_EQ(MeasureFlow(flat, mask, model, mask, scale).pixels, 0);
}

TEST(Metrics, AllAtOnceAreTheSame) {
  const ImageU8 mask = Box(120, 120, {20, 20, 70, 70});
  const ImageU8 rendered_mask = Box(120, 120, {22, 21, 70, 70});
  const ImageF recorded = Texture(120, 120, 0, 0);
  const ImageF rendered = Texture(120, 120, 0.6F, 0);
  const double scale = DisplayScale(recorded, mask);
  const PictureMeasures all = MeasurePicture(rendered, rendered_mask, recorded, mask);
  EXPECT_EQ(all.psnr, Psnr(rendered, rendered_mask, recorded, mask, scale));
  EXPECT_EQ(all.psnr_inside, PsnrInside(rendered, rendered_mask, recorded, mask, scale));
  EXPECT_EQ(all.psnr_linear, PsnrLinear(rendered, rendered_mask, recorded, mask, scale));
  EXPECT_EQ(all.psnr_aligned, PsnrAligned(rendered, rendered_mask, recorded, mask, scale));
  EXPECT_EQ(all.ssim, Ssim(rendered, rendered_mask, recorded, mask, scale));
  EXPECT_EQ(all.iou, Iou(mask, rendered_mask));
  EXPECT_LT(all.psnr, all.psnr_inside);
  EXPECT_TRUE(
      std::isnan(MeasurePicture(rendered, rendered_mask, recorded, mask, false).psnr_aligned));
  EXPECT_TRUE(std::isnan(MeasurePicture(rendered, mask, ImageF(120, 120, 3), mask).psnr));
}

TEST(Metrics, PlainPsnrAndNormalAngles) {
  const ImageU8 mask = Box(10, 10, {0, 0, 5, 10});
  ImageF a(10, 10, 3, 0.3F);
  ImageF b(10, 10, 3, 0.31F);
  for (int y = 0; y < 10; ++y) b.At(7, y) = 100;  // outside
  b.At(2, 2, 1) = kNaN;
  EXPECT_NEAR(PlainPsnr(a, b, mask), 40, 1e-3);

  ImageF p(3, 1, 3);
  ImageF q(3, 1, 3);
  const float angle = 0.3F;
  p.data = {0, 0, 1, 0, 0, 0, 1, 0, 0};
  q.data = {std::sin(angle), 0, std::cos(angle), 0, 0, 1, 0, 2, 0};
  const std::vector<float> angles = NormalAngles(p, q);
  ASSERT_EQ(angles.size(), 2U);  // the middle pixel is not covered
  EXPECT_NEAR(angles[0], angle * 57.29578F, 1e-4F);
  EXPECT_NEAR(angles[1], 90, 1e-4F);
}

}  // namespace
}  // namespace dyxel
