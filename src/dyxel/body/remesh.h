// Isotropic remeshing of an implicit surface.
#pragma once

#include <functional>

#include "dyxel/body/polygonize.h"

namespace dyxel {

struct RemeshProblem {
  std::function<double(const Vec3d&)> edge_length;  // wanted at a point, metres
  // The surface's point near one, roughly in all rounds but the last.
  std::function<Vec3d(const Vec3d&, bool roughly)> project;
  int rounds = 6;
};

// Splits edges above 4/3 of the wanted length, collapses those below 4/5, flips towards valence
// six, relaxes tangentially and projects (Botsch and Kobbelt 2004). Vertices of the boundary stay
// in the plane y = 0. Sequential but for the projection: the same result for any number of threads.
[[nodiscard]] HalfMesh Remesh(const HalfMesh& mesh, const RemeshProblem& problem);

}  // namespace dyxel
