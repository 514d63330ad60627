#include "dyxel/image/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "dyxel/base/error.h"
#include "dyxel/image/flow.h"
#include "dyxel/image/sampling.h"

namespace dyxel {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr float kMaxAlignment = 8;  // px
constexpr float kMinContrast = 0.05F;
constexpr float kNoiseBlur = 1;  // px: noise must not pass for contrast

bool Inside(const ImageU8& mask, std::size_t pixel) { return mask.data[pixel] >= 128; }

bool Finite(const ImageF& image, std::size_t pixel) {
  const float* v = &image.data[3 * pixel];
  return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]);
}

void RequireSameSize(const ImageF& rendered,
                     const ImageU8& rendered_mask,
                     const ImageF& recorded,
                     const ImageU8& mask) {
  const auto same = [&](const auto& image) {
    return image.width == recorded.width && image.height == recorded.height;
  };
  Require(
      same(rendered) && same(rendered_mask) && same(mask) && rendered.channels == 3 &&
          recorded.channels == 3 && rendered_mask.channels == 1 && mask.channels == 1,
      Fault::kStage,
      "Pictures of {}x{}x{} and {}x{}x{} pixels with masks of {}x{} and {}x{} can't be compared.",
      rendered.width,
      rendered.height,
      rendered.channels,
      recorded.width,
      recorded.height,
      recorded.channels,
      rendered_mask.width,
      rendered_mask.height,
      mask.width,
      mask.height);
}

float Clamped(float value, double scale) {
  value *= static_cast<float>(scale);
  return value > 0 ? std::min(value, 1.0F) : 0.0F;
}
float Shown(float value, double scale) { return SrgbFromLinear(Clamped(value, scale)); }

double Decibel(double sum, double count) {
  if (!(count > 0) || !std::isfinite(sum)) return kNaN;
  return -10 * std::log10(std::max(sum / count, 1e-10));
}

// Σ of squared differences of f(pixel) where use(pixel); f gives both images' values of a channel.
template <class Use, class Values>
double MeanSquare(std::size_t pixels, Use&& use, Values&& values) {
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    if (!use(i)) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto [a, b] = values(3 * i + c, i);
      sum += static_cast<double>(a - b) * static_cast<double>(a - b);
    }
    count += 3;
  }
  return Decibel(sum, count);
}

// Luma of the person on black, in display values, [h][w][1] of the crop.
ImageF Luma(const ImageF& image, const ImageU8& mask, double scale, const Rect& crop) {
  ImageF luma(crop.width, crop.height, 1);
  for (int y = 0; y < crop.height; ++y) {
    for (int x = 0; x < crop.width; ++x) {
      if (mask.At(crop.x + x, crop.y + y) < 128) continue;
      const float* v = &image.At(crop.x + x, crop.y + y);
      luma.At(x, y) = 0.2126F * Shown(v[0], scale) + 0.7152F * Shown(v[1], scale) +
                      0.0722F * Shown(v[2], scale);
    }
  }
  return luma;
}

// Smoothed by kNoiseBlur over the pixels inside alone: the black outside stays out.
ImageF Smoothed(ImageF luma, const ImageU8& mask) {
  ImageF weighted(luma.width, luma.height, 2);
  for (std::size_t i = 0; i < luma.data.size(); ++i) {
    if (!Inside(mask, i)) continue;
    weighted.data[2 * i] = luma.data[i];
    weighted.data[2 * i + 1] = 1;
  }
  weighted = Blur(weighted, kNoiseBlur);
  for (std::size_t i = 0; i < luma.data.size(); ++i) {
    if (Inside(mask, i)) luma.data[i] = weighted.data[2 * i] / weighted.data[2 * i + 1];
  }
  return luma;
}

Rect UnionCrop(const ImageU8& a, const ImageU8& b) {
  const Rect ra = CropOf(a);
  const Rect rb = CropOf(b);
  if (ra.width == 0) return rb;
  if (rb.width == 0) return ra;
  const int x0 = std::min(ra.x, rb.x);
  const int y0 = std::min(ra.y, rb.y);
  return {x0,
          y0,
          std::max(ra.x + ra.width, rb.x + rb.width) - x0,
          std::max(ra.y + ra.height, rb.y + rb.height) - y0};
}

}  // namespace

