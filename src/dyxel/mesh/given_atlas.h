// The atlas of a given surface (docs/method.md, A): open or closed, in any number of pieces.
#pragma once

#include <span>

#include "dyxel/mesh/atlas.h"

namespace dyxel {

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
// not mirrored, with at least two free texels between charts. Non-manifold edges are cut. uv_ii is
// empty. Deterministic. Throws Error(kInput) where the surface has no area.
[[nodiscard]] Atlas MakeGivenAtlas(std::span<const Vec3f> positions,
                                   std::span<const Triangle> triangles,
                                   std::span<const Vec2f> uv = {},
                                   int size = 1024);

}  // namespace dyxel
