// Radiance .hdr files (RGBE): environments as they are found on the web.
#pragma once

#include <filesystem>

#include "dyxel/image/image.h"

namespace dyxel {

// [h][w][3], top row first; flat, old and new run-length packing, any of the eight orientations
// without transposition ("-Y h +X w" is the usual). Throws Error(kInput) with the file.
[[nodiscard]] ImageF ReadRgbe(const std::filesystem::path& path);

}  // namespace dyxel
