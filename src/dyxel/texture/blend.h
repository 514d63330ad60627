// One picture of the surface from all cameras of a time step, for looking at and for flow.
#pragma once

#include <span>
#include <vector>

#include "dyxel/capture/camera.h"
#include "dyxel/image/image.h"
#include "dyxel/mesh/atlas.h"
#include "dyxel/mesh/surface.h"
#include "dyxel/texture/mvv_textures.h"

namespace dyxel {

// Over the K texels of the grid.
struct BlendedTexture {
  std::vector<float> radiance;  // [3 * K] texel-major RGB; 0 where no camera sees the texel
  std::vector<float> weight;    // (K) Σ of the cameras' weights; 0 where none sees it
};

// Weights of a blend [camera][K]: a camera's trust times (n·v)^`sharpness`. The higher, the more
// the camera that sees the texel best counts alone (A §V-D blends by viewing angle).
[[nodiscard]] std::vector<std::vector<float>> BlendWeights(const Atlas& atlas,
                                                           const TexelGrid& grid,
                                                           const PosedSurface& surface,
                                                           std::span<const Camera> cameras,
                                                           const MvvTextures& textures,
                                                           float sharpness = 4);

// Weighted mean of the cameras' radiance, but for camera `left_out` (-1: of all).
[[nodiscard]] BlendedTexture BlendTexture(const MvvTextures& textures,
                                          std::span<const std::vector<float>> weights,
                                          int left_out = -1);

// Values of the K texels, `channels` each and texel-major, as a map [size][size][channels]; gutters
// filled from the nearest texels.
[[nodiscard]] ImageF TexelImage(const TexelGrid& grid, std::span<const float> values, int channels);

}  // namespace dyxel