double DisplayScale(const ImageF& recorded, const ImageU8& mask) {
  std::vector<float> values;
  for (std::size_t i = 0; i < mask.data.size(); ++i) {
    if (!Inside(mask, i) || !Finite(recorded, i)) continue;
    values.insert(values.end(), &recorded.data[3 * i], &recorded.data[3 * i] + 3);
  }
  if (values.empty()) return kNaN;
  // The smallest value with at least 99.5 % of all at or below it.
  const auto rank =
      static_cast<std::ptrdiff_t>(std::ceil(0.995 * static_cast<double>(values.size())) - 1);
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  const float percentile = values[static_cast<std::size_t>(rank)];
  return percentile > 0 ? 1 / static_cast<double>(percentile) : kNaN;
}

Rect CropOf(const ImageU8& mask, int margin) {
  int x0 = mask.width;
  int y0 = mask.height;
  int x1 = -1;
  int y1 = -1;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.At(x, y) < 128) continue;
      x0 = std::min(x0, x);
      x1 = std::max(x1, x);
      y0 = std::min(y0, y);
      y1 = y;
    }
  }
  if (x1 < 0) return {};
  return Intersect({x0 - margin, y0 - margin, x1 - x0 + 1 + 2 * margin, y1 - y0 + 1 + 2 * margin},
                   {0, 0, mask.width, mask.height});
}

double Psnr(const ImageF& rendered,
            const ImageU8& rendered_mask,
            const ImageF& recorded,
            const ImageU8& mask,
            double scale) {
  RequireSameSize(rendered, rendered_mask, recorded, mask);
  return MeanSquare(
      mask.data.size(),
      [&](std::size_t i) {
        return (Inside(mask, i) || Inside(rendered_mask, i)) && Finite(recorded, i);
      },
      [&](std::size_t at, std::size_t i) {
        return std::pair(Inside(rendered_mask, i) ? Shown(rendered.data[at], scale) : 0.0F,
                         Inside(mask, i) ? Shown(recorded.data[at], scale) : 0.0F);
      });
}

double PsnrInside(const ImageF& rendered,
                  const ImageU8& rendered_mask,
                  const ImageF& recorded,
                  const ImageU8& mask,
                  double scale) {
  RequireSameSize(rendered, rendered_mask, recorded, mask);
  return MeanSquare(
      mask.data.size(),
      [&](std::size_t i) {
        return Inside(mask, i) && Inside(rendered_mask, i) && Finite(recorded, i);
      },
      [&](std::size_t at, std::size_t) {
        return std::pair(Shown(rendered.data[at], scale), Shown(recorded.data[at], scale));
      });
}

double PsnrLinear(const ImageF& rendered,
                  const ImageU8& rendered_mask,
                  const ImageF& recorded,
                  const ImageU8& mask,
                  double scale) {
  RequireSameSize(rendered, rendered_mask, recorded, mask);
  return MeanSquare(
      mask.data.size(),
      [&](std::size_t i) {
        return Inside(mask, i) && Inside(rendered_mask, i) && Finite(recorded, i);
      },
      [&](std::size_t at, std::size_t) {
        return std::pair(Clamped(rendered.data[at], scale), Clamped(recorded.data[at], scale));
      });
}

