// The look that a plain glTF viewer shows: the closest one of pbrMetallicRoughness with
// KHR_materials_specular and KHR_materials_ior to a material's BRDF; docs/method.md (E5).
//
//   f = g ρ_d (1 − F)/π + D V F,   F = w (F0 + (1 − F0)(1 − v·h)⁵)                      (E5)
//
// with GGX's D and height-correlated V of α = roughness², as the extensions define it: w is the
// specular factor, F0 comes from the index of refraction.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "dyxel/math/types.h"
#include "dyxel/reflectance/reflectance.h"

namespace dyxel {

struct BaseLook {
  float roughness = 1;     // in [0, 1]
  float specular = 0;      // w, in [0, 1]
  float diffuse_gain = 1;  // g
  float rms = 0;  // of the difference of n·l f from the BRDF's over the sampled directions
};

struct BaseLooks {
  float ior = 1.5F;             // one for all: a glTF material has one
  std::vector<BaseLook> looks;  // one a material
};

// Least squares of n·l f over light and view directions within 60° of the normal, errors weighted
// as a display shows them; roughness searched, w and g solved. A BRDF that
// already is GGX keeps its roughness and F0 and has g solved. F0 is the largest that any of the
// materials asks for. Throws Error(kUsage) for an unknown BRDF.
[[nodiscard]] BaseLooks FitBaseLooks(const std::string& model, std::span<const Material> materials);

// (E5) without the diffuse term's ρ_d: D V F and (1 − F)/π.
struct BaseLobes {
  double specular = 0;
  double diffuse = 0;
};
[[nodiscard]] BaseLobes EvaluateBaseLook(
    double roughness, double specular, double f0, double n_l, double n_v, double l_v);

}  // namespace dyxel
