// Images in memory: interleaved channels, row major, the top row first.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace dyxel {

template <class T>
struct Image {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<T> data;  // [height][width][channels]

  Image() = default;
  Image(int w, int h, int c, T value = T{})
      : width(w),
        height(h),
        channels(c),
        data(
            static_cast<std::size_t>(w) * static_cast<std::size_t>(h) * static_cast<std::size_t>(c),
            value) {}

  [[nodiscard]] bool empty() const { return data.empty(); }
  [[nodiscard]] std::size_t Index(int x, int y, int c = 0) const {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
            static_cast<std::size_t>(x)) *
               static_cast<std::size_t>(channels) +
           static_cast<std::size_t>(c);
  }
  [[nodiscard]] T& At(int x, int y, int c = 0) { return data[Index(x, y, c)]; }
  [[nodiscard]] const T& At(int x, int y, int c = 0) const { return data[Index(x, y, c)]; }
};

using ImageF = Image<float>;          // linear radiance, or any map
using ImageU8 = Image<std::uint8_t>;  // masks: 255 inside, 0 outside

// A window of pixels [x, x + width) × [y, y + height).
struct Rect {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  friend bool operator==(const Rect&, const Rect&) = default;
};

// The common part; empty (width or height 0) where there is none.
[[nodiscard]] inline Rect Intersect(const Rect& a, const Rect& b) {
  const std::int64_t x0 = a.x > b.x ? a.x : b.x;
  const std::int64_t y0 = a.y > b.y ? a.y : b.y;
  const std::int64_t x1 = std::min(std::int64_t{a.x} + a.width, std::int64_t{b.x} + b.width);
  const std::int64_t y1 = std::min(std::int64_t{a.y} + a.height, std::int64_t{b.y} + b.height);
  return {static_cast<int>(x0),
          static_cast<int>(y0),
          static_cast<int>(std::max<std::int64_t>(0, x1 - x0)),
          static_cast<int>(std::max<std::int64_t>(0, y1 - y0))};
}

// A part of a camera's picture: pixel (x, y) of the full picture is image.At(x - window.x, y -
// window.y).
struct Picture {
  ImageF image;  // [h][w][3], linear radiance; NaN where the camera gave no value
  Rect window;   // in full-picture pixels
};

}  // namespace dyxel
