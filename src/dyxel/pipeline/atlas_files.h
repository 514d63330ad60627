// The atlas on disk: PROJECT/atlas/{I,II}.obj, the cut surface in its rest place with one
// parameterization each as texture coordinates, and texels.exr, which says for every texel of I
// the triangle, two barycentrics and the place in II.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "dyxel/mesh/atlas.h"

namespace dyxel {

// The files that WriteAtlas makes.
[[nodiscard]] std::vector<std::filesystem::path> AtlasFiles(const std::filesystem::path& folder,
                                                            bool with_second);

// `skin_positions` (V) at rest. II.obj only where the atlas has parameterization II.
void WriteAtlas(const std::filesystem::path& folder,
                std::span<const Vec3f> skin_positions,
                const Atlas& atlas);

// Reads the OBJ files back; `size` is read from texels.exr. Throws Error(kInput) with the file.
[[nodiscard]] Atlas ReadAtlas(const std::filesystem::path& folder);

}  // namespace dyxel
