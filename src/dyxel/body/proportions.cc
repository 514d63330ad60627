// Proportions of a body: anisotropic scaling of each segment about its joint, blended by the
// skinning weights; docs/method.md (B6).
#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "dyxel/base/error.h"
#include "dyxel/body/actor.h"

namespace dyxel {
namespace {

constexpr std::array<std::string_view, 10> kKinds = {"pelvis",
                                                     "abdomen",
                                                     "chest",
                                                     "head",
                                                     "upper_arm",
                                                     "lower_arm",
                                                     "hand",
                                                     "thigh",
                                                     "shank",
                                                     "foot"};

int KindOf(const std::string& joint) {
  std::string_view name = joint;
  if (name.starts_with("l_") || name.starts_with("r_")) name.remove_prefix(2);
  const auto* const found = std::find(kKinds.begin(), kKinds.end(), name);
  return found == kKinds.end() ? -1 : static_cast<int>(found - kKinds.begin());
}

// Direction of each joint's bone at rest: limbs towards their child, hands and shanks' ends on from
// their parent, feet level and forward as the skin lies, the trunk upwards.
std::vector<Vec3d> BoneDirections(const Actor& body) {
  const std::vector<Joint>& joints = body.skeleton.joints;
  const std::vector<Vec3d> rest = body.skeleton.RestPositions();
  std::vector<Vec3d> directions(joints.size(), Vec3d::UnitZ());
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const int kind = KindOf(joints[j].name);
    if (kind >= 0 && kKinds[static_cast<std::size_t>(kind)] == "foot") {
      Vec3d mean = Vec3d::Zero();
      for (std::size_t v = 0; v < body.skin.positions.size(); ++v) {
        if (body.joint_indices[v][0] != static_cast<int>(j)) continue;
        mean += body.skin.positions[v].cast<double>() - rest[j];
      }
      mean[2] = 0;
      directions[j] = mean.norm() > 0 ? Vec3d(mean.normalized()) : Vec3d(Vec3d::UnitX());
      continue;
    }
    if (kind < 4) continue;
    // The only child, if there is one; else on from the parent.
    const Joint* child = nullptr;
    for (const Joint& other : joints) {
      if (other.parent == static_cast<int>(j)) child = &other;
    }
    directions[j] = (child != nullptr ? child->offset : joints[j].offset).normalized();
  }
  return directions;
}

}  // namespace

std::span<const std::string_view> SegmentKinds() { return kKinds; }

Proportions TemplateProportions() {
  return {1.0, std::vector<double>(kKinds.size(), 1.0), std::vector<double>(kKinds.size(), 1.0)};
}

// A joint's children and skin move by S = g I + (l − g) a aᵀ about it, with the bone's direction a,
// its length l and girth g. The skin blends the segments' maps, which agree at their common joints.
Actor ApplyProportions(const Actor& body_template, const Proportions& proportions) {
  Require(proportions.lengths.size() == kKinds.size() && proportions.girths.size() == kKinds.size(),
          Fault::kUsage,
          "proportions: {} lengths and {} girths, but there are {} kinds of segments",
          proportions.lengths.size(),
          proportions.girths.size(),
          kKinds.size());
  auto positive = [](double x) { return x > 0; };
  Require(positive(proportions.height) &&
              std::all_of(proportions.lengths.begin(), proportions.lengths.end(), positive) &&
              std::all_of(proportions.girths.begin(), proportions.girths.end(), positive),
          Fault::kUsage,
          "proportions: height, lengths and girths must be above 0");

  Actor body = body_template;
  std::vector<Joint>& joints = body.skeleton.joints;
  const std::vector<Vec3d> directions = BoneDirections(body_template);
  const std::vector<Vec3d> rest = body_template.skeleton.RestPositions();
  std::vector<Mat3d> scales;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const int kind = KindOf(joints[j].name);
    const double length = kind < 0 ? 1 : proportions.lengths[static_cast<std::size_t>(kind)];
    const double girth = kind < 0 ? 1 : proportions.girths[static_cast<std::size_t>(kind)];
    scales.emplace_back(girth * Mat3d::Identity() +
                        (length - girth) * directions[j] * directions[j].transpose());
  }
  for (Joint& joint : joints) {
    if (joint.parent < 0) continue;
    const auto parent = static_cast<std::size_t>(joint.parent);
    joint.offset += (scales[parent] - Mat3d::Identity()) * joint.offset;
  }

  // As displacements, so that the template's own proportions give exactly the template.
  const std::vector<Vec3d> moved = body.skeleton.RestPositions();
  float lowest_before = 1e30F;
  float lowest = 1e30F;
  for (std::size_t v = 0; v < body.skin.positions.size(); ++v) {
    Vec3f& x = body.skin.positions[v];
    const Vec3d from = x.cast<double>();
    Vec3d displacement = Vec3d::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      const auto j = static_cast<std::size_t>(body.joint_indices[v][k]);
      displacement += static_cast<double>(body.joint_weights[v][k]) *
                      ((scales[j] - Mat3d::Identity()) * (from - rest[j]) + (moved[j] - rest[j]));
    }
    lowest_before = std::min(lowest_before, x[2]);
    x = (from + displacement).cast<float>();
    lowest = std::min(lowest, x[2]);
  }

  // The soles stay on their floor; the height scales everything about the origin.
  const float rise = lowest_before - lowest;
  const auto height = static_cast<float>(proportions.height);
  joints[0].offset[2] += static_cast<double>(rise);
  for (Vec3f& x : body.skin.positions) x = height * (x + rise * Vec3f::UnitZ());
  for (Joint& joint : joints) joint.offset *= proportions.height;
  return body;
}

}  // namespace dyxel