double PsnrAligned(const ImageF& rendered,
                   const ImageU8& rendered_mask,
                   const ImageF& recorded,
                   const ImageU8& mask,
                   double scale) {
  RequireSameSize(rendered, rendered_mask, recorded, mask);
  const Rect crop = UnionCrop(mask, rendered_mask);
  if (crop.width == 0 || !std::isfinite(scale)) return kNaN;
  const ImageF flow =
      OpticalFlow(Luma(recorded, mask, scale, crop), Luma(rendered, rendered_mask, scale, crop));
  // The rendering's display values weighted by its mask, so that no black flows in at its edge.
  ImageF weighted(crop.width, crop.height, 4);
  for (int y = 0; y < crop.height; ++y) {
    for (int x = 0; x < crop.width; ++x) {
      if (rendered_mask.At(crop.x + x, crop.y + y) < 128) continue;
      for (int c = 0; c < 3; ++c) {
        weighted.At(x, y, c) = Shown(rendered.At(crop.x + x, crop.y + y, c), scale);
      }
      weighted.At(x, y, 3) = 1;
    }
  }
  const ImageF moved = WarpByFlow(weighted, flow, kMaxAlignment);
  const auto full = [&](std::size_t i) {  // pixel i of the crop in the whole picture
    const auto width = static_cast<std::size_t>(crop.width);
    return recorded.Index(crop.x + static_cast<int>(i % width),
                          crop.y + static_cast<int>(i / width)) /
           3;
  };
  return MeanSquare(
      moved.data.size() / 4,
      [&](std::size_t i) {
        return moved.data[4 * i + 3] >= 0.5F && Inside(mask, full(i)) && Finite(recorded, full(i));
      },
      [&](std::size_t at, std::size_t i) {
        const std::size_t c = at - 3 * i;
        return std::pair(moved.data[4 * i + c] / moved.data[4 * i + 3],
                         Shown(recorded.data[3 * full(i) + c], scale));
      });
}

double Ssim(const ImageF& rendered,
            const ImageU8& rendered_mask,
            const ImageF& recorded,
            const ImageU8& mask,
            double scale) {
  RequireSameSize(rendered, rendered_mask, recorded, mask);
  const Rect crop = CropOf(mask);
  if (crop.width == 0 || !std::isfinite(scale)) return kNaN;
  const ImageF a = Luma(rendered, rendered_mask, scale, crop);
  const ImageF b = Luma(recorded, mask, scale, crop);
  // Wang et al. 2004: Gaussian of 1.5 px over 11x11 pixels, K1 = 0.01, K2 = 0.03, range 1.
  ImageF moments(crop.width, crop.height, 4);  // a, b, a² + b², a·b
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    moments.data[4 * i] = a.data[i];
    moments.data[4 * i + 1] = b.data[i];
    moments.data[4 * i + 2] = a.data[i] * a.data[i] + b.data[i] * b.data[i];
    moments.data[4 * i + 3] = a.data[i] * b.data[i];
  }
  const ImageF mean = Blur(moments, 1.5F);  // 3 sigma: 11 pixels wide
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    const auto ma = static_cast<double>(mean.data[4 * i]);
    const auto mb = static_cast<double>(mean.data[4 * i + 1]);
    const double squares = ma * ma + mb * mb;
    const double variances = static_cast<double>(mean.data[4 * i + 2]) - squares;
    const double covariance = static_cast<double>(mean.data[4 * i + 3]) - ma * mb;
    sum += (2 * ma * mb + 1e-4) * (2 * covariance + 9e-4) /
           ((squares + 1e-4) * (std::max(0.0, variances) + 9e-4));
  }
  return sum / static_cast<double>(a.data.size());
}

double Iou(const ImageU8& a, const ImageU8& b) {
  double both = 0;
  double any = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    both += Inside(a, i) && Inside(b, i) ? 1 : 0;
    any += Inside(a, i) || Inside(b, i) ? 1 : 0;
  }
  return any > 0 ? both / any : kNaN;
}

double InsideShare(const ImageU8& rendered_mask, const ImageU8& mask) {
  double both = 0;
  double all = 0;
  for (std::size_t i = 0; i < mask.data.size(); ++i) {
    both += Inside(mask, i) && Inside(rendered_mask, i) ? 1 : 0;
    all += Inside(mask, i) ? 1 : 0;
  }
  return all > 0 ? both / all : kNaN;
}

