// Smooth procedural noise for cloth, skin and room: repeatable, without state.
#pragma once

#include <cmath>
#include <cstdint>

#include "dyxel/math/types.h"

namespace dyxel::studio {

inline std::uint32_t HashBits(std::uint32_t x) {
  x ^= x >> 16U;
  x *= 0x7feb352dU;
  x ^= x >> 15U;
  x *= 0x846ca68bU;
  x ^= x >> 16U;
  return x;
}

// Uniform in [0, 1) of a lattice point.
inline float HashUnit(int x, int y, int z) {
  const std::uint32_t h =
      HashBits(static_cast<std::uint32_t>(x) +
               HashBits(static_cast<std::uint32_t>(y) + HashBits(static_cast<std::uint32_t>(z))));
  return static_cast<float>(h >> 8U) * 0x1p-24F;
}

// Value noise with a quintic fade, in [-1, 1], feature size 1.
inline float Noise(const Vec3f& p) {
  const Vec3f floor = p.array().floor();
  const Eigen::Array3f f = (p - floor).array();
  const Eigen::Array3f w = f * f * f * (f * (f * 6 - 15) + 10);
  const int x = static_cast<int>(floor.x());
  const int y = static_cast<int>(floor.y());
  const int z = static_cast<int>(floor.z());
  const auto edge = [&](int dy, int dz) {
    const float a = HashUnit(x, y + dy, z + dz);
    return a + w.x() * (HashUnit(x + 1, y + dy, z + dz) - a);
  };
  const float low = edge(0, 0) + w.y() * (edge(1, 0) - edge(0, 0));
  const float high = edge(0, 1) + w.y() * (edge(1, 1) - edge(0, 1));
  return 2 * (low + w.z() * (high - low)) - 1;
}

inline float SmoothStep(float from, float to, float x) {
  const float t = std::fmin(std::fmax((x - from) / (to - from), 0.0F), 1.0F);
  return t * t * (3 - 2 * t);
}

}  // namespace dyxel::studio
