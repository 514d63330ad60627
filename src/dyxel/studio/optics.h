// The studio's own cameras, lamps and environment, written from capture-format.md and tested
// against closed forms; capture/ has the pipeline's.
#pragma once

#include <vector>

#include "dyxel/capture/camera.h"
#include "dyxel/capture/light.h"
#include "dyxel/image/image.h"
#include "dyxel/math/types.h"

namespace dyxel::studio {

// Rays through image positions (pixel centres at integer + 0.5). No lens distortion.
class PinholeRays {
 public:
  explicit PinholeRays(const Camera& camera);
  [[nodiscard]] const Vec3f& origin() const { return origin_; }
  // The viewing axis, unit.
  [[nodiscard]] const Vec3f& axis() const { return axis_; }
  [[nodiscard]] Vec3f Direction(float x, float y) const {
    return (corner_ + x * right_ + y * down_).normalized();
  }

 private:
  Vec3f origin_, axis_;
  Vec3f corner_, right_, down_;  // direction(x, y) ~ corner + x right + y down
};

// What a lamp sends to a point: the unit direction towards it, how far, and the irradiance at
// normal incidence.
struct LampRay {
  Vec3f to_light;
  float distance;
  Rgb irradiance;
};
[[nodiscard]] LampRay LampAt(const Light& light, const Vec3f& x);

// A camera at `position` whose axis passes through `target`, the world's z up in the picture.
[[nodiscard]] Camera AimCamera(const std::string& name,
                               const Vec3d& position,
                               const Vec3d& target,
                               int size_px,
                               double focal_in_widths);
// A spot of radiant intensity `intensity` at `position` towards `target`.
[[nodiscard]] Light AimSpot(const std::string& name,
                            const Vec3d& position,
                            const Vec3d& target,
                            const Rgb& intensity,
                            double cone_inner,
                            double cone_outer);

// A latitude-longitude map about z with importance sampling.
class StudioEnvironment {
 public:
  StudioEnvironment(ImageF radiance, double rotation);

  [[nodiscard]] const ImageF& radiance() const { return radiance_; }
  // Radiance from the unit direction d, bilinear between pixel centres, in turns about z.
  [[nodiscard]] Rgb Lookup(const Vec3f& d) const;

  // A direction drawn with density `pdf` (1/sr), roughly as the luminance; u, v in [0, 1).
  struct Sample {
    Vec3f direction;
    float pdf;
  };
  [[nodiscard]] Sample Draw(float u, float v) const;

 private:
  ImageF radiance_;
  float rotation_;
  std::vector<float> row_cdf_;     // [h + 1]
  std::vector<float> column_cdf_;  // [h][w + 1]
};

// A room with a window, lamps and a wooden floor: smooth, warm on one side, cool on the other.
[[nodiscard]] ImageF MakeEnvironmentMap(int height);

}  // namespace dyxel::studio
