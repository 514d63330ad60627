// Linear blend skinning and its derivatives (actor.h); docs/method.md (B3, B5).
#include <cassert>
#include <cstddef>

#include "dyxel/base/parallel.h"
#include "dyxel/body/actor.h"

namespace dyxel {
namespace {

// Vertices a task: large enough that a task is worth its start.
constexpr std::size_t kBlock = 2048;

struct Affine {
  Mat3f linear;
  Vec3f translation;
};

}  // namespace

void SkinPositions(const Actor& actor, const Pose& pose, std::span<Vec3f> out) {
  const std::size_t num_vertices = actor.skin.positions.size();
  assert(out.size() == num_vertices);
  std::vector<Affine> transforms;
  for (const Rigid& rigid : SkinTransforms(actor.skeleton, pose)) {
    transforms.push_back({rigid.rotation.cast<float>(), rigid.translation.cast<float>()});
  }
  ParallelForBlocks(num_vertices, kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const Vec3f& x = actor.skin.positions[v];
      Vec3f sum = Vec3f::Zero();
      for (std::size_t k = 0; k < 4; ++k) {
        const float weight = actor.joint_weights[v][k];
        if (weight == 0) continue;
        const Affine& t = transforms[static_cast<std::size_t>(actor.joint_indices[v][k])];
        sum += weight * (t.linear * x + t.translation);
      }
      out[v] = sum;
    }
  });
}

std::vector<Vec3f> SkinPositions(const Actor& actor, const Pose& pose) {
  std::vector<Vec3f> positions(actor.skin.positions.size());
  SkinPositions(actor, pose, positions);
  return positions;
}

// x = Σ_j w_j x_j with x_j = world_from_rest_j * rest, so that dx/da_d sums axes[d] × (x_j −
// origins[d]) w_j over the joints j whose chain has d.
Vec3d SkinVertexJacobian(const Actor& actor,
                         const PoseDerivatives& derivatives,
                         int vertex,
                         PointJacobian& jacobian) {
  const auto v = static_cast<std::size_t>(vertex);
  const Vec3d rest = actor.skin.positions[v].cast<double>();
  jacobian.setZero(3, derivatives.NumUnknowns());
  Vec3d x = Vec3d::Zero();
  for (std::size_t k = 0; k < 4; ++k) {
    const auto weight = static_cast<double>(actor.joint_weights[v][k]);
    if (weight == 0) continue;
    const auto joint = static_cast<std::size_t>(actor.joint_indices[v][k]);
    const Vec3d part = derivatives.world_from_rest[joint] * rest;
    x += weight * part;
    for (const int dof : derivatives.chains[joint]) {
      const auto d = static_cast<std::size_t>(dof);
      jacobian.col(6 + dof) += weight * derivatives.axes[d].cross(part - derivatives.origins[d]);
    }
  }
  jacobian.leftCols<3>().setIdentity();
  const Vec3d arm = x - derivatives.world_from_joint[0].translation;
  for (int i = 0; i < 3; ++i) jacobian.col(3 + i) = Vec3d::Unit(i).cross(arm);
  return x;
}

}  // namespace dyxel
