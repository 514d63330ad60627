// The room around the person: a floor and four walls, known in closed form.
#pragma once

#include "dyxel/math/types.h"

namespace dyxel::studio {

struct Room {
  float half_size = 4.6F;  // walls at ±half_size
  float height = 4.8F;     // the walls' top; above is darkness
  Rgb floor = Rgb(0.075F, 0.082F, 0.095F);
  Rgb wall = Rgb(0.120F, 0.140F, 0.170F);
};

struct RoomPoint {
  float distance = 0;  // along the ray; 0 for none
  Vec3f position = Vec3f::Zero();
  Vec3f normal = Vec3f::Zero();
};

// The first wall or floor that a ray from inside meets, and its albedo there.
[[nodiscard]] RoomPoint MeetRoom(const Room& room, const Vec3f& origin, const Vec3f& direction);
[[nodiscard]] Rgb RoomAlbedo(const Room& room, const RoomPoint& point);

}  // namespace dyxel::studio
