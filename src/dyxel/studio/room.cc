#include "dyxel/studio/room.h"

#include <cmath>
#include <limits>

#include "dyxel/studio/noise.h"

namespace dyxel::studio {

RoomPoint MeetRoom(const Room& room, const Vec3f& origin, const Vec3f& direction) {
  RoomPoint hit;
  float nearest = std::numeric_limits<float>::infinity();
  if (direction.z() < 0) {
    nearest = -origin.z() / direction.z();
    hit.normal = Vec3f::UnitZ();
  }
  for (int axis = 0; axis < 2; ++axis) {
    if (direction[axis] == 0) continue;
    const float wall = std::copysign(room.half_size, direction[axis]);
    const float t = (wall - origin[axis]) / direction[axis];
    if (t > 0 && t < nearest) {
      nearest = t;
      hit.normal = Vec3f::Zero();
      hit.normal[axis] = -std::copysign(1.0F, direction[axis]);
    }
  }
  if (!std::isfinite(nearest)) return {};
  hit.position = origin + nearest * direction;
  if (hit.position.z() > room.height) return {};
  hit.distance = nearest;
  return hit;
}

Rgb RoomAlbedo(const Room& room, const RoomPoint& point) {
  const Vec3f& p = point.position;
  if (point.normal.z() > 0) {
    // Rubber tiles with seams.
    const float mottled = 1 + 0.18F * Noise(p * 3) + 0.12F * Noise(p * 40);
    const Eigen::Array2f tile = p.head<2>().array() - p.head<2>().array().round();
    const float seam = SmoothStep(0.014F, 0.008F, tile.abs().minCoeff());
    return room.floor * mottled * (1 - 0.35F * seam);
  } else {
    // Upright panels.
    const float along = point.normal.x() != 0 ? p.y() : p.x();
    const float panel = std::floor(along / 0.92F);
    const float tone =
        1 + 0.10F * (HashUnit(static_cast<int>(panel), point.normal.x() != 0 ? 1 : 2, 0) - 0.5F);
    const float seam =
        SmoothStep(0.016F, 0.009F, std::abs(along - 0.92F * std::round(along / 0.92F)));
    return room.wall * tone * (1 + 0.06F * Noise(p * 6)) * (1 - 0.4F * seam);
  }
}

}  // namespace dyxel::studio
