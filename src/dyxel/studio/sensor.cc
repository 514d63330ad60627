#include "dyxel/studio/sensor.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/random.h"

namespace dyxel::studio {

ImageF Expose(const ImageF& radiance, const StudioSensor& sensor, std::uint64_t seed) {
  constexpr float kSteps = 4095;
  const auto well = static_cast<float>(sensor.full_well);
  const auto read = static_cast<float>(sensor.read_noise);
  ImageF exposed = radiance;
  Random random(seed);
  for (float& v : exposed.data) {
    const float sigma = std::sqrt(std::max(v, 0.0F) * well + read * read) / well;
    v = std::round((v + sigma * random.Normal()) * kSteps) / kSteps;
    if (sensor.files == StudioFiles::kPng12) v = std::clamp(v, 0.0F, 1.0F);
  }
  return exposed;
}

}  // namespace dyxel::studio
