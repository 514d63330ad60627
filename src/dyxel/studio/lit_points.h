// Direct light on eight points at a time: what pictures and the bounce share.
#pragma once

#include <array>

#include "dyxel/base/random.h"
#include "dyxel/studio/picture.h"

namespace dyxel::studio {

template <class T>
using Packet = std::array<T, kRays>;

// Points of the subject that are to be lit.
struct Points {
  Packet<bool> active{};
  Packet<int> sample{};    // which of its pixel's samples, all of one random stream
  Packet<Vec3f> position;  // where shadow rays begin
  Packet<Vec3f> normal;
  Packet<Vec3f> view;  // unit, towards the eye
  Packet<StudioMaterial> material;
};

// A point of the subject that a ray along `direction` has met: interpolated normal, material, and
// the shadow rays' origin lifted over the facets.
void PlaceOnSubject(const Subject& subject,
                    int triangle,
                    const Vec3f& bary,
                    const Vec3f& direction,
                    std::size_t lane,
                    Points& points);

// Radiance towards the eye by direct light, or with `irradiance_only` the irradiance. Draws the
// environment's directions from `random`.
[[nodiscard]] Packet<Rgb> DirectLight(const Subject& subject,
                                      const Lighting& lighting,
                                      const Points& points,
                                      bool irradiance_only,
                                      Packet<Random>& random);

}  // namespace dyxel::studio
