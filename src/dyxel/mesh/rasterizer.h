// The software rasterizer: which triangle each pixel sees, where on it, and how far.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dyxel/image/image.h"
#include "dyxel/math/types.h"

namespace dyxel {

// A vertex in the rasterizer's space: pixel position (x, y) and inverse depth (1/z; or any value
// affine in screen space that grows towards the eye, for orthographic views). w <= 0 is behind.
struct ScreenVertex {
  float x, y;
  float inverse_depth;
};

struct VisibilityBuffer {
  int width = 0, height = 0;
  std::vector<std::int32_t> triangle;  // (h·w) nearest triangle at the pixel's centre, -1 for none
  std::vector<float> inverse_depth;    // (h·w) 0 for none
};

// Nearest surface at every pixel centre (integer + 0.5). Triangles with a vertex behind the eye
// (inverse_depth <= 0) are dropped whole. Ties go to the lower triangle index, so that the result
// does not depend on the number of threads. Parallel over tiles.
[[nodiscard]] VisibilityBuffer Rasterize(std::span<const ScreenVertex> vertices,
                                         std::span<const Triangle> triangles,
                                         int width,
                                         int height);

// The inverse depths of Rasterize alone (h·w), faster.
[[nodiscard]] std::vector<float> RasterizeDepth(std::span<const ScreenVertex> vertices,
                                                std::span<const Triangle> triangles,
                                                int width,
                                                int height);

// Perspective-correct barycentrics of pixel centre (x + 0.5, y + 0.5) in a triangle.
[[nodiscard]] Vec3f PerspectiveBarycentrics(
    const ScreenVertex& a, const ScreenVertex& b, const ScreenVertex& c, float x, float y);

}  // namespace dyxel
