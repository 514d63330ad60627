// How openly each vertex of a surface lies: seams hide where it is low; docs/method.md (A1).
#pragma once

#include <span>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel::internal {

// Share in [0, 1] of the sky that each vertex sees, cosine weighted (1 - ambient occlusion), from
// orthographic depth maps along `num_directions` spread evenly over the sphere (V).
[[nodiscard]] std::vector<float> Exposure(std::span<const Vec3f> positions,
                                          std::span<const Triangle> triangles,
                                          int num_directions = 64);

}  // namespace dyxel::internal
