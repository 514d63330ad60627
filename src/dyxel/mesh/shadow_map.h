// Visibility from a point or a direction by a depth map fitted to the surface.
#pragma once

#include <span>
#include <vector>

#include "dyxel/math/types.h"
#include "dyxel/mesh/rasterizer.h"

namespace dyxel {

// A depth map seen from an eye (perspective; fitted to the surface's outline as that eye sees it)
// or along a direction (orthographic). Made of no surface it lets all light through.
class ShadowMap {
 public:
  // From an eye (a lamp's or a camera's centre), world.
  static ShadowMap FromPoint(const Vec3f& eye,
                             std::span<const Vec3f> positions,
                             std::span<const Triangle> triangles,
                             int size);
  // `to_light` is the unit direction towards the light.
  static ShadowMap FromDirection(const Vec3f& to_light,
                                 std::span<const Vec3f> positions,
                                 std::span<const Triangle> triangles,
                                 int size);

  // Share in [0, 1] of a 3x3 neighbourhood of the map that reaches x (percentage-closer filter): 1
  // lit, 0 in shadow, between in a penumbra. `normal` offsets the look-up off the surface against
  // acne: it is exact but for some 3 texels around a shadow's edge. Thread-safe.
  [[nodiscard]] float Visible(const Vec3f& x, const Vec3f& normal) const;

 private:
  void Draw(std::span<const Vec3f> positions, std::span<const Triangle> triangles);

  Mat4f map_from_world_ = Mat4f::Identity();
  bool perspective_ = true;
  Vec3f eye_ = Vec3f::Zero();  // or to_light
  float texel_size_ = 0;       // metres at the surface (angular size × distance for perspective)
  int size_ = 0;
  std::vector<float> depth_;  // [size][size]
};

}  // namespace dyxel
