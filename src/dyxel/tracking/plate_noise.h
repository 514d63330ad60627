// The noise of background plates: its variance by radiance; docs/method.md (S1).
#pragma once

#include <span>

#include "dyxel/image/image.h"

namespace dyxel {

// var = read + shot · radiance + (gain · radiance)²: read noise, shot noise, and lamps that are not
// quite steady. Radiance in the capture's unit.
struct PlateNoise {
  float read = 0;
  float shot = 0;
  float gain = 0;
  [[nodiscard]] float Variance(float radiance) const {
    return read + shot * radiance + gain * gain * radiance * radiance;
  }
};

[[nodiscard]] ImageF MeanPlate(std::span<const ImageF> plates);

// From the spread of three plates or more; else from how far the picture is off the plate in the
// half of the pixels (at each radiance) that agree best, which the person does not reach. The
// variance is that of picture minus plate. Never below what half floats and compression leave, nor
// in the second case below that of rounding to the picture's smallest step.
[[nodiscard]] PlateNoise FitPlateNoise(const ImageF& picture,
                                       const ImageF& plate,
                                       std::span<const ImageF> plates);

}  // namespace dyxel
