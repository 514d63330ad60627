// The deformation graph: nodes on the skin that follow the bones under them and may be shifted, so
// that cloth moves over the body; docs/method.md (G1), (G2). Every glTF viewer plays it, since a
// node is a joint like any other.
#pragma once

#include "dyxel/body/actor.h"

namespace dyxel {

// The actor with nodes at least `spacing` metres apart (along the skin, no skin vertex farther than
// that from a node) after its joints, and its skin hung on them: the four nearest nodes of a
// vertex, weights falling to 0 at the fifth's distance, so that shifts change smoothly over the
// skin. Where all nodes around a vertex move rigidly so does it; at bends it moves as the blend of
// their motions. A node's parent is the bone that it follows most. `actor` has bones only.
// Past the papers (A's skin follows its bones); after Sumner, Schmid and Pauly (2007).
[[nodiscard]] Actor WithNodes(const Actor& actor, double spacing = 0.075);

// The pairs of nodes that move a vertex together, ascending, as indices into Pose::shifts.
[[nodiscard]] std::vector<std::array<int, 2>> NodeEdges(const Actor& actor);

}  // namespace dyxel
