#include "dyxel/mesh/distortion.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

namespace dyxel::internal {

RestTriangle MakeRestTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  // The longest edge lies along x, so that thickening moves only the far corner.
  const std::array<Vec3d, 3> p = {a, b, c};
  std::size_t k = 0;
  double longest = -1;
  for (std::size_t i = 0; i < 3; ++i) {
    const double length = (p[(i + 1) % 3] - p[i]).norm();
    if (length > longest) {
      longest = length;
      k = i;
    }
  }
  longest = std::max(longest, 1e-12);
  const Vec3d along = (p[(k + 1) % 3] - p[k]) / longest;
  const Vec3d side = p[(k + 2) % 3] - p[k];
  const double foot = side.dot(along);
  const double height = std::max((side - foot * along).norm(), 1e-3 * longest);
  RestTriangle rest;
  rest.area = longest * height / 2;
  rest.gradient[k] = {-1 / longest, (foot / longest - 1) / height};
  rest.gradient[(k + 1) % 3] = {1 / longest, -foot / longest / height};
  rest.gradient[(k + 2) % 3] = {0, 1 / height};
  return rest;
}

double SymmetricDirichlet(const Mat2d& jacobian) {
  const double det = jacobian.determinant();
  if (!(det > 0)) return std::numeric_limits<double>::infinity();
  return jacobian.squaredNorm() * (1 + 1 / (det * det));
}

DensityDerivatives DifferentiateSymmetricDirichlet(const Mat2d& jacobian) {
  const double d = jacobian.determinant(), q = jacobian.squaredNorm();
  const double i2 = 1 / (d * d), i3 = i2 / d;
  const Vec4d j(jacobian(0, 0), jacobian(1, 0), jacobian(0, 1), jacobian(1, 1));
  const Vec4d cofactor(jacobian(1, 1), -jacobian(0, 1), -jacobian(1, 0), jacobian(0, 0));
  DensityDerivatives out;
  out.value = q * (1 + i2);
  out.gradient = 2 * (1 + i2) * j - 2 * q * i3 * cofactor;
  Mat4d h = 2 * (1 + i2) * Mat4d::Identity() + 6 * q * i2 * i2 * cofactor * cofactor.transpose() -
            4 * i3 * (j * cofactor.transpose() + cofactor * j.transpose());
  const double twist = -2 * q * i3;  // times the Hessian of the determinant
  h(0, 3) += twist;
  h(3, 0) += twist;
  h(1, 2) -= twist;
  h(2, 1) -= twist;
  const Eigen::SelfAdjointEigenSolver<Mat4d> eigen(h);
  out.hessian = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() *
                eigen.eigenvectors().transpose();
  return out;
}

}  // namespace dyxel::internal
