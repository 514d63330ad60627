// Cameras on a circle around the person, for turntables and previews.
#pragma once

#include <span>

#include "dyxel/capture/camera.h"
#include "dyxel/math/types.h"

namespace dyxel {

struct Orbit {
  Vec3d center = Vec3d::Zero();     // world: what every camera looks at
  double radius = 4;                // metres from it
  Vec3d up = Vec3d::UnitZ();        // unit: the axis
  double elevation = 0.15;          // radians above the horizon, within ±1.5
  double field_of_view = 0.6;       // radians over the smaller side of the picture
  int width = 1024, height = 1024;  // pixels
};

// The orbit from which all of `positions` (world) stay within the picture at every azimuth, with a
// margin of 4 %. Throws Error(kUsage) where there are none.
[[nodiscard]] Orbit FitOrbit(std::span<const Vec3f> positions,
                             const Vec3d& up,
                             int width = 1024,
                             int height = 1024,
                             double elevation = 0.15);

// The camera at `azimuth` (radians, counter-clockwise about up; at 0 it looks from the +x side, or
// from +y where up is x), upright.
[[nodiscard]] Camera OrbitCamera(const Orbit& orbit, double azimuth);

}  // namespace dyxel
