// The camera's electronics: shot and read noise, and quantization.
#pragma once

#include <cstdint>

#include "dyxel/image/image.h"
#include "dyxel/studio/preset.h"

namespace dyxel::studio {

// What the sensor makes of a picture of true radiance: noise of variance (v full_well +
// read_noise²) / full_well² about v, in steps of 1/4095. Below 0 only for EXR files.
[[nodiscard]] ImageF Expose(const ImageF& radiance, const StudioSensor& sensor, std::uint64_t seed);

}  // namespace dyxel::studio
