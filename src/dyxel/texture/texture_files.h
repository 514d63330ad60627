// Multi-view textures on disk, a folder a time step, and the dyxels read back from them tile by
// tile.
//   FOLDER/CAMERA.exr   R, G, B radiance and A weight, in the atlas' layout
//   FOLDER/lights.exr   λ of every light: light000, light001, …
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "dyxel/mesh/atlas.h"
#include "dyxel/reflectance/dyxels.h"
#include "dyxel/texture/mvv_textures.h"

namespace dyxel {

// The files that WriteMvvTextures makes.
[[nodiscard]] std::vector<std::filesystem::path> MvvTextureFiles(
    const std::filesystem::path& folder, std::span<const std::string> camera_names);

// Half floats, every line packed by itself, so that a run of texels is read at its own cost.
void WriteMvvTextures(const std::filesystem::path& folder,
                      std::span<const std::string> camera_names,
                      const TexelGrid& grid,
                      const MvvTextures& textures);

// Texels [begin, end) of the grid: the arrays have end - begin entries. Throws Error(kInput) with
// the file where it is missing or of another size.
[[nodiscard]] MvvTextures ReadMvvTextures(const std::filesystem::path& folder,
                                          std::span<const std::string> camera_names,
                                          int num_lights,
                                          const TexelGrid& grid,
                                          int begin,
                                          int end);

// A time step that dyxels are gathered from.
struct DyxelStep {
  std::filesystem::path folder;  // its textures
  PosedSurface surface;
  std::vector<Light> lights;
};

// Dyxels of all steps, read from the textures on demand in tiles of about 16,000 texels (whole rows
// of the atlas), fewer where many steps would make a tile larger than 192 MiB. What was read is
// kept for the next pass, up to 384 MiB (a RES of some 24 frames); the samples are the same either
// way. `atlas` and `grid` must outlive the source.
[[nodiscard]] DyxelSource MakeDyxelSource(const Atlas& atlas,
                                          const TexelGrid& grid,
                                          std::vector<Camera> cameras,
                                          std::vector<DyxelStep> steps);

}  // namespace dyxel
