#include "dyxel/studio/person.h"

#include <cmath>

#include "dyxel/base/parallel.h"
#include "dyxel/studio/cloth_folds.h"
#include "dyxel/studio/noise.h"
#include "dyxel/studio/surface_nets.h"

namespace dyxel::studio {
namespace {

constexpr std::size_t kVertexBlock = 1024;

struct DualQuaternion {
  Eigen::Vector4f real = Eigen::Vector4f::Zero();
  Eigen::Vector4f dual = Eigen::Vector4f::Zero();
};

DualQuaternion ToDual(const JointMotion& m) {
  const Quatf t(0, m.translation.x(), m.translation.y(), m.translation.z());
  return {m.rotation.coeffs(), 0.5F * (t * m.rotation).coeffs()};
}

// The direction in which the shirt's pattern may slide at a rest position: down the trunk, along
// the sleeves.
Vec3f SlideDirection(const Vec3f& rest) {
  const auto& joints = RestSkeleton();
  const bool left = rest.y() > 0;
  const Vec3f shoulder = joints[left ? kLeftUpperArm : kRightUpperArm].position;
  const Vec3f elbow = joints[left ? kLeftForearm : kRightForearm].position;
  const Vec3f along = (elbow - shoulder).normalized();
  const float sleeve = SmoothStep(0.0F, 0.08F, (rest - shoulder).dot(along));
  return ((1 - sleeve) * -Vec3f::UnitZ() + sleeve * along).normalized();
}

}  // namespace

PersonMesh BuildPerson(float cell) {
  // Hands and head are as fine as an axis-aligned grid allows without refining the rest.
  const std::array<FineZone, 2> across = {{{-0.80F, -0.50F, 0.7F}, {0.50F, 0.80F, 0.7F}}};
  const std::array<FineZone, 1> upright = {{{1.50F, 1.80F, 0.6F}}};
  const GridLines x = MakeGridLines(-0.25F, 0.30F, cell);
  const GridLines y = MakeGridLines(-0.78F, 0.78F, cell, across);
  const GridLines z = MakeGridLines(-0.03F, 1.82F, cell, upright);
  PersonMesh person;
  person.rest = MeshDistance([](const Vec3f& p) { return EvaluatePerson(p); }, x, y, z);
  const std::size_t n = person.rest.positions.size();
  person.covers.resize(n);
  person.weights.resize(n);
  ParallelFor(n, [&](std::size_t v) {
    person.covers[v] = EvaluateCovers(person.rest.positions[v]);
    person.weights[v] = JointWeights(person.rest.positions[v]);
  });
  return person;
}

PosedPerson PosePerson(const PersonMesh& person,
                       const Posture& posture,
                       float fold_strength,
                       float slide) {
  const std::array<JointMotion, kNumJoints> motion = MoveJoints(posture);
  std::array<DualQuaternion, kNumJoints> dual;
  for (std::size_t j = 0; j < kNumJoints; ++j) {
    dual[j] = ToDual(motion[j]);
    // All on the pelvis's half of the sphere, so that blending takes the short way.
    if (dual[j].real.dot(dual[0].real) < 0) {
      dual[j].real = -dual[j].real;
      dual[j].dual = -dual[j].dual;
    }
  }
  const std::size_t n = person.rest.positions.size();
  PosedPerson posed;
  posed.positions.resize(n);
  posed.pattern = person.rest.positions;
  posed.shift.assign(n, Vec3f::Zero());
  std::vector<Quatf> turn(n);
  ParallelForBlocks(n, kVertexBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      DualQuaternion q;
      for (std::size_t j = 0; j < kNumJoints; ++j) {
        const float w = person.weights[v][j];
        if (w < 1e-4F) continue;
        q.real += w * dual[j].real;
        q.dual += w * dual[j].dual;
      }
      const float scale = 1 / q.real.norm();
      const Quatf rotation(Eigen::Vector4f(q.real * scale));
      const Quatf moved = Quatf(Eigen::Vector4f(q.dual * scale)) * rotation.conjugate();
      posed.positions[v] = rotation * person.rest.positions[v] + 2 * moved.vec();
      turn[v] = rotation;
    }
  });
  posed.normals = VertexNormals(posed.positions, person.rest.triangles);
  ParallelForBlocks(n, kVertexBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      const Vec3f& rest = person.rest.positions[v];
      posed.positions[v] +=
          fold_strength * FoldHeight(rest, person.covers[v], posture) * posed.normals[v];
    }
  });
  posed.normals = VertexNormals(posed.positions, person.rest.triangles);
  if (slide != 0) {
    for (std::size_t v = 0; v < n; ++v) {
      const CoverDistances& d = person.covers[v];
      bool shirt = true;
      for (std::size_t c = 0; c < kNumCovers; ++c) shirt = shirt && d[kShirt] <= d[c];
      if (!shirt) continue;
      const Vec3f moved = slide * SlideDirection(person.rest.positions[v]);
      posed.pattern[v] = person.rest.positions[v] - moved;
      const Vec3f in_world = turn[v] * moved;
      posed.shift[v] = in_world - posed.normals[v] * posed.normals[v].dot(in_world);
    }
  }
  for (std::size_t j = 0; j < kNumJoints; ++j) {
    posed.joints[j] = motion[j] * RestSkeleton()[j].position;
  }
  return posed;
}

}  // namespace dyxel::studio
