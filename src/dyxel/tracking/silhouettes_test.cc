#include "dyxel/tracking/silhouettes.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "dyxel/base/error.h"
#include "dyxel/base/random.h"
#include "dyxel/tracking/plate_noise.h"

namespace dyxel {
namespace {

constexpr int kWidth = 240;
constexpr int kHeight = 200;

// Coverage of a figure: a disc on an ellipse, anti-aliased by 4x4 samples.
float Coverage(int x, int y) {
  int hits = 0;
  for (int i = 0; i < 16; ++i) {
    const double u = x + (i % 4 + 0.5) / 4;
    const int row = i / 4;
    const double v = y + (row + 0.5) / 4;
    const double head = std::hypot(u - 110, v - 40) / 20;
    const double body = std::hypot((u - 110) / 35, (v - 110) / 65);
    if (head < 1 || body < 1) ++hits;
  }
  return static_cast<float>(hits) / 16;
}

struct Scene {
  ImageF picture{kWidth, kHeight, 3};
  std::vector<ImageF> plates;
  ImageU8 truth{kWidth, kHeight, 1};
};

// A textured floor below a dark wall; a striped person who casts a shadow (two lamps of other
// colours, one of them blocked) to the right.
Scene MakeScene(int num_plates, float noise) {
  Scene s;
  Random random(5);
  ImageF clean(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const float texture = 0.06F + 0.01F * std::sin(0.3F * static_cast<float>(x + 2 * y));
      for (int c = 0; c < 3; ++c) {
        const float tint = 1.0F - 0.04F * static_cast<float>(c);
        clean.At(x, y, c) = y < 60 ? 0.004F : texture * tint;
      }
    }
  }
  const auto with_noise = [&](float v) {
    return v + noise * std::sqrt(1e-6F + 1e-3F * std::max(v, 0.0F)) * random.Normal();
  };
  for (int k = 0; k < num_plates; ++k) {
    ImageF plate = clean;
    for (float& v : plate.data) v = with_noise(v);
    s.plates.push_back(plate);
  }
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const bool shadow = y > 150 && y < 176 && x > 120;
      const float a = Coverage(x, y);
      for (int c = 0; c < 3; ++c) {
        const float lamp = 0.45F + 0.02F * static_cast<float>(c);
        const float behind = clean.At(x, y, c) * (shadow ? lamp : 1.0F);
        const float stripe = (y / 8) % 2 == 0 ? 0.5F : 0.15F + 0.1F * static_cast<float>(c);
        s.picture.At(x, y, c) = with_noise(a * stripe + (1 - a) * behind);
      }
      s.truth.At(x, y) = a >= 0.5F ? 255 : 0;
    }
  }
  return s;
}

double Iou(const ImageU8& a, const ImageU8& b) {
  int both = 0, either = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    both += (a.data[i] > 127 && b.data[i] > 127) ? 1 : 0;
    either += (a.data[i] > 127 || b.data[i] > 127) ? 1 : 0;
  }
  return static_cast<double>(both) / either;
}

TEST(ExtractSilhouette, FindsThePersonAndNotTheShadow) {
  for (const int plates : {1, 4}) {
    for (const float noise : {0.0F, 1.0F}) {
      const Scene s = MakeScene(plates, noise);
      EXPECT_GT(Iou(ExtractSilhouette(s.picture, s.plates), s.truth), 0.985)
          << plates << " plates, noise " << noise;
    }
  }
}

TEST(ExtractSilhouette, TakesTheShadowWhereToleranceForbidsIt) {
  const Scene s = MakeScene(1, 0.0F);
  const ImageU8 mask = ExtractSilhouette(s.picture, s.plates, {.shadow_tolerance = 0.1});
  EXPECT_EQ(mask.At(200, 165), 255);
  EXPECT_LT(Iou(mask, s.truth), 0.9);
}

TEST(ExtractSilhouette, TakesThePersonAndNotALargerBlackShadow) {
  // No light at all where the only lamp is blocked: its pixels are noise around zero.
  Scene s = MakeScene(3, 1.0F);
  Random random(11);
  for (int y = 2; y < 190; ++y) {
    for (int x = 180; x < kWidth; ++x) {
      for (int c = 0; c < 3; ++c) s.picture.At(x, y, c) = 1e-3F * random.Normal();
    }
  }
  EXPECT_GT(Iou(ExtractSilhouette(s.picture, s.plates), s.truth), 0.985);
}

TEST(ExtractSilhouette, IsEmptyWithoutAPerson) {
  const Scene s = MakeScene(1, 0.0F);
  const ImageU8 mask = ExtractSilhouette(s.plates[0], s.plates);
  for (const auto v : mask.data) EXPECT_EQ(v, 0);
}

TEST(ExtractSilhouette, SaysWhatIsMissing) {
  const Scene s = MakeScene(1, 0.0F);
  EXPECT_THROW((void)ExtractSilhouette(s.picture, {}), Error);
  const std::vector<ImageF> small = {ImageF(10, 10, 3)};
  EXPECT_THROW((void)ExtractSilhouette(s.picture, small), Error);
}

TEST(FitPlateNoise, FindsReadAndShotNoise) {
  // var of picture minus plate = 2 (1e-6 + 1e-3 v) for one plate; the person covers a third.
  const Scene s = MakeScene(1, 1.0F);
  const PlateNoise one = FitPlateNoise(s.picture, s.plates[0], s.plates);
  EXPECT_NEAR(one.Variance(0.06F), 2 * (1e-6F + 1e-3F * 0.06F), 0.4F * 1.2e-4F);
  const Scene many = MakeScene(6, 1.0F);
  const ImageF mean = MeanPlate(many.plates);
  const PlateNoise spread = FitPlateNoise(many.picture, mean, many.plates);
  EXPECT_NEAR(spread.Variance(0.06F), 7.0F / 6 * (1e-6F + 1e-3F * 0.06F), 0.1F * 7e-5F);
}

TEST(FitPlateNoise, SeesTheNoiseOfAQuantisedBlackWall) {
  // Half of the picture is black, in steps of two deviations: most of its values are the same.
  constexpr float kStep = 2e-4F;
  constexpr float kDeviation = 1e-4F;
  for (const int count : {1, 3}) {
    Random random(7);
    const auto expose = [&] {
      ImageF image(kWidth, kHeight, 3);
      for (std::size_t i = 0; i < image.data.size(); ++i) {
        const float v = i % 2 == 0 ? 0.0F : 0.3F;
        image.data[i] = kStep * std::round((v + kDeviation * random.Normal()) / kStep);
      }
      return image;
    };
    std::vector<ImageF> plates;
    plates.reserve(static_cast<std::size_t>(count));
    for (int k = 0; k < count; ++k) plates.push_back(expose());
    const PlateNoise noise = FitPlateNoise(expose(), MeanPlate(plates), plates);
    const float variance =
        (kDeviation * kDeviation + kStep * kStep / 12) * (1 + 1 / static_cast<float>(count));
    // One plate's quartile is blind to it: at least the steps themselves.
    EXPECT_GT(noise.Variance(0), (count == 1 ? 0.2F : 0.5F) * variance) << count << " plates";
    EXPECT_LT(noise.Variance(0), 2 * variance) << count << " plates";
  }
}

}  // namespace
}  // namespace dyxel
