// What the studio's person looks like: materials and patterns at rest positions.
#pragma once

#include <array>
#include <string>

#include "dyxel/studio/body_shape.h"
#include "dyxel/studio/brdf.h"

namespace dyxel::studio {

enum class Pattern { kPlain, kStripes, kPlaid };

// One garment or the skin. Patterned cloth has further colours; plain cloth only `base`.
struct Cloth {
  StudioMaterial base;
  Pattern pattern = Pattern::kPlain;
  Rgb second = Rgb::Zero();
  Rgb third = Rgb::Zero();
  bool print = false;       // an emblem on the chest
  float variation = 0.05F;  // relative spread of the albedo: weave, stains
};

using Wardrobe = std::array<Cloth, kNumCovers>;

// The cover whose solid is outermost.
[[nodiscard]] Cover OutermostCover(const CoverDistances& covers);

// The material at a rest position; `covers` decides garment by garment.
[[nodiscard]] StudioMaterial MaterialAt(const Wardrobe& wardrobe,
                                        const Vec3f& pattern_at,
                                        const CoverDistances& covers);

}  // namespace dyxel::studio
