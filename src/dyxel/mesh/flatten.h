// Flat starts on small disks: Tutte's embedding, quasi-harmonic maps, and projected Newton descent
// of the symmetric Dirichlet energy. Sparse Cholesky each; meant for up to some thousand vertices
// (parameterize.h takes the result to the full mesh). docs/method.md (A2, A3).
#pragma once

#include <span>
#include <vector>

#include "dyxel/mesh/distortion.h"

namespace dyxel::internal {

// A disk in the plane while it is worked on.
struct FlatMesh {
  std::vector<Triangle> triangles;  // (F)
  std::vector<RestTriangle> rest;   // (F)
  std::vector<Vec2d> uv;            // (V)
};

// Which coordinates of a vertex may move: bit 0 u, bit 1 v.
using Freedom = std::vector<unsigned char>;  // (V)

[[nodiscard]] double TotalEnergy(const FlatMesh& mesh);
[[nodiscard]] int CountFlips(const FlatMesh& mesh);

// Moves all vertices that `fixed` doesn't hold to the weighted mean of their neighbours with
// uniform weights: free of flips if the fixed border is convex (Tutte 1963; Floater 1997).
void TutteEmbedding(FlatMesh& mesh, std::span<const char> fixed);

// Quasi-harmonic map with the border held (after Zayer, Rössl, Seidel 2005): solves
// div(C grad u) = 0 with C = I, then takes C of each triangle from the distortion (JᵀJ)^½ of the
// map so far, so that what is stretched stiffens, and solves again, until the symmetric Dirichlet
// energy no longer falls. Leaves the best map without flips; false, and nothing changed, if there
// is none.
[[nodiscard]] bool QuasiHarmonicMap(FlatMesh& mesh,
                                    std::span<const char> fixed,
                                    int max_rounds = 10);

// Projected Newton steps with a line search that keeps every triangle's orientation, until the
// energy falls by less than `tolerance` of itself in a step. Needs a map without flips. Returns
// the energy.
double DescendNewton(FlatMesh& mesh, const Freedom& freedom, int max_steps, double tolerance);

}  // namespace dyxel::internal
