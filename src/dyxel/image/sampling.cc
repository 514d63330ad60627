#include "dyxel/image/sampling.h"

#include <array>
#include <vector>

#include "dyxel/base/parallel.h"

namespace dyxel {
namespace {

// The source pixels [begin, begin + weights.size()) of one target pixel along one axis.
struct Span {
  int begin = 0;
  std::vector<float> weights;  // sum 1
};

// Target pixel i of n covers [i, i + 1) · full / n of the source.
Span AreaSpan(int i, int n, int full) {
  const double ratio = static_cast<double>(full) / n;
  const double low = i * ratio;
  const double high = std::min((i + 1) * ratio, static_cast<double>(full));
  Span span;
  span.begin = std::min(static_cast<int>(low), full - 1);
  // A bound that is a whole number but for rounding takes no sliver of the next pixel.
  const int end = std::clamp(static_cast<int>(std::ceil(high - 1e-9)), span.begin + 1, full);
  for (int s = span.begin; s < end; ++s) {
    const double overlap = std::min(high, s + 1.0) - std::max(low, static_cast<double>(s));
    span.weights.push_back(static_cast<float>(std::max(overlap, 0.0) / (high - low)));
  }
  return span;
}

template <class T, class Out>
void Resize(const Image<T>& image,
            const Rect& window,
            int width,
            int height,
            int full_width,
            int full_height,
            const Rect& source,
            Out&& out) {
  std::vector<Span> columns;
  columns.reserve(static_cast<std::size_t>(window.width));
  for (int x = 0; x < window.width; ++x) {
    columns.push_back(AreaSpan(window.x + x, width, full_width));
  }
  const auto channels = static_cast<std::size_t>(image.channels);
  ParallelForBlocks(static_cast<std::size_t>(window.height), 16, [&](std::size_t a, std::size_t b) {
    std::vector<float> line(static_cast<std::size_t>(image.width) * channels);
    for (std::size_t y = a; y < b; ++y) {
      const Span rows = AreaSpan(window.y + static_cast<int>(y), height, full_height);
      std::fill(line.begin(), line.end(), 0.0F);
      for (std::size_t r = 0; r < rows.weights.size(); ++r) {
        const T* values = &image.At(0, rows.begin + static_cast<int>(r) - source.y);
        const float weight = rows.weights[r];
        for (std::size_t i = 0; i < line.size(); ++i) {
          line[i] += weight * static_cast<float>(values[i]);
        }
      }
      for (std::size_t x = 0; x < columns.size(); ++x) {
        const Span& span = columns[x];
        const float* values =
            line.data() + static_cast<std::size_t>(span.begin - source.x) * channels;
        for (std::size_t c = 0; c < channels; ++c) {
          float sum = 0;
          for (std::size_t s = 0; s < span.weights.size(); ++s) {
            sum += span.weights[s] * values[s * channels + c];
          }
          out(x, y, c, sum);
        }
      }
    }
  });
}

}  // namespace

Rect SourceWindow(const Rect& window, int width, int height, int full_width, int full_height) {
  if (window.width == 0 || window.height == 0) return {};
  const Span left = AreaSpan(window.x, width, full_width);
  const Span right = AreaSpan(window.x + window.width - 1, width, full_width);
  const Span top = AreaSpan(window.y, height, full_height);
  const Span bottom = AreaSpan(window.y + window.height - 1, height, full_height);
  return {left.begin,
          top.begin,
          right.begin + static_cast<int>(right.weights.size()) - left.begin,
          bottom.begin + static_cast<int>(bottom.weights.size()) - top.begin};
}

ImageF ResizeAreaWindow(const ImageF& image,
                        const Rect& window,
                        int width,
                        int height,
                        int full_width,
                        int full_height) {
  ImageF result(window.width, window.height, image.channels);
  if (result.empty()) return result;
  const Rect source = SourceWindow(window, width, height, full_width, full_height);
  Resize(image,
         window,
         width,
         height,
         full_width,
         full_height,
         source,
         [&](std::size_t x, std::size_t y, std::size_t c, float value) {
           result.At(static_cast<int>(x), static_cast<int>(y), static_cast<int>(c)) = value;
         });
  return result;
}

ImageF ResizeArea(const ImageF& image, int width, int height) {
  return ResizeAreaWindow(image, {0, 0, width, height}, width, height, image.width, image.height);
}

ImageU8 ResizeArea(const ImageU8& image, int width, int height) {
  ImageU8 result(width, height, image.channels);
  if (result.empty()) return result;
  Resize(image,
         {0, 0, width, height},
         width,
         height,
         image.width,
         image.height,
         {0, 0, image.width, image.height},
         [&](std::size_t x, std::size_t y, std::size_t c, float value) {
           result.At(static_cast<int>(x), static_cast<int>(y), static_cast<int>(c)) =
               static_cast<std::uint8_t>(std::min(value + 0.5F, 255.0F));
         });
  return result;
}

float SrgbFromLinear(float linear) {
  const float x = std::abs(linear);
  const float y = x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F;
  return std::copysign(y, linear);
}

float LinearFromSrgb(float srgb) {
  const float x = std::abs(srgb);
  const float y = x <= 0.04045F ? x / 12.92F : std::pow((x + 0.055F) / 1.055F, 2.4F);
  return std::copysign(y, srgb);
}

ImageU8 DisplayImage(const ImageF& linear, float scale) {
  ImageU8 result(linear.width, linear.height, linear.channels);
  const auto channels = static_cast<std::size_t>(linear.channels);
  ParallelForBlocks(result.data.size(), 1U << 16U, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const bool alpha = channels == 4 && i % 4 == 3;
      float value = alpha ? linear.data[i] : linear.data[i] * scale;
      value = value > 0 ? std::min(value, 1.0F) : 0.0F;  // NaN is not above 0
      if (!alpha) value = SrgbFromLinear(value);
      result.data[i] = static_cast<std::uint8_t>(value * 255 + 0.5F);
    }
  });
  return result;
}

}  // namespace dyxel
