// The studio's person as a mesh at rest and in a posture.
#pragma once

#include <array>
#include <vector>

#include "dyxel/math/types.h"
#include "dyxel/mesh/triangle_mesh.h"
#include "dyxel/studio/body_shape.h"
#include "dyxel/studio/motion.h"

namespace dyxel::studio {

struct PersonMesh {
  TriangleMesh rest;                   // body frame, closed, one topology for every frame
  std::vector<CoverDistances> covers;  // (V) which solid is outermost: the smallest
  std::vector<std::array<float, kNumJoints>> weights;  // (V)
};

// `cell` is the size of the mesh's cells, metres; hands and head are finer.
[[nodiscard]] PersonMesh BuildPerson(float cell);

struct PosedPerson {
  std::vector<Vec3f> positions;  // (V) world
  std::vector<Vec3f> normals;    // (V) unit, outward
  std::vector<Vec3f> pattern;    // (V) where in the rest frame the cloth's pattern is looked up
  std::vector<Vec3f> shift;      // (V) how far the pattern has slid over the body, world
  std::array<Vec3f, kNumJoints> joints;  // world
};

// `slide` is how far (metres) the shirt's pattern has slid down the trunk and along the sleeves.
// Skinning by dual quaternions (Kavan et al. 2007), then the folds along the normals.
[[nodiscard]] PosedPerson PosePerson(const PersonMesh& person,
                                     const Posture& posture,
                                     float fold_strength,
                                     float slide);

}  // namespace dyxel::studio
