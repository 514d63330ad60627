#include "dyxel/capture/light.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dyxel {
namespace {

// world_from_map: the map's z axis is `up`; its x axis is the world's, tilted with it by the
// shortest turn, and for up = −z kept.
Mat3d WorldFromMap(const Vec3d& up) {
  const Vec3d z = up.normalized();
  if (z.z() < -1 + 1e-12) return Vec3d(1, -1, -1).asDiagonal();
  return Quatd::FromTwoVectors(Vec3d::UnitZ(), z).toRotationMatrix();
}

}  // namespace

Illumination Illuminate(const Light& light, const Vec3f& x_in_world) {
  if (light.type == LightType::kDirectional) {
    return {-light.direction.cast<float>(),
            std::numeric_limits<float>::infinity(),
            light.irradiance,
            1.0F};
  }
  const Vec3f offset = light.position.cast<float>() - x_in_world;
  const float distance = offset.norm();
  const Vec3f to_light = offset / distance;
  float cone = 1;
  if (light.type == LightType::kSpot) {
    const float cosine = -to_light.dot(light.direction.cast<float>());
    const auto inner = static_cast<float>(std::cos(light.cone_inner));
    const auto outer = static_cast<float>(std::cos(light.cone_outer));
    if (cosine >= inner) {
      cone = 1;
    } else if (cosine <= outer) {
      cone = 0;
    } else {
      const float t = (cosine - outer) / (inner - outer);
      cone = t * t * (3 - 2 * t);
    }
  }
  return {to_light, distance, light.intensity * (cone / (distance * distance)), cone};
}

Rgb Environment::Radiance(const Vec3f& direction) const {
  const Vec3d d = Eigen::AngleAxisd(-rotation, Vec3d::UnitZ()) *
                  (WorldFromMap(up).transpose() * direction.cast<double>());
  const double u = 0.5 - std::atan2(d.y(), d.x()) / (2 * kPiD);
  const double v = 0.5 - std::asin(std::clamp(d.z(), -1.0, 1.0)) / kPiD;
  // Bilinear between pixel centres; u wraps around, v ends at the poles.
  const double x = u * radiance.width - 0.5;
  const double y = std::clamp(v * radiance.height - 0.5, 0.0, radiance.height - 1.0);
  const double left = std::floor(x);
  const auto ax = static_cast<float>(x - left);
  const int x0 = (static_cast<int>(left) + radiance.width) % radiance.width;
  const int x1 = (x0 + 1) % radiance.width;
  const int y0 = static_cast<int>(y);
  const int y1 = std::min(y0 + 1, radiance.height - 1);
  const auto ay = static_cast<float>(y - y0);
  const auto at = [&](int column, int row) {
    return Eigen::Map<const Rgb>(&radiance.At(column, row));
  };
  return (1 - ay) * ((1 - ax) * at(x0, y0) + ax * at(x1, y0)) +
         ay * ((1 - ax) * at(x0, y1) + ax * at(x1, y1));
}

Vec3f Environment::Direction(double u, double v) const {
  const double azimuth = (0.5 - u) * 2 * kPiD + rotation;
  const double elevation = (0.5 - v) * kPiD;
  const Vec3d d(std::cos(elevation) * std::cos(azimuth),
                std::cos(elevation) * std::sin(azimuth),
                std::sin(elevation));
  return (WorldFromMap(up) * d).cast<float>();
}

}  // namespace dyxel
