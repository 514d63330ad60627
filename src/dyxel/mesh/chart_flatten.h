// Flattens one chart of a given surface: least-squares conformal maps (Lévy et al. 2002) as a
// start, then as rigid as possible (Liu et al. 2008).
#pragma once

#include <span>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel::internal {

struct FlatChart {
  std::vector<Vec2d> uv;  // (V) metres, total area that of the surface; triangles counter-clockwise
  int flips = 0;          // triangles not counter-clockwise
  // Symmetric Dirichlet energy over 4 (1: an isometry), without flipped triangles: the mean over
  // the area, and what 1 % of the area exceeds.
  double mean_energy = 1;
  double high_energy = 1;
};

// `triangles` use all of the vertices `positions` (V) and are connected. The map is free at all
// borders, of which there may be several. Nothing is thrown: a piece that has no good map comes
// back with flips or a high energy, and is to be cut.
[[nodiscard]] FlatChart FlattenChart(std::span<const Vec3f> positions,
                                     std::span<const Triangle> triangles);

}  // namespace dyxel::internal
