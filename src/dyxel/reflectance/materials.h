// Materials: texels clustered by colour (A §VI-A); docs/method.md (R8).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dyxel/reflectance/dyxels.h"

namespace dyxel {

struct ClusterOptions {
  int materials = 0;        // 0: as few as explain `explained` of the colours' variance
  int max_materials = 8;    // of an automatic choice
  double explained = 0.95;  // in (0, 1)
  int smoothing = 4;        // rounds of majority over the graph
  double min_patch = 2e-4;  // share of the known texels below which a patch joins its surroundings
  std::uint64_t seed = 1;
};

// A material for each texel with confidence > 0, -1 elsewhere; numbered by falling number of
// texels. K-means (k-means++ starts, seeded) over CIELAB of the diffuse albedo, lightness counting
// half, weighted by confidence; then majority over the graph,
// and patches (connected texels of one material) that are too small join what surrounds them.
// `diffuse` is [channel][K], shading
// removed. Deterministic.
[[nodiscard]] std::vector<int> ClusterMaterials(const std::array<std::vector<float>, 3>& diffuse,
                                                const std::vector<float>& confidence,
                                                const TexelGraph& graph,
                                                const ClusterOptions& options = {});

namespace internal {
// CIELAB (D65) of linear BT.709, white = 1.
[[nodiscard]] std::array<float, 3> Lab(float r, float g, float b);
}  // namespace internal

}  // namespace dyxel
