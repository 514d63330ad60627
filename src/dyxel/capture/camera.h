// A calibrated camera (capture-format.md): x right, y down, z forward; pixel centres at integer +
// 0.5.
#pragma once

#include <array>
#include <string>

#include "dyxel/math/rigid.h"

namespace dyxel {

struct Camera {
  std::string name;
  int width = 0;                                       // pixels
  int height = 0;                                      // pixels
  double fx = 0, fy = 0, cx = 0, cy = 0;               // pixels
  std::array<double, 5> distortion = {0, 0, 0, 0, 0};  // Brown-Conrady k1, k2, p1, p2, k3
  Rigid cam_from_world;
  Mat3d color_matrix = Mat3d::Identity();  // reference RGB from camera RGB
  bool holdout = false;                    // never used for estimation

  [[nodiscard]] bool HasDistortion() const;
  // Camera centre in the world.
  [[nodiscard]] Vec3d Center() const { return cam_from_world.Inverse().translation; }
  // Pixel position of a world point (distorted); undefined behind the camera, where z <= 0.
  [[nodiscard]] Vec2d Project(const Vec3d& x_in_world) const;
  // z of a world point along the optical axis.
  [[nodiscard]] double Depth(const Vec3d& x_in_world) const {
    return (cam_from_world * x_in_world).z();
  }
  // Unit direction in the world of the ray through a pixel position (undistorts by iteration).
  [[nodiscard]] Vec3d Ray(const Vec2d& pixel) const;
  // d(pixel)/d(x_in_world), 2x3, with the distortion.
  [[nodiscard]] Eigen::Matrix<double, 2, 3> ProjectJacobian(const Vec3d& x_in_world) const;
  // The camera of a picture scaled by `scale` (--scale): width and height rounded to whole pixels.
  [[nodiscard]] Camera Scaled(double scale) const;
};

}  // namespace dyxel
