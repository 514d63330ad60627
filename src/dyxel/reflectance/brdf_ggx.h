// GGX microfacets (Walter et al. 2007) with height-correlated Smith shadowing (Heitz 2014) and
// Schlick's Fresnel term, over Burley's diffuse (SIGGRAPH course, 2012); docs/method.md (R6):
//   f = ρ_d B/π + D V F,   α = roughness²
//   D = α² / (π ((n·h)² (α² − 1) + 1)²)
//   V = ½ / (n·l √((n·v)² (1 − α²) + α²) + n·v √((n·l)² (1 − α²) + α²))
//   F = F0 + (1 − F0)(1 − l·h)⁵
//   B = (1 + (F90 − 1)(1 − n·l)⁵)(1 + (F90 − 1)(1 − n·v)⁵),  F90 = ½ + 2 roughness (l·h)²
// It is what glTF's material means, but for B (glTF: Lambert) and the diffuse part's (1 − F).
#pragma once

#include <array>

#include "dyxel/reflectance/shading.h"

namespace dyxel {

struct Ggx {
  static constexpr const char* kName = "ggx";
  static constexpr int kNumSpecular = 2;
  static constexpr std::array<SpecularInfo, kNumSpecular> kSpecular = {{
      {.name = "roughness", .min = 0.1, .max = 1, .initial = 0.5, .logarithmic = false},
      {.name = "f0", .min = 0, .max = 0.2, .initial = 0.03, .logarithmic = false},
  }};
  template <Real T>
  using Params = std::array<T, kNumSpecular>;

  template <Real T>
  static T DiffuseShape(const Params<T>& specular, const Cosines<T>& c) {
    const T zero(0);
    const T one(1);
    const T l_h2 = Select(zero < one + c.l_v, (one + c.l_v) * Constant<T>(0.5), zero);
    const T rise = T(2) * specular[0] * l_h2 - Constant<T>(0.5);
    const T shape = (one + rise * Pow5(one - c.n_l)) * (one + rise * Pow5(one - c.n_v));
    return Select((zero < c.n_l) & (zero < c.n_v), shape * Constant<T>(1 / kPiD), zero);
  }

  template <Real T>
  static T Specular(const Params<T>& specular, const Cosines<T>& c) {
    const T zero(0);
    const T one(1);
    const T tiny = Constant<T>(1e-4);
    const auto valid = (zero < c.n_l) & (zero < c.n_v);
    const T n_l = Select(tiny < c.n_l, c.n_l, tiny);
    const T n_v = Select(tiny < c.n_v, c.n_v, tiny);
    const T half = Select(tiny < one + c.l_v, (one + c.l_v) * Constant<T>(0.5), tiny);  // (l·h)²
    const T alpha = specular[0] * specular[0];
    const T a2 = alpha * alpha;

    const T sum = n_l + n_v;
    T n_h2 = sum * sum / (Constant<T>(4) * half);
    n_h2 = Select(n_h2 < one, n_h2, one);
    const T t = n_h2 * (a2 - one) + one;
    const T d = a2 / (t * t);
    const T v = Constant<T>(0.5 / kPiD) /
                (n_l * Sqrt(n_v * n_v * (one - a2) + a2) + n_v * Sqrt(n_l * n_l * (one - a2) + a2));
    const T fresnel = specular[1] + (one - specular[1]) * Pow5(one - Sqrt(half));
    return Select(valid, d * v * fresnel, zero);
  }

 private:
  template <Real T>
  static T Pow5(const T& x) {
    const T x2 = x * x;
    return x2 * x2 * x;
  }
};

}  // namespace dyxel
