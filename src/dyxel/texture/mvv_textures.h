// Multi-view video textures (method.md 5; A §V-B): the pictures of one time step resampled into the
// atlas, with the visibility of cameras and lights.
#pragma once

#include <span>
#include <vector>

#include "dyxel/base/option.h"
#include "dyxel/capture/camera.h"
#include "dyxel/capture/light.h"
#include "dyxel/image/image.h"
#include "dyxel/mesh/atlas.h"
#include "dyxel/mesh/surface.h"
#include "dyxel/reflectance/dyxels.h"

namespace dyxel {

struct TextureOptions {
  double grazing = 0.2;
  int rim = 2;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(o.grazing,
          {.name = "grazing",
           .min = 0,
           .max = 1,
           .help = "n·v below which a sample is not trusted; its weight grows from there"});
    field(o.rim,
          {.name = "rim",
           .unit = "px",
           .min = 0,
           .max = 20,
           .help = "distance from a silhouette or depth edge within which samples are dropped"});
  }
};

// One time step over the K texels of the grid.
struct MvvTextures {
  std::vector<std::vector<float>> radiance;  // [camera][3 * K], texel-major RGB
  std::vector<std::vector<float>> weight;    // [camera][K] κ and trust, in [0, 1]; 0 unseen
  std::vector<std::vector<float>> light_visibility;  // [light][K] λ in [0, 1]
};

// `pictures` and `masks` are [camera], cropped as they like (Picture::window); an empty picture
// gives no samples. `saturation` is the radiance from which a pixel is clipped (infinity for EXR).
[[nodiscard]] MvvTextures MakeMvvTextures(const Atlas& atlas,
                                          const TexelGrid& grid,
                                          const PosedSurface& surface,
                                          std::span<const Camera> cameras,
                                          std::span<const Picture> pictures,
                                          std::span<const Light> lights,
                                          float saturation,
                                          const TextureOptions& options = {});

// Writes frame `frame` of `tile` (sized; first_texel and texels set) from that time step's
// textures: the directions to cameras and lights in the texels' tangent frames, irradiance times λ,
// radiance.
void FillDyxelFrame(const Atlas& atlas,
                    const TexelGrid& grid,
                    const PosedSurface& surface,
                    std::span<const Camera> cameras,
                    std::span<const Light> lights,
                    const MvvTextures& textures,
                    int frame,
                    DyxelTile& tile);

}  // namespace dyxel
