// Rigid motions, named target_from_source: x_in_target = target_from_source * x_in_source.
#pragma once

#include "dyxel/math/types.h"

namespace dyxel {

struct Rigid {
  Mat3d rotation = Mat3d::Identity();
  Vec3d translation = Vec3d::Zero();

  [[nodiscard]] Vec3d operator*(const Vec3d& x) const { return rotation * x + translation; }
  [[nodiscard]] Rigid operator*(const Rigid& other) const {
    return {rotation * other.rotation, rotation * other.translation + translation};
  }
  [[nodiscard]] Rigid Inverse() const {
    return {rotation.transpose(), -(rotation.transpose() * translation)};
  }
};

}  // namespace dyxel
