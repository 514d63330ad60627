// Packing charts into a square texture.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel::internal {

// Where a chart goes: texel = texels_per_unit · R(angle) · uv + offset.
struct ChartPlace {
  double angle = 0;
  Vec2d offset = Vec2d::Zero();  // texels
};
struct Packing {
  double texels_per_unit = 0;
  std::vector<ChartPlace> places;  // one a chart
};

// Places charts, given by their border loops, at the largest common scale found so that they keep
// `gutter` texels from one another and from the square's border. Charts fall onto the skyline of
// those before (Lévy et al. 2002); order and angles by a seeded local search of `trials` steps.
[[nodiscard]] Packing PackCharts(std::span<const std::vector<Vec2d>> borders,
                                 int size,
                                 int gutter,
                                 int trials,
                                 std::uint64_t seed = 1);

}  // namespace dyxel::internal
