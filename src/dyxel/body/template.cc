// The built-in template: the description (template_parts.h) meshed, and its weights.
#include <array>
#include <cstddef>

#include "dyxel/body/actor.h"
#include "dyxel/body/polygonize.h"
#include "dyxel/body/remesh.h"
#include "dyxel/body/skin_weights.h"
#include "dyxel/body/template_parts.h"

namespace dyxel {
namespace {

// Where a joint's child begins: beyond the plane through the joint. Left side and trunk.
struct Cut {
  int joint;
  Vec3d normal;  // towards the child
  double blend;  // metres: half the width over which the skin goes from parent to child
};

const std::vector<Cut>& Cuts() {
  static const std::vector<Cut> cuts = {
      {kAbdomen, Vec3d::UnitZ(), 0.055},
      {kChest, Vec3d::UnitZ(), 0.060},
      {kHead, Vec3d(0.3, 0, 1).normalized(), 0.030},
      {kLeftUpperArm, Vec3d(0, 0.98, -0.2).normalized(), 0.050},
      {kLeftLowerArm, BoneDirection(kLeftLowerArm), 0.026},
      {kLeftHand, BoneDirection(kLeftHand), 0.014},
      {kLeftThigh, Vec3d(0.15, 0.62, -0.77).normalized(), 0.050},
      {kLeftShank, BoneDirection(kLeftShank), 0.034},
      {kLeftFoot, Vec3d(0.35, 0, -1).normalized(), 0.020},
  };
  return cuts;
}

struct LabelledVertex {
  int label;
  double blend;
};

// The segment of a point of the skin with y ≥ 0, and the blend of the joints around it.
LabelledVertex Label(const Shape& shape, const std::vector<Vec3d>& rest, const Vec3d& x) {
  std::array<double, kNumSegments> beyond{};
  double blend = 0;
  double sum = 0;
  for (const Cut& cut : Cuts()) {
    const Vec3d& joint = rest[static_cast<std::size_t>(cut.joint)];
    beyond[static_cast<std::size_t>(cut.joint)] = cut.normal.dot(x - joint);
    const double d2 = (x - joint).squaredNorm() + 1e-4;
    const double weight = 1 / (d2 * d2);
    blend += weight * cut.blend;
    sum += weight;
  }
  blend /= sum;

  const double trunk =
      std::min(shape.SegmentDistance(kChest, x), shape.SegmentDistance(kPelvis, x));
  const double leg =
      std::min(std::min(shape.SegmentDistance(kLeftThigh, x), shape.SegmentDistance(kLeftShank, x)),
               shape.SegmentDistance(kLeftFoot, x));
  const double arm = std::min(
      std::min(shape.SegmentDistance(kLeftUpperArm, x), shape.SegmentDistance(kLeftLowerArm, x)),
      shape.SegmentDistance(kLeftHand, x));
  constexpr double kMelt = 0.012;  // where trunk and arm have melted into each other
  int label = kPelvis;
  if (beyond[kHead] > 0) {
    label = kHead;
  } else if (beyond[kLeftUpperArm] > 0 && arm < std::min(trunk + kMelt, leg)) {
    label = beyond[kLeftHand] > 0       ? kLeftHand
            : beyond[kLeftLowerArm] > 0 ? kLeftLowerArm
                                        : kLeftUpperArm;
  } else if (beyond[kLeftThigh] > 0 && leg < trunk + 0.03 && leg < arm) {
    label = beyond[kLeftFoot] > 0 ? kLeftFoot : beyond[kLeftShank] > 0 ? kLeftShank : kLeftThigh;
  } else if (beyond[kChest] > 0) {
    label = kChest;
  } else if (beyond[kAbdomen] > 0) {
    label = kAbdomen;
  }
  return {label, blend};
}

}  // namespace

Actor MakeBuiltInTemplate() {
  Actor actor;
  actor.skeleton = TemplateSkeleton();
  const Shape shape = TemplateShape();
  const HalfMesh rough = PolygonizeLeftHalf([&](const Vec3d& x) { return shape.Distance(x); },
                                            {-0.20, 0.0, -0.02},
                                            {0.26, 0.78, 1.80},
                                            0.008);
  const HalfMesh half = Remesh(
      rough, {.edge_length = TemplateEdgeLength, .project = [&](const Vec3d& x, bool roughly) {
                return shape.Project(x, roughly ? 1 : 4);
              }});

  // The right side is the left one's image; vertices of the middle are shared.
  const std::vector<Vec3d> rest = actor.skeleton.RestPositions();
  const std::size_t num_left = half.positions.size();
  std::vector<int> mirror(num_left);
  std::vector<int> labels;
  std::vector<float> blends;
  for (const Vec3d& x : half.positions) {
    const LabelledVertex vertex = Label(shape, rest, x);
    actor.skin.positions.emplace_back(x.cast<float>());
    labels.push_back(vertex.label);
    blends.push_back(static_cast<float>(vertex.blend));
  }
  for (std::size_t v = 0; v < num_left; ++v) {
    mirror[v] = static_cast<int>(v);
    if (half.positions[v][1] == 0) continue;
    const Vec3f& x = actor.skin.positions[v];
    mirror[v] = static_cast<int>(actor.skin.positions.size());
    mirror.push_back(static_cast<int>(v));
    labels.push_back(MirrorSegment(labels[v]));
    blends.push_back(blends[v]);
    actor.skin.positions.emplace_back(x[0], -x[1], x[2]);
  }
  actor.skin.triangles = half.triangles;
  for (const Triangle& t : half.triangles) {
    auto image = [&](int v) { return mirror[static_cast<std::size_t>(v)]; };
    actor.skin.triangles.push_back({image(t[0]), image(t[2]), image(t[1])});
  }

  std::array<int, kNumSegments> mirror_joints{};
  for (int j = 0; j < kNumSegments; ++j) {
    mirror_joints[static_cast<std::size_t>(j)] = MirrorSegment(j);
  }
  SkinWeights weights = DiffuseLabels(actor.skin,
                                      {.labels = labels,
                                       .blend = blends,
                                       .mirror_vertices = mirror,
                                       .mirror_joints = mirror_joints});
  actor.joint_indices = std::move(weights.joints);
  actor.joint_weights = std::move(weights.weights);
  return actor;
}

}  // namespace dyxel
