// Reading a relightable video back (docs/asset-format.md).
#pragma once

#include <filesystem>

#include "dyxel/video/relightable_video.h"

namespace dyxel {

// What WriteVideo wrote: geometry, poses and topology exactly, maps to the precision of their
// coding. Throws Error(kInput) with the file where it is missing, damaged, hostile, or holds no
// relightable video of a version known here.
[[nodiscard]] RelightableVideo ReadVideo(const std::filesystem::path& path);

}  // namespace dyxel
