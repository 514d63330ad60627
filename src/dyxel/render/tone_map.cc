#include "dyxel/render/tone_map.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/image/sampling.h"

namespace dyxel {
namespace {

std::uint8_t Byte(float x) {  // NaN gives 0
  return static_cast<std::uint8_t>(x > 0 ? std::lround(std::min(x, 1.0F) * 255.0F) : 0);
}

// SrgbFromLinear as a table, fine enough that the byte is right but for ties.
class SrgbTable {
 public:
  SrgbTable() {
    for (std::size_t i = 0; i < bytes_.size(); ++i) {
      bytes_[i] =
          Byte(SrgbFromLinear(static_cast<float>(i) / static_cast<float>(bytes_.size() - 1)));
    }
  }
  [[nodiscard]] std::uint8_t operator()(float linear) const {
    if (!(linear > 0)) return 0;
    const float at = std::min(linear, 1.0F) * static_cast<float>(bytes_.size() - 1);
    return bytes_[static_cast<std::size_t>(std::lround(at))];
  }

 private:
  std::array<std::uint8_t, 65536> bytes_ = {};
};

}  // namespace

ImageU8 ToDisplay(const ImageF& picture, float scale, const std::optional<Rgb>& background) {
  Require(picture.channels == 3 || picture.channels == 4,
          Fault::kUsage,
          "ToDisplay: {} channels, must be 3 or 4",
          picture.channels);
  static const SrgbTable srgb;
  const bool has_alpha = picture.channels == 4;
  const bool keep_alpha = has_alpha && !background;
  ImageU8 out(picture.width, picture.height, keep_alpha ? 4 : 3);
  ParallelFor(static_cast<std::size_t>(picture.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < picture.width; ++x) {
      const float* in = &picture.At(x, y);
      std::uint8_t* to = &out.At(x, y);
      const float alpha = has_alpha ? in[3] : 1;
      for (int c = 0; c < 3; ++c) {
        float value = in[c];
        if (background && has_alpha) value += (1 - alpha) * (*background)[c];
        if (keep_alpha && alpha > 0) value /= alpha;
        to[c] = srgb(scale * value);
      }
      if (keep_alpha) to[3] = Byte(alpha);
    }
  });
  return out;
}

ImageU8 NormalsToDisplay(const ImageF& normals) {
  ImageU8 out(normals.width, normals.height, 3);
  for (int y = 0; y < normals.height; ++y) {
    for (int x = 0; x < normals.width; ++x) {
      const float* in = &normals.At(x, y);
      if (normals.channels == 4 && in[3] <= 0) continue;
      for (int c = 0; c < 3; ++c) out.At(x, y, c) = Byte(0.5F + 0.5F * in[c]);
    }
  }
  return out;
}

ImageU8 MaterialsToDisplay(const ImageF& materials) {
  // Neighbours in the list differ in hue and lightness; none is as dark as the ground.
  constexpr std::array<std::array<std::uint8_t, 3>, 12> kColours = {{{230, 159, 0},
                                                                     {86, 180, 233},
                                                                     {0, 158, 115},
                                                                     {240, 228, 66},
                                                                     {0, 114, 178},
                                                                     {213, 94, 0},
                                                                     {204, 121, 167},
                                                                     {170, 170, 170},
                                                                     {120, 94, 240},
                                                                     {148, 203, 64},
                                                                     {154, 85, 41},
                                                                     {255, 190, 190}}};
  ImageU8 out(materials.width, materials.height, 3);
  for (int y = 0; y < materials.height; ++y) {
    for (int x = 0; x < materials.width; ++x) {
      const float* in = &materials.At(x, y);
      if ((materials.channels == 4 && in[3] <= 0) || !(in[0] >= 0)) continue;
      const auto index = static_cast<std::size_t>(std::lround(std::min(in[0], 1e6F)));
      const auto& colour = kColours[index % kColours.size()];
      std::copy(colour.begin(), colour.end(), &out.At(x, y));
    }
  }
  return out;
}

}  // namespace dyxel
