// The reflectance on disk: FOLDER/{diffuse,specular,normal,confidence}.exr, {material,filled}.png
// and materials.json, all in the atlas' layout with filled gutters; and normal keys.
#pragma once

#include <filesystem>
#include <vector>

#include "dyxel/mesh/atlas.h"
#include "dyxel/reflectance/reflectance.h"
#include "dyxel/video/relightable_video.h"

namespace dyxel {

[[nodiscard]] std::vector<std::filesystem::path> ReflectanceFiles(
    const std::filesystem::path& folder);

void WriteReflectance(const std::filesystem::path& folder,
                      const TexelGrid& grid,
                      const Reflectance& reflectance);

// The arrays over the grid's K texels. Throws Error(kInput) with the file.
[[nodiscard]] Reflectance ReadReflectance(const std::filesystem::path& folder,
                                          const TexelGrid& grid);

// The same as maps to render from.
[[nodiscard]] MaterialMaps ReadMaterialMaps(const std::filesystem::path& folder);

// A map of unit normals (tangent frame) and their confidence: channels X, Y, Z, confidence.
void WriteNormals(const std::filesystem::path& file,
                  const TexelGrid& grid,
                  const std::vector<Vec3f>& normals,
                  const std::vector<float>& confidence);
[[nodiscard]] ImageF ReadNormals(const std::filesystem::path& file);  // [size][size][3]

// K values a channel as a map with filled gutters: [size][size][channels].
[[nodiscard]] ImageF ToMap(const TexelGrid& grid, const std::vector<std::vector<float>>& channels);

}  // namespace dyxel
