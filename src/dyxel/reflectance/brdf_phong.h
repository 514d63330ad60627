// The modified Phong model, normalised (Lafortune and Willems 1994); docs/method.md (R5):
//   f = ρ_d/π + k_s (m + 2)/(2π) max(0, r·v)^m
#pragma once

#include <array>

#include "dyxel/reflectance/shading.h"

namespace dyxel {

struct Phong {
  static constexpr const char* kName = "phong";
  static constexpr int kNumSpecular = 2;
  static constexpr std::array<SpecularInfo, kNumSpecular> kSpecular = {{
      {.name = "k_s", .min = 0, .max = 0.5, .initial = 0.04, .logarithmic = false},
      {.name = "exponent", .min = 1, .max = 400, .initial = 10, .logarithmic = true},
  }};
  template <Real T>
  using Params = std::array<T, kNumSpecular>;

  template <Real T>
  static T DiffuseShape(const Params<T>& /*specular*/, const Cosines<T>& c) {
    const T zero(0);
    return Select((zero < c.n_l) & (zero < c.n_v), Constant<T>(1 / kPiD), zero);
  }

  template <Real T>
  static T Specular(const Params<T>& specular, const Cosines<T>& c) {
    const T zero(0);
    const T& m = specular[1];
    // Below the floor the lobe is less than 1e-4 of its peak for every m >= 1.
    const T floor = Constant<T>(1e-4);
    const T r_v = T(2) * c.n_l * c.n_v - c.l_v;
    const T lobe = Exp(m * Log(Clamp(r_v, floor, T(1))));
    const T f = specular[0] * (m + T(2)) * Constant<T>(0.5 / kPiD) * lobe;
    return Select((zero < c.n_l) & (zero < c.n_v) & (floor < r_v), f, zero);
  }
};

}  // namespace dyxel
