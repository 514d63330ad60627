// Meshes the zero set of a signed distance: naive surface nets (Gibson 1998), one vertex a cell
// that the surface crosses, drawn onto the surface along the gradient.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "dyxel/mesh/triangle_mesh.h"

namespace dyxel::studio {

// Grid lines of one axis, ascending; cells may differ in size.
using GridLines = std::vector<float>;

// Lines from `low` to `high`, `cell` apart, and `cell` · `factor` within any of the zones.
struct FineZone {
  float low, high, factor;
};
[[nodiscard]] GridLines MakeGridLines(float low,
                                      float high,
                                      float cell,
                                      std::span<const FineZone> zones = {});

// Closed as long as the surface stays off the grid's border; triangles counter-clockwise seen from
// outside (positive distance). `distance` may overestimate by at most a third: blocks of cells
// farther away than their size are not looked into. Called from many threads.
[[nodiscard]] TriangleMesh MeshDistance(const std::function<float(const Vec3f&)>& distance,
                                        const GridLines& x,
                                        const GridLines& y,
                                        const GridLines& z);

}  // namespace dyxel::studio
