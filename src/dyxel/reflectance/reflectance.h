// What the reflectance stage estimates: a BRDF for every texel, with its confidence.
#pragma once

#include <string>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel {

// A material: texels that share specular behaviour.
struct Material {
  std::string name;             // "material0", …
  std::vector<float> specular;  // (P) parameters in the order of the model's SpecularNames()
  Rgb mean_diffuse = Rgb::Zero();
  int texels = 0;
};

// Structures of arrays over the K texels of the grid.
struct Reflectance {
  std::string model;                          // name in the BRDF table: "phong", "ggx"
  std::vector<Material> materials;            // (M)
  std::array<std::vector<float>, 3> diffuse;  // [channel][K] diffuse albedo ρ_d
  std::vector<std::vector<float>> specular;   // [P][K] specular parameters
  std::vector<int> material;                  // (K) index into materials
  std::vector<Vec3f> normal;                  // (K) unit, tangent frame; (0, 0, 1) is the model's
  std::vector<float> confidence;              // (K) in [0, 1]
  std::vector<std::uint8_t> filled;           // (K) 1 where nothing was measured
};

}  // namespace dyxel
