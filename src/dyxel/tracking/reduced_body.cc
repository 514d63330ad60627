#include "dyxel/tracking/reduced_body.h"

#include <vector>

#include <meshoptimizer.h>

namespace dyxel::internal {

Actor ReduceBody(const Actor& body, int triangles) {
  if (static_cast<int>(body.skin.triangles.size()) <= triangles) return body;
  std::vector<unsigned> indices;
  for (const Triangle& t : body.skin.triangles) {
    for (const int v : t) indices.push_back(static_cast<unsigned>(v));
  }
  std::vector<unsigned> kept(indices.size());
  constexpr float kLargestError = 0.02F;  // of the body's extent
  const std::size_t count = meshopt_simplify(kept.data(),
                                             indices.data(),
                                             indices.size(),
                                             body.skin.positions[0].data(),
                                             body.skin.positions.size(),
                                             sizeof(Vec3f),
                                             static_cast<std::size_t>(triangles) * 3,
                                             kLargestError);
  Actor reduced;
  reduced.skeleton = body.skeleton;
  std::vector<int> slot(body.skin.positions.size(), -1);
  for (std::size_t i = 0; i + 2 < count; i += 3) {
    Triangle t{};
    for (std::size_t e = 0; e < 3; ++e) {
      int& s = slot[kept[i + e]];
      if (s < 0) {
        s = static_cast<int>(reduced.skin.positions.size());
        reduced.skin.positions.push_back(body.skin.positions[kept[i + e]]);
        reduced.joint_indices.push_back(body.joint_indices[kept[i + e]]);
        reduced.joint_weights.push_back(body.joint_weights[kept[i + e]]);
      }
      t[e] = s;
    }
    reduced.skin.triangles.push_back(t);
  }
  return reduced;
}

}  // namespace dyxel::internal
