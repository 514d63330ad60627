#include "dyxel/capture/camera.h"

#include <algorithm>
#include <cmath>

namespace dyxel {
namespace {

using Mat2d = Eigen::Matrix2d;

// Brown-Conrady (OpenCV): the distorted place of normalised image coordinates p, and its Jacobian.
Vec2d Distort(const std::array<double, 5>& k, const Vec2d& p, Mat2d* jacobian) {
  const auto& [k1, k2, p1, p2, k3] = k;
  const double x = p.x();
  const double y = p.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  if (jacobian != nullptr) {
    const double slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3));  // d(radial)/d(r²) · 2
    const double cross = x * y * slope + 2 * p1 * x + 2 * p2 * y;
    *jacobian << radial + x * x * slope + 2 * p1 * y + 6 * p2 * x, cross, cross,
        radial + y * y * slope + 6 * p1 * y + 2 * p2 * x;
  }
  return {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
          y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

}  // namespace

bool Camera::HasDistortion() const {
  return std::any_of(distortion.begin(), distortion.end(), [](double k) { return k != 0; });
}

Vec2d Camera::Project(const Vec3d& x_in_world) const {
  const Vec3d x = cam_from_world * x_in_world;
  Vec2d p = x.head<2>() / x.z();
  if (HasDistortion()) p = Distort(distortion, p, nullptr);
  return {fx * p.x() + cx, fy * p.y() + cy};
}

Vec3d Camera::Ray(const Vec2d& pixel) const {
  const Vec2d target((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  Vec2d p = target;
  if (HasDistortion()) {
    // Newton's method; each step is halved while it does not get nearer.
    Mat2d jacobian;
    Vec2d error = Distort(distortion, p, &jacobian) - target;
    for (int i = 0; i < 30 && error.norm() > 1e-14; ++i) {
      const Vec2d step = jacobian.inverse() * error;
      if (!step.allFinite()) break;
      double length = 1;
      Vec2d next_error = error;
      for (; length > 1e-3; length /= 2) {
        next_error = Distort(distortion, p - length * step, nullptr) - target;
        if (next_error.norm() < error.norm()) break;
      }
      if (!(next_error.norm() < error.norm())) break;
      p -= length * step;
      error = Distort(distortion, p, &jacobian) - target;
    }
  }
  return (cam_from_world.rotation.transpose() * p.homogeneous()).normalized();
}

Eigen::Matrix<double, 2, 3> Camera::ProjectJacobian(const Vec3d& x_in_world) const {
  const Vec3d x = cam_from_world * x_in_world;
  const double inverse_z = 1 / x.z();
  const Vec2d p = x.head<2>() * inverse_z;
  Eigen::Matrix<double, 2, 3> normalised;
  normalised << inverse_z, 0, -p.x() * inverse_z, 0, inverse_z, -p.y() * inverse_z;
  if (HasDistortion()) {
    Mat2d distort;
    Distort(distortion, p, &distort);
    normalised = (distort * normalised).eval();
  }
  normalised.row(0) *= fx;
  normalised.row(1) *= fy;
  return normalised * cam_from_world.rotation;
}

Camera Camera::Scaled(double scale) const {
  Camera scaled = *this;
  scaled.width = std::max(1, static_cast<int>(std::lround(width * scale)));
  scaled.height = std::max(1, static_cast<int>(std::lround(height * scale)));
  // The picture keeps its extent: whole pixels may make the two axes' scales differ a little.
  const double scale_x = static_cast<double>(scaled.width) / width;
  const double scale_y = static_cast<double>(scaled.height) / height;
  scaled.fx *= scale_x;
  scaled.cx *= scale_x;
  scaled.fy *= scale_y;
  scaled.cy *= scale_y;
  return scaled;
}

}  // namespace dyxel
