// The zero set of a field as triangles, by marching tetrahedra.
#pragma once

#include <functional>

#include "dyxel/math/types.h"

namespace dyxel {

struct HalfMesh {
  std::vector<Vec3d> positions;
  std::vector<Triangle> triangles;  // counter-clockwise seen from outside (where the field is > 0)
};

// The part of {distance = 0} with y ≥ 0 inside the box [low, high] (low.y = 0), as a manifold whose
// boundary lies exactly in y = 0; its largest piece only. `distance` is called concurrently; it is
// evaluated at `spacing` only where it is small, so it must not exceed twice the true distance.
// Cells are split into six tetrahedra each (Kuhn), so that the surface has no ambiguous case.
[[nodiscard]] HalfMesh PolygonizeLeftHalf(const std::function<double(const Vec3d&)>& distance,
                                          const Vec3d& low,
                                          const Vec3d& high,
                                          double spacing);

}  // namespace dyxel
