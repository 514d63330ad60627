// The relightable video as one glTF 2.0 binary (docs/asset-format.md).
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "dyxel/video/relightable_video.h"

namespace dyxel {

struct WriteVideoOptions {
  int normal_bits = 10;  // of each component of a normal key, 8 to 16
  // Shown under asset.extras: options, measured errors, …; nothing that changes from run to run, if
  // the same run is to give the same bytes.
  std::vector<std::pair<std::string, std::string>> provenance;
};

// A skinned, animated, textured person for any viewer, and under the extension
// DYXEL_relightable_video what ReadVideo needs to render exactly this. Surfaces without an actor
// play as keyed morph targets. Same input, same bytes. Throws Error(kUsage) where parts of the
// video don't belong together, Error(kStage) where the file can't be written.
void WriteVideo(const std::filesystem::path& path,
                const RelightableVideo& video,
                const WriteVideoOptions& options = {});

}  // namespace dyxel
