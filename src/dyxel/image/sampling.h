// Looking up and shrinking images; the sRGB curve.
#pragma once

#include <algorithm>
#include <cmath>

#include "dyxel/image/image.h"

namespace dyxel {

// Calls f(index of a pixel's first channel, weight) for the four pixels around image position
// (x, y), pixel centres at integer + 0.5, clamped at the border; weights sum to 1.
template <class T, class F>
inline void Bilinear(const Image<T>& image, float x, float y, F&& f) {
  const float fx = std::clamp(x - 0.5F, 0.0F, static_cast<float>(image.width - 1));
  const float fy = std::clamp(y - 0.5F, 0.0F, static_cast<float>(image.height - 1));
  const int x0 = static_cast<int>(fx);
  const int y0 = static_cast<int>(fy);
  const int x1 = std::min(x0 + 1, image.width - 1);
  const int y1 = std::min(y0 + 1, image.height - 1);
  const float ax = fx - static_cast<float>(x0);
  const float ay = fy - static_cast<float>(y0);
  f(image.Index(x0, y0), (1 - ax) * (1 - ay));
  f(image.Index(x1, y0), ax * (1 - ay));
  f(image.Index(x0, y1), (1 - ax) * ay);
  f(image.Index(x1, y1), ax * ay);
}

// Channel c at image position (x, y); the image must not be empty.
template <class T>
[[nodiscard]] inline float SampleBilinear(const Image<T>& image, float x, float y, int c = 0) {
  float sum = 0;
  Bilinear(image, x, y, [&](std::size_t index, float weight) {
    sum += weight * static_cast<float>(image.data[index + static_cast<std::size_t>(c)]);
  });
  return sum;
}

// All channels at once into out[channels].
template <class T>
inline void SampleBilinear(const Image<T>& image, float x, float y, float* out) {
  std::fill_n(out, image.channels, 0.0F);
  Bilinear(image, x, y, [&](std::size_t index, float weight) {
    for (int c = 0; c < image.channels; ++c) {
      out[c] += weight * static_cast<float>(image.data[index + static_cast<std::size_t>(c)]);
    }
  });
}

// The part of `image` in `window`, which must lie inside it.
template <class T>
[[nodiscard]] Image<T> Crop(const Image<T>& image, const Rect& window) {
  Image<T> part(window.width, window.height, image.channels);
  if (part.empty()) return part;
  for (int y = 0; y < window.height; ++y) {
    std::copy_n(&image.At(window.x, window.y + y),
                static_cast<std::size_t>(window.width) * static_cast<std::size_t>(image.channels),
                &part.At(0, y));
  }
  return part;
}

// Mean of the source over each target pixel's area. NaN anywhere in the area gives NaN.
[[nodiscard]] ImageF ResizeArea(const ImageF& image, int width, int height);
// Means rounded to the nearest.
[[nodiscard]] ImageU8 ResizeArea(const ImageU8& image, int width, int height);

// The source pixels, of a picture of full_width x full_height, that `window` of the same picture at
// width x height covers.
[[nodiscard]] Rect SourceWindow(
    const Rect& window, int width, int height, int full_width, int full_height);

// `window` of the picture at width x height, where `image` is the part SourceWindow(window, …) of
// it at full size. The same values as a crop of the whole picture's ResizeArea.
[[nodiscard]] ImageF ResizeAreaWindow(const ImageF& image,
                                      const Rect& window,
                                      int width,
                                      int height,
                                      int full_width,
                                      int full_height);

// IEC 61966-2-1, both ways; odd about 0, and above 1 the curve goes on.
[[nodiscard]] float SrgbFromLinear(float linear);
[[nodiscard]] float LinearFromSrgb(float srgb);

// 8-bit sRGB of `scale` times a linear image, clamped; NaN becomes 0. Alpha (a 4th channel) keeps
// its value.
[[nodiscard]] ImageU8 DisplayImage(const ImageF& linear, float scale = 1);

}  // namespace dyxel
