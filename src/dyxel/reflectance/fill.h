// Values for the texels that nothing measured; docs/method.md (R11).
#pragma once

#include <vector>

#include "dyxel/reflectance/dyxels.h"
#include "dyxel/reflectance/reflectance.h"

namespace dyxel {

// Completes the diffuse albedo and the materials. `trust` is (K): 0 where nothing was measured
// (filled = 1), else how much the texel's albedo counts against its neighbours'; from kSureTrust on
// it stays as it is.
//
// A texel without measurement gets the material of the nearest sure texel of the graph (measured,
// where its part of the graph has no sure one). Albedos solve, by Jacobi rounds within a material,
//   trust (ρ − measured) + Σ_neighbours (ρ − ρ_y) + ε (ρ − mean of the material) = 0:
// near measured texels they continue those, far from them they are the material's mean. Texels that
// the graph joins to no measured one get the largest material and its mean. Materials' mean_diffuse
// must be set, the largest being the first. Normals of filled texels become the model's.
inline constexpr float kSureTrust = 3;
void FillUnmeasured(const TexelGraph& graph,
                    const std::vector<float>& trust,
                    Reflectance& reflectance);

}  // namespace dyxel
