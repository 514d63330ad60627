// The atlas of a given surface (docs/method.md, A): open or closed, in any number of pieces.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "dyxel/mesh/atlas.h"
#include "dyxel/mesh/closed_atlas.h"

namespace dyxel {

// Texture coordinates of a PLY file's vertices (V), named s, t or u, v or texture_u, texture_v; v
// turned over: files count it upwards, an atlas downwards. Empty where the file has none.
[[nodiscard]] std::vector<Vec2f> ReadPlyTextureCoordinates(const std::filesystem::path& path);

// Whether texture coordinates `uv` (V, a vertex has one) can serve as parameterization I: all in
// [0, 1]², every triangle with area on the surface has some in the texture, all of a chart turn the
// same way, and next to no texel (1 in 1000) is claimed twice.
[[nodiscard]] bool IsUsableParameterization(std::span<const Vec3f> positions,
                                            std::span<const Triangle> triangles,
                                            std::span<const Vec2f> uv,
                                            int size);

// Parameterization I of the surface `positions` (V), `triangles` (F): `uv` (V) where it is given
// and usable, else charts that are cut (by the side the surface faces, until each has a map without
// flips, overlap or much distortion), flattened as rigidly as possible and packed at one scale,
// not mirrored, with `gutter` - 1 free texels or more between charts. Non-manifold edges are cut.
// Of the options `packing_trials` counts up to 300. uv_ii is empty. Deterministic. Throws
// Error(kInput) where the surface has no area.
[[nodiscard]] Atlas MakeGivenAtlas(std::span<const Vec3f> positions,
                                   std::span<const Triangle> triangles,
                                   std::span<const Vec2f> uv = {},
                                   const AtlasOptions& options = {});

}  // namespace dyxel
