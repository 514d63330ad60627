// Surfaces over time: one topology, an atlas, and positions a time step. Tracked bodies and given
// meshes come the same way; nothing above knows the difference.
#pragma once

#include <span>
#include <vector>

#include "dyxel/math/types.h"
#include "dyxel/mesh/atlas.h"

namespace dyxel {

// The surface of one time step with what shading needs, per cut vertex of the atlas (C), world.
struct PosedSurface {
  std::vector<Vec3f> positions;  // (C)
  std::vector<Vec3f> normals;    // (C) unit: the model's smooth normals
  std::vector<Vec3f>
      tangents;  // (C) unit, along growing u of parameterization I, normal to `normals`
  std::vector<float>
      handedness;  // (C) ±1: bitangent = handedness · normal × tangent (glTF's TANGENT.w);
                   // +1 where I shows the surface unmirrored: the bitangent is "up" in the image
};

// Normals and tangents for skin positions (V). With `normal_positions` (V) given, normals and
// tangents are those of that (smoothed) surface, positions stay (`--smooth-normals`).
[[nodiscard]] PosedSurface PoseSurface(const Atlas& atlas,
                                       std::span<const Triangle> skin_triangles,
                                       std::span<const Vec3f> skin_positions,
                                       std::span<const Vec3f> normal_positions = {});

// The tangent frame of a point on a triangle: columns tangent, bitangent, normal (orthonormal):
// world_from_tangent. Interpolated from the vertices with barycentrics.
[[nodiscard]] Mat3f TangentFrame(const PosedSurface& surface,
                                 const Triangle& triangle,
                                 const Vec3f& bary);

}  // namespace dyxel