PictureMeasures MeasurePicture(const ImageF& rendered,
                               const ImageU8& rendered_mask,
                               const ImageF& recorded,
                               const ImageU8& mask,
                               bool aligned) {
  RequireSameSize(rendered, rendered_mask, recorded, mask);
  const double scale = DisplayScale(recorded, mask);
  PictureMeasures measures;
  measures.iou = Iou(rendered_mask, mask);
  measures.inside_share = InsideShare(rendered_mask, mask);
  if (!std::isfinite(scale)) {
    measures.psnr = measures.psnr_inside = measures.psnr_linear = kNaN;
    measures.psnr_aligned = measures.ssim = kNaN;
    return measures;
  }
  measures.psnr = Psnr(rendered, rendered_mask, recorded, mask, scale);
  measures.psnr_inside = PsnrInside(rendered, rendered_mask, recorded, mask, scale);
  measures.psnr_linear = PsnrLinear(rendered, rendered_mask, recorded, mask, scale);
  measures.psnr_aligned =
      aligned ? PsnrAligned(rendered, rendered_mask, recorded, mask, scale) : kNaN;
  measures.ssim = Ssim(rendered, rendered_mask, recorded, mask, scale);
  return measures;
}

double PlainPsnr(const ImageF& a, const ImageF& b, const ImageU8& mask) {
  Require(a.width == b.width && a.height == b.height && a.channels == b.channels &&
              a.width == mask.width && a.height == mask.height,
          Fault::kStage,
          "Pictures of {}x{}x{} and {}x{}x{} pixels can't be compared.",
          a.width,
          a.height,
          a.channels,
          b.width,
          b.height,
          b.channels);
  const auto channels = static_cast<std::size_t>(a.channels);
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < mask.data.size(); ++i) {
    if (!Inside(mask, i)) continue;
    for (std::size_t k = i * channels; k < (i + 1) * channels; ++k) {
      const auto difference = static_cast<double>(a.data[k] - b.data[k]);
      if (!std::isfinite(difference)) continue;
      sum += difference * difference;
      count += 1;
    }
  }
  return Decibel(sum, count);
}

FlowMeasure MeasureFlow(const ImageF& recorded,
                        const ImageU8& mask,
                        const ImageF& model,
                        const ImageU8& model_mask,
                        double scale) {
  RequireSameSize(model, model_mask, recorded, mask);
  ImageU8 both(mask.width, mask.height, 1);
  for (std::size_t i = 0; i < both.data.size(); ++i) {
    const bool inside = Inside(mask, i) && Inside(model_mask, i) && Finite(recorded, i);
    both.data[i] = inside ? 255 : 0;
  }
  const Rect crop = CropOf(both);
  if (crop.width == 0 || !std::isfinite(scale)) return {kNaN, 0};
  const ImageU8 part = Crop(both, crop);
  ImageF contrast;
  const ImageF from =
      NormaliseContrast(Smoothed(Luma(recorded, both, scale, crop), part), part, 8, &contrast);
  const ImageF to = NormaliseContrast(Smoothed(Luma(model, both, scale, crop), part), part, 8);
  const ImageF flow = OpticalFlow(from, to);
  FlowMeasure measure;
  double sum = 0;
  for (std::size_t i = 0; i < part.data.size(); ++i) {
    if (!Inside(part, i) || !(contrast.data[i] > kMinContrast)) continue;
    sum += static_cast<double>(std::hypot(flow.data[2 * i], flow.data[2 * i + 1]));
    measure.pixels += 1;
  }
  measure.mean_px = measure.pixels > 0 ? sum / measure.pixels : kNaN;
  return measure;
}

std::vector<float> NormalAngles(const ImageF& a, const ImageF& b) {
  std::vector<float> angles;
  for (std::size_t i = 0; i + 2 < std::min(a.data.size(), b.data.size()); i += 3) {
    const float* p = &a.data[i];
    const float* q = &b.data[i];
    const float length_p = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    const float length_q = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    if (!(length_p > 0.5F && length_q > 0.5F)) continue;
    // |p − q| keeps small angles exact where the arc cosine would not.
    float chord = 0;
    for (int c = 0; c < 3; ++c) {
      const float d = p[c] / length_p - q[c] / length_q;
      chord += d * d;
    }
    const float half = std::min(1.0F, std::sqrt(chord) / 2);
    angles.push_back(2 * std::asin(half) * 57.29577951308232F);
  }
  return angles;
}

}  // namespace dyxel
