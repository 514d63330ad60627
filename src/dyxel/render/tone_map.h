// Linear pictures for the eye: display scale, clamp, sRGB curve; docs/method.md (M1).
#pragma once

#include <optional>

#include "dyxel/image/image.h"
#include "dyxel/math/types.h"

namespace dyxel {

// `scale` times a linear picture, [h][w][3] or premultiplied [h][w][4], as 8 bits. With
// `background` (linear, unscaled) an RGBA picture is laid over it and the result is [h][w][3];
// without, it keeps straight (not premultiplied) alpha, as PNG wants it.
[[nodiscard]] ImageU8 ToDisplay(const ImageF& picture,
                                float scale,
                                const std::optional<Rgb>& background = std::nullopt);

// A normal pass for the eye: 0.5 + 0.5 n, over black where nothing is covered. [h][w][3].
[[nodiscard]] ImageU8 NormalsToDisplay(const ImageF& normals);

// A material pass for the eye: each index a colour of its own (of twelve, then again from the
// first), over black where nothing is covered. [h][w][3].
[[nodiscard]] ImageU8 MaterialsToDisplay(const ImageF& materials);

}  // namespace dyxel
