// Calibrated lamps and environments (docs/capture-format.md); docs/method.md (E1, E3).
#pragma once

#include <string>

#include "dyxel/image/image.h"
#include "dyxel/math/types.h"

namespace dyxel {

enum class LightType { kSpot, kPoint, kDirectional };

struct Light {
  std::string name;
  LightType type = LightType::kPoint;
  Vec3d position = Vec3d::Zero();     // spot, point: world, metres
  Vec3d direction = -Vec3d::UnitZ();  // spot: axis; directional: the way the light travels; unit
  Rgb intensity = Rgb::Zero();        // spot, point: radiant intensity on the axis
  Rgb irradiance = Rgb::Zero();       // directional: on a facing surface
  double cone_inner = 0, cone_outer = 0;  // spot: half-angles, radians
};

// What a light gives to a point that faces it, visibility aside.
struct Illumination {
  Vec3f to_light;  // unit vector from the point towards the light
  float distance;  // metres; infinity for a directional light
  Rgb irradiance;  // at normal incidence, 1/d² and the cone's falloff included
  float cone;      // falloff of the spot cone alone, in [0, 1]; 1 for others
};

[[nodiscard]] Illumination Illuminate(const Light& light, const Vec3f& x_in_world);

// A latitude-longitude map of incident radiance about `up`, turned by `rotation` (radians,
// counter-clockwise about up). Direction and pixel agree as capture-format.md says.
struct Environment {
  ImageF radiance;  // [h][w][3], row 0 at the top (+up)
  double rotation = 0;
  Vec3d up = Vec3d::UnitZ();

  // Radiance arriving from the unit world direction d, bilinear.
  [[nodiscard]] Rgb Radiance(const Vec3f& direction) const;
  // The unit world direction of image position (u, v) in [0, 1]².
  [[nodiscard]] Vec3f Direction(double u, double v) const;
};

}  // namespace dyxel
