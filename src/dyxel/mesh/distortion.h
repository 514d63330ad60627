// Distortion of a map from a surface to the plane: the symmetric Dirichlet energy, a triangle at a
// time, and the rest shapes that it is measured against; docs/method.md (A2).
#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>

#include "dyxel/math/types.h"

namespace dyxel::internal {

using Mat2d = Eigen::Matrix2d;

// A triangle of the surface in its own plane. The map's Jacobian is J = Σ_k uv_k · gradient_kᵀ.
struct RestTriangle {
  double area = 0;
  std::array<Vec2d, 3> gradient;  // of the hat function of each corner, 1/m
};

// Rest shape of the triangle abc. One thinner than 1 : 1000 is thickened to that, so that slivers
// of the mesh neither blow up nor vanish.
[[nodiscard]] RestTriangle MakeRestTriangle(const Vec3d& a, const Vec3d& b, const Vec3d& c);

[[nodiscard]] inline Mat2d Jacobian(const RestTriangle& rest,
                                    const Vec2d& a,
                                    const Vec2d& b,
                                    const Vec2d& c) {
  return a * rest.gradient[0].transpose() + b * rest.gradient[1].transpose() +
         c * rest.gradient[2].transpose();
}

// Symmetric Dirichlet energy density |J|² + |J⁻¹|², 4 for an isometry; infinity where det J <= 0
// (Smith and Schaefer 2015).
[[nodiscard]] double SymmetricDirichlet(const Mat2d& jacobian);

// The same with gradient (4) and positive semidefinite Hessian (4, 4) by vec J, column major. The
// Hessian's negative eigenvalues are set to 0 (projected Newton).
struct DensityDerivatives {
  double value = 0;
  Vec4d gradient;
  Mat4d hessian;
};
[[nodiscard]] DensityDerivatives DifferentiateSymmetricDirichlet(const Mat2d& jacobian);

// Twice the signed area of the triangle abc in the plane.
[[nodiscard]] inline double DoubleArea(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
}

}  // namespace dyxel::internal
