// What a picture file may claim to hold before it is taken for damaged.
#pragma once

#include <cstdint>

namespace dyxel::internal {

inline constexpr std::int64_t kMaxPixels = std::int64_t{1} << 28;  // 16384 x 16384

}  // namespace dyxel::internal
