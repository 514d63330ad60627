#include "dyxel/math/rigid.h"

#include <gtest/gtest.h>

namespace dyxel {
namespace {

TEST(Rigid, InverseAndChain) {
  const Rigid b_from_a{Eigen::AngleAxisd(0.7, Vec3d(1, 2, 3).normalized()).toRotationMatrix(),
                       Vec3d(0.1, -2, 0.5)};
  const Rigid c_from_b{Eigen::AngleAxisd(-1.2, Vec3d::UnitY()).toRotationMatrix(), Vec3d(3, 1, 0)};
  const Vec3d x(0.3, 0.2, -0.9);
  EXPECT_LT((b_from_a.Inverse() * (b_from_a * x) - x).norm(), 1e-14);
  EXPECT_LT(((c_from_b * b_from_a) * x - c_from_b * (b_from_a * x)).norm(), 1e-14);
}

}  // namespace
}  // namespace dyxel
