// Maps of a disk to the plane without flips: with a free border (parameterization I) and with the
// border on the unit square (II); docs/method.md (A2, A3).
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dyxel/mesh/distortion.h"

namespace dyxel::internal {

// Both start on a mesh of some hundred vertices: a quasi-harmonic map with its border on a convex
// curve, or Tutte's embedding where that flips; then projected Newton descent of the symmetric
// Dirichlet energy; then the mesh grows back to the full one, each level relaxed vertex by vertex.

// A map with a free border, in the surface's metres. Free of flips; it may overlap itself. With
// `stop_at_overlap` a map that does so on the coarsest mesh goes no further: it is left there, for
// the chart to be divided.
struct CoarseMap {
  std::vector<int> vertices;        // of the surface
  std::vector<Triangle> triangles;  // by index into `vertices`
  std::vector<Vec2d> uv;
  std::vector<int> border;  // loop, by index into `vertices`
  std::vector<std::array<int, 2>> crossings;
};
struct FreeMap {
  std::vector<Vec2d> uv;  // (V); empty if left coarse
  CoarseMap coarse;
};
[[nodiscard]] FreeMap FlattenFree(std::span<const Vec3f> positions,
                                  std::span<const Triangle> triangles,
                                  bool stop_at_overlap = false);

// A map onto the unit square: the border runs along it counter-clockwise; its corners are border
// vertices about a quarter of its length apart, and the others slide along their sides (V).
// No inner edge may join two border vertices.
[[nodiscard]] std::vector<Vec2d> FlattenToSquare(std::span<const Vec3f> positions,
                                                 std::span<const Triangle> triangles);

}  // namespace dyxel::internal
