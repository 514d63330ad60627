// A body of fewer triangles for drawing and matching outlines.
#pragma once

#include "dyxel/body/actor.h"

namespace dyxel::internal {

// The body simplified (quadric error; meshoptimizer) to about `triangles`, on a subset of its
// vertices with their weights: it takes poses and proportions as the body does. A body that is
// small enough already comes back as it is.
[[nodiscard]] Actor ReduceBody(const Actor& body, int triangles);

}  // namespace dyxel::internal
