// Deferred shading: blocks of surface points in structures of arrays, lit by lights with shadow
// maps: docs/method.md (E2). A template over the lanes; the scalar instance is the reference.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "dyxel/capture/light.h"
#include "dyxel/mesh/shadow_map.h"

namespace dyxel::internal {

// A light as the kernel reads it.
struct ShadeLight {
  bool directional = false;
  std::array<float, 3> position = {};   // spot, point
  std::array<float, 3> direction = {};  // directional: towards the light; spot: the axis
  std::array<float, 3> power = {};      // intensity, or irradiance of a directional light
  float cos_outer = -2;                 // point lights: a cone that nothing is outside of
  float inverse_cone = 1;               // 1 / (cos_inner - cos_outer)
};
[[nodiscard]] ShadeLight MakeShadeLight(const Light& light);

inline constexpr int kShadeBlock = 64;  // points a block; a multiple of every lane count
inline constexpr int kMaxSpecular = 8;  // specular parameters of a BRDF at most

// Points of one block, each array [axis or channel][point]; `count` of them are used, the rest must
// hold finite numbers.
struct ShadeBlock {
  using Row = std::array<float, kShadeBlock>;
  int count = 0;
  alignas(64) std::array<Row, 3> position;             // world
  alignas(64) std::array<Row, 3> side;                 // unit model normal, on the viewer's side
  alignas(64) std::array<Row, 3> normal;               // unit shading normal
  alignas(64) std::array<Row, 3> view;                 // unit, towards the camera
  alignas(64) std::array<Row, 3> diffuse;              // albedo
  alignas(64) std::array<Row, kMaxSpecular> specular;  // parameters of the BRDF
  alignas(64) std::array<Row, 3> radiance;             // out
};

// radiance = Σ_lights visibility · irradiance · max(0, n·l) · f_r (equation R1), from lights on the
// positive side of both normals. `shadows` is empty (nothing casts shadows) or one a light. Throws
// Error(kUsage) where the table has no BRDF `model`. Instantiated for float and Lanes.
template <class T>
void Shade(std::string_view model,
           std::span<const ShadeLight> lights,
           std::span<const ShadowMap> shadows,
           ShadeBlock& block);

}  // namespace dyxel::internal
