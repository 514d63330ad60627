// Dyxels: texels with all their samples over cameras and time, as the fits see them. No camera,
// image or mesh here: directions in the texel's tangent frame, light as irradiance.
#pragma once

#include <functional>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel {

// The samples of a run of texels [first_texel, first_texel + texels). Structures of arrays with the
// texel innermost, so that a SIMD lane is a texel. Directions are unit, in the tangent frame of the
// model's surface (x tangent, y bitangent, z model normal) at that time step.
struct DyxelTile {
  int first_texel = 0;
  int texels = 0;
  int frames = 0;  // time steps (of all reflectance sequences together)
  int cameras = 0;
  int lights = 0;                // the most that burn in any frame
  std::vector<float> light_dir;  // [frame][light][3][texel]
  std::vector<float>
      irradiance;  // [frame][light][3][texel] at normal incidence, visibility λ included
  std::vector<float> view_dir;  // [frame][camera][3][texel]
  std::vector<float> radiance;  // [frame][camera][3][texel] S
  std::vector<float> weight;    // [frame][camera][texel] κ and trust, in [0, 1]; 0: no sample

  void Resize(int num_texels, int num_frames, int num_cameras, int num_lights);  // zero-fills
  [[nodiscard]] float* LightDir(int frame, int light, int axis);
  [[nodiscard]] float* Irradiance(int frame, int light, int channel);
  [[nodiscard]] float* ViewDir(int frame, int camera, int axis);
  [[nodiscard]] float* Radiance(int frame, int camera, int channel);
  [[nodiscard]] float* Weight(int frame, int camera);
  [[nodiscard]] const float* LightDir(int frame, int light, int axis) const;
  [[nodiscard]] const float* Irradiance(int frame, int light, int channel) const;
  [[nodiscard]] const float* ViewDir(int frame, int camera, int axis) const;
  [[nodiscard]] const float* Radiance(int frame, int camera, int channel) const;
  [[nodiscard]] const float* Weight(int frame, int camera) const;
};

// Where fits get their samples from, tile by tile, in bounded memory. `load(tile)` may be called
// from several threads at once and again for the same tile.
struct DyxelSource {
  int num_texels = 0;
  std::vector<int> tile_begin;  // (num_tiles + 1) texel ranges
  std::function<DyxelTile(int tile)> load;
  [[nodiscard]] int num_tiles() const { return static_cast<int>(tile_begin.size()) - 1; }
};

// The plain graph of neighbouring texels (4-neighbours on the surface), for fills and smoothing.
struct TexelGraph {
  std::vector<std::array<int, 4>> neighbours;  // (K) texel indices or -1
};

}  // namespace dyxel
