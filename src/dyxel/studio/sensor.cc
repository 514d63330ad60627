#include "dyxel/studio/sensor.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/random.h"
#include "dyxel/math/types.h"

namespace dyxel::studio {

ImageF Expose(const ImageF& radiance, const StudioSensor& sensor, std::uint64_t seed) {
  constexpr float kSteps = 4095;
  const auto well = static_cast<float>(sensor.full_well);
  const auto read = static_cast<float>(sensor.read_noise);
  ImageF exposed = radiance;
  Random random(seed);
  // Box-Muller's pairs, both of them used.
  float spare = 0;
  for (std::size_t i = 0; i < exposed.data.size(); ++i) {
    float& v = exposed.data[i];
    float normal = spare;
    if (i % 2 == 0) {
      const float radius = std::sqrt(-2 * std::log(1 - random.Uniform()));
      const float angle = 2 * kPi * random.Uniform();
      normal = radius * std::cos(angle);
      spare = radius * std::sin(angle);
    }
    const float sigma = std::sqrt(std::max(v, 0.0F) * well + read * read) / well;
    v = std::round((v + sigma * normal) * kSteps) / kSteps;
    if (sensor.files == StudioFiles::kPng12) v = std::clamp(v, 0.0F, 1.0F);
  }
  return exposed;
}

}  // namespace dyxel::studio
