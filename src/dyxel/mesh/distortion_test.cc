#include "dyxel/mesh/distortion.h"

#include <cmath>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "dyxel/base/random.h"

namespace dyxel::internal {
namespace {

TEST(RestTriangle, GivesTheJacobianOfAnAffineMap) {
  const Vec3d a(0.1, 0.2, 0.3), b(1.0, 0.4, 0.1), c(0.3, 1.1, -0.2);
  const RestTriangle rest = MakeRestTriangle(a, b, c);
  EXPECT_NEAR(rest.area, (b - a).cross(c - a).norm() / 2, 1e-12);
  // Laid flat with its own lengths, the map is an isometry.
  const double ab = (b - a).norm(), foot = (c - a).dot(b - a) / ab;
  const Vec2d fa(0, 0), fb(ab, 0), fc(foot, std::sqrt((c - a).squaredNorm() - foot * foot));
  const Mat2d j = Jacobian(rest, fa, fb, fc);
  EXPECT_NEAR((j.transpose() * j - Mat2d::Identity()).norm(), 0, 1e-12);
  EXPECT_NEAR(j.determinant(), 1, 1e-12);
  EXPECT_NEAR(SymmetricDirichlet(j), 4, 1e-12);
  EXPECT_NEAR(SymmetricDirichlet(2 * j), 8.5, 1e-12);
  EXPECT_TRUE(std::isinf(SymmetricDirichlet(Jacobian(rest, fa, fc, fb))));
}

TEST(RestTriangle, ThickensSlivers) {
  const RestTriangle rest = MakeRestTriangle({0, 0, 0}, {1, 0, 0}, {0.5, 1e-9, 0});
  EXPECT_NEAR(rest.area, 0.5e-3, 1e-9);
}

TEST(SymmetricDirichlet, DerivativesMatchDifferences) {
  Random random(7);
  int indefinite = 0;
  for (int trial = 0; trial < 50; ++trial) {
    Mat2d j;
    do {
      for (int i = 0; i < 4; ++i) j(i) = 2 * static_cast<double>(random.Uniform()) - 0.7;
    } while (j.determinant() < 0.1);
    const DensityDerivatives d = DifferentiateSymmetricDirichlet(j);
    EXPECT_NEAR(d.value, SymmetricDirichlet(j), 1e-12 * d.value);
    const double h = 1e-5;
    Mat4d numeric;
    for (int i = 0; i < 4; ++i) {
      Mat2d up = j, down = j;
      up(i) += h;
      down(i) -= h;
      EXPECT_NEAR(d.gradient[i],
                  (SymmetricDirichlet(up) - SymmetricDirichlet(down)) / (2 * h),
                  1e-5 * (1 + d.gradient.norm()));
      numeric.col(i) = (DifferentiateSymmetricDirichlet(up).gradient -
                        DifferentiateSymmetricDirichlet(down).gradient) /
                       (2 * h);
    }
    // The Hessian is the true one less its negative part.
    const Eigen::SelfAdjointEigenSolver<Mat4d> eigen((numeric + numeric.transpose()) / 2);
    indefinite += eigen.eigenvalues()[0] < -1e-3 ? 1 : 0;
    const Mat4d expected = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
                           eigen.eigenvectors().transpose();
    EXPECT_LT((d.hessian - expected).norm(), 1e-4 * (1 + expected.norm()));
  }
  EXPECT_GT(indefinite, 5);  // the projection was put to the test
}

}  // namespace
}  // namespace dyxel::internal
