#include "dyxel/render/orbit.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"

namespace dyxel {

Orbit FitOrbit(
    std::span<const Vec3f> positions, const Vec3d& up, int width, int height, double elevation) {
  Require(!positions.empty(), Fault::kUsage, "FitOrbit: no positions");
  Vec3f low = positions[0];
  Vec3f high = positions[0];
  for (const Vec3f& x : positions) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  Orbit orbit;
  orbit.center = (0.5F * (low + high)).cast<double>();
  orbit.up = up.normalized();
  orbit.elevation = elevation;
  orbit.width = width;
  orbit.height = height;
  // From a unit direction v to the eye, with r to the right and u up in the picture, x is inside at
  // distances of at least x·v + |x·r| / tan(a) and x·v + |x·u| / tan(b), half the angles of view.
  constexpr int kAzimuths = 64;
  const double smaller = std::min(width, height);
  const double tangent = std::tan(0.5 * orbit.field_of_view) / 1.04;
  orbit.radius = ParallelReduce(
      kAzimuths,
      1,
      1e-3,
      [&](std::size_t k, std::size_t) {
        const Mat3d axes = OrbitCamera(orbit, 2 * kPiD * static_cast<double>(k) / kAzimuths)
                               .cam_from_world.rotation;
        double radius = 0;
        for (const Vec3f& position : positions) {
          const Vec3d x = axes * (position.cast<double>() - orbit.center);
          const double aside = std::max(std::abs(x.x()) / width, std::abs(x.y()) / height);
          radius = std::max(radius, aside * smaller / tangent - x.z());
        }
        return radius;
      },
      [](double& most, double radius) { most = std::max(most, radius); });
  return orbit;
}

Camera OrbitCamera(const Orbit& orbit, double azimuth) {
  const Vec3d up = orbit.up.normalized();
  const Vec3d start = std::abs(up.x()) < 0.9 ? Vec3d::UnitX() : Vec3d::UnitY();
  const Vec3d front = (start - start.dot(up) * up).normalized();
  const Vec3d left = up.cross(front);
  const Vec3d outward =
      std::cos(orbit.elevation) * (std::cos(azimuth) * front + std::sin(azimuth) * left) +
      std::sin(orbit.elevation) * up;

  Camera camera;
  camera.name = "orbit";
  camera.width = orbit.width;
  camera.height = orbit.height;
  camera.fx = 0.5 * std::min(orbit.width, orbit.height) / std::tan(0.5 * orbit.field_of_view);
  camera.fy = camera.fx;
  camera.cx = 0.5 * orbit.width;
  camera.cy = 0.5 * orbit.height;
  const Vec3d forward = -outward;
  const Vec3d right = forward.cross(up).normalized();
  Mat3d& rotation = camera.cam_from_world.rotation;
  rotation.row(0) = right;
  rotation.row(1) = forward.cross(right);
  rotation.row(2) = forward;
  camera.cam_from_world.translation = -(rotation * (orbit.center + orbit.radius * outward));
  return camera;
}

}  // namespace dyxel
