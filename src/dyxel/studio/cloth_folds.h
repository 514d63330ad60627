// Wrinkles of the studio's garments: heights over the smooth cloth that come and go with the bends
// of the joints, run along the garment and wander as the cloth slides.
#pragma once

#include "dyxel/math/types.h"
#include "dyxel/studio/body_shape.h"
#include "dyxel/studio/motion.h"

namespace dyxel::studio {

// Height in metres along the outward normal at a rest position, times `strength`; 0 off the cloth.
[[nodiscard]] float FoldHeight(const Vec3f& rest,
                               const CoverDistances& covers,
                               const Posture& posture);

}  // namespace dyxel::studio
