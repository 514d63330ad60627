// Looking at single pictures of a capture for `CheckCapture`.
#pragma once

#include <optional>
#include <string>

#include "dyxel/capture/capture.h"
#include "dyxel/image/image_io.h"

namespace dyxel::internal {

// What one picture is like, or what is wrong with it.
struct PictureCheck {
  bool read = false;
  std::string what;        // fault; "" for none
  std::string mend;        //
  double exposure = 0;     // 99.5th percentile of its values, radiance before the colour matrix
  double saturated = 0;    // share of pixels with a clipped channel
  double not_finite = 0;   // share of pixels with NaN or infinity
  std::uint64_t hash = 0;  // of its values
};

// `camera` may have no size (0): then any is right. Never throws.
[[nodiscard]] PictureCheck CheckPicture(const std::filesystem::path& path,
                                        const Camera& camera,
                                        const Sequence& sequence);
// The same of a frame that has been read (from a video).
[[nodiscard]] PictureCheck CheckStored(const StoredPicture& picture,
                                       const Camera& camera,
                                       const Sequence& sequence);

// A mask: read, of the camera's size, and neither empty nor full (which is a warning: read is
// true).
[[nodiscard]] PictureCheck CheckMask(const std::filesystem::path& path, const Camera& camera);

}  // namespace dyxel::internal
