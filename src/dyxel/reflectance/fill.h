// Values for the texels that nothing measured (method.md 8).
#pragma once

#include "dyxel/reflectance/dyxels.h"
#include "dyxel/reflectance/reflectance.h"

namespace dyxel {

// Gives every texel with filled = 1 the material of the nearest measured texel of the graph and a
// diffuse albedo that continues its measured neighbours' of that material smoothly (Jacobi rounds
// of Laplace's equation); those that the graph does not join to any measured texel get the
// largest material and its mean albedo. Materials' mean_diffuse and texels must be set. Normals
// become the model's.
void FillUnmeasured(const TexelGraph& graph, Reflectance& reflectance);

}  // namespace dyxel
