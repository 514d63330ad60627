// Multi-view video textures (A §V-B): the pictures of one time step resampled into the atlas, with
// the visibility of cameras and lights; docs/method.md (V1)-(V4).
#pragma once

#include <span>
#include <vector>

#include "dyxel/base/option.h"
#include "dyxel/capture/camera.h"
#include "dyxel/capture/light.h"
#include "dyxel/image/image.h"
#include "dyxel/mesh/atlas.h"
#include "dyxel/mesh/shadow_map.h"
#include "dyxel/mesh/surface.h"
#include "dyxel/reflectance/dyxels.h"

namespace dyxel {

struct TextureOptions {
  double grazing = 0.2;
  int rim = 2;
  int shadow_size = 2048;

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
    field(o.shadow_size,
          {.name = "shadow_size",
           .unit = "px",
           .min = 64,
           .max = 16384,
           .help = "side of the lamps' shadow maps"});
  }
};

// One time step over the K texels of the grid.
struct MvvTextures {
  std::vector<std::vector<float>> radiance;  // [camera][3 * K], texel-major RGB
  std::vector<std::vector<float>> weight;    // [camera][K] κ and trust, in [0, 1]; 0 unseen
  std::vector<std::vector<float>> light_visibility;  // [light][K] λ in [0, 1]
};

// Samples every camera's picture at the K texels. A sample counts (weight > 0) where the camera
// sees the texel (its depth map agrees), not within `rim` pixels of a depth edge or the outline,
// not at grazing angles, and where no lamp's penumbra or cone falloff lies on the
// texel. `pictures` are [camera], cropped as they like (Picture::window); an empty picture gives no
// samples, nor does a pixel that is not finite (Clipped::kNoValue makes saturated ones so). λ is 0
// or 1 where samples count, and in between in penumbrae. Parallel over cameras and texels.
[[nodiscard]] MvvTextures MakeMvvTextures(const Atlas& atlas,
                                          const TexelGrid& grid,
                                          const PosedSurface& surface,
                                          std::span<const Camera> cameras,
                                          std::span<const Picture> pictures,
                                          std::span<const Light> lights,
                                          const TextureOptions& options = {});

// The shadow map of a light, fitted to the surface.
[[nodiscard]] ShadowMap MakeShadowMap(const Light& light,
                                      std::span<const Vec3f> positions,
                                      std::span<const Triangle> triangles,
                                      int size);

// Writes frame `frame` of `tile` (sized; first_texel and texels set) from a time step's textures:
// the directions to cameras and lights in the texels' tangent frames, irradiance times λ, radiance.
// `textures` holds texels from `first_texture_texel` on. Where a camera's weight is 0 its radiance
// stays as it is (0) and its direction is the normal's, so that no BRDF has to divide by nothing.
void FillDyxelFrame(const Atlas& atlas,
                    const TexelGrid& grid,
                    const PosedSurface& surface,
                    std::span<const Camera> cameras,
                    std::span<const Light> lights,
                    const MvvTextures& textures,
                    int first_texture_texel,
                    int frame,
                    DyxelTile& tile);

}  // namespace dyxel
