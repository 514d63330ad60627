// The lights that a person names on the command line of `render` and `demo`.
#pragma once

#include <string>
#include <vector>

#include "dyxel/render/renderer.h"

namespace dyxel {

// "point:X,Y,Z:R,G,B", "directional:DX,DY,DZ:R,G,B" (the way the light travels, irradiance) or
// "spot:X,Y,Z:DX,DY,DZ:R,G,B:INNER,OUTER" (half-angles in radians). Throws Error(kUsage).
[[nodiscard]] Light ParseLight(const std::string& text);

// "FILE" or "FILE@RADIANS". Throws Error(kUsage | kInput).
[[nodiscard]] Environment ParseEnvironment(const std::string& text, const Vec3d& up);

// Two directional lights, a warm key and a cool fill, for a video that is shown under none.
[[nodiscard]] std::vector<Light> DefaultLights(const Vec3d& up);

}  // namespace dyxel
