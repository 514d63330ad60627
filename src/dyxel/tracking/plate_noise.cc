#include "dyxel/tracking/plate_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace dyxel {
namespace {

constexpr int kBins = 24;
constexpr std::size_t kLeastInBin = 100;

float Quantile(std::vector<float>& values, double q) {
  const auto k = static_cast<std::size_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(k), values.end());
  return values[k];
}

// The smallest difference of two of the values above `least`; 0 where there is none.
float SmallestStep(std::vector<float>& values, float least) {
  std::sort(values.begin(), values.end());
  float step = std::numeric_limits<float>::infinity();
  for (std::size_t i = 1; i < values.size(); ++i) {
    const float d = values[i] - values[i - 1];
    if (d > least) step = std::min(step, d);
  }
  return std::isfinite(step) ? step : 0;
}

}  // namespace

ImageF MeanPlate(std::span<const ImageF> plates) {
  ImageF mean(plates[0].width, plates[0].height, plates[0].channels);
  for (const ImageF& plate : plates) {
    for (std::size_t i = 0; i < mean.data.size(); ++i) mean.data[i] += plate.data[i];
  }
  const float scale = 1.0F / static_cast<float>(plates.size());
  for (float& v : mean.data) v *= scale;
  return mean;
}

PlateNoise FitPlateNoise(const ImageF& picture,
                         const ImageF& plate,
                         std::span<const ImageF> plates) {
  // A sample of the values, in bins of equal count by radiance.
  constexpr std::size_t kStride = 31;
  struct Sample {
    float radiance, squared;
  };
  std::vector<Sample> samples;
  samples.reserve(plate.data.size() / kStride + 1);
  const std::size_t n = plates.size();
  const bool spread = n >= 3;
  for (std::size_t i = 0; i < plate.data.size(); i += kStride) {
    if (!std::isfinite(plate.data[i])) continue;
    float squared = 0;
    if (spread) {
      for (const ImageF& p : plates) {
        const float d = p.data[i] - plate.data[i];
        squared += d * d;
      }
      squared /= static_cast<float>(n - 1);
    } else {
      const float d = picture.data[i] - plate.data[i];
      if (!std::isfinite(d)) continue;
      squared = d * d;
    }
    samples.push_back({std::max(0.0F, plate.data[i]), squared});
  }
  std::vector<float> bright;
  bright.reserve(picture.data.size() / kStride + 1);
  for (std::size_t i = 0; i < picture.data.size(); i += kStride) {
    if (std::isfinite(picture.data[i])) bright.push_back(picture.data[i]);
  }
  PlateNoise noise;
  noise.gain = 0.004F;
  const float range = bright.empty() ? 1.0F : std::max(1e-12F, Quantile(bright, 0.999));
  const float floor = 2e-5F * range;
  noise.read = floor * floor;
  if (samples.size() < kLeastInBin) return noise;

  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) {
    return a.radiance < b.radiance || (a.radiance == b.radiance && a.squared < b.squared);
  });
  // Weighted least squares of variance = read + shot · radiance over the bins.
  double s1 = 0, sx = 0, sxx = 0, sy = 0, sxy = 0;
  const std::size_t bin = std::max(kLeastInBin, samples.size() / kBins);
  std::vector<float> values;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin + bin <= samples.size(); begin = end) {
    // All of a radiance in one bin: black pixels have many in common, sorted by their noise.
    end = begin + bin;
    while (end < samples.size() && samples[end].radiance == samples[end - 1].radiance) ++end;
    const auto count = static_cast<double>(end - begin);
    values.clear();
    double x = 0;
    double mean = 0;
    for (std::size_t i = begin; i < end; ++i) {
      values.push_back(samples[i].squared);
      x += static_cast<double>(samples[i].radiance);
      mean += static_cast<double>(samples[i].squared);
    }
    x /= count;
    // Squared differences of normal noise have the median 0.455 variances; the lower quartile,
    // 0.1015, holds where the person and its shadow cover up to half of a bin.
    const double y = spread ? mean / count * (1.0 + 1.0 / static_cast<double>(n))
                            : static_cast<double>(Quantile(values, 0.25)) / 0.1015;
    const double w = count / std::pow(y + static_cast<double>(noise.read), 2);
    s1 += w;
    sx += w * x;
    sxx += w * x * x;
    sy += w * y;
    sxy += w * x * y;
  }
  const double det = s1 * sxx - sx * sx;
  double shot = det > 1e-12 * s1 * sxx ? (s1 * sxy - sx * sy) / det : 0;
  double read = s1 > 0 ? (sy - std::max(0.0, shot) * sx) / s1 : 0;
  if (read < 0 && sxx > 0) {
    read = 0;
    shot = sxy / sxx;
  }
  if (!spread) {
    // Where most differences are 0, the quartile does not see the steps that the values come in.
    // The difference of two roundings has the variance step²/6.
    const auto step = static_cast<double>(SmallestStep(bright, 1e-6F * range));
    read = std::max(read, step * step / 6);
  }
  noise.read += static_cast<float>(std::max(0.0, read));
  noise.shot = static_cast<float>(std::max(0.0, shot));
  return noise;
}

}  // namespace dyxel
