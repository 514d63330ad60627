// What of a capture's manifest a unit's result depends on, as lines of its stamp: so that another
// scale, a corrected camera or a corrected lamp has done again what it changes, and no more.
#pragma once

#include <string>

#include "dyxel/capture/capture.h"

namespace dyxel {

// How the stored pictures of a sequence become radiance: size, white level, transfer, colours.
[[nodiscard]] std::string PictureFingerprint(const Capture& capture, const Sequence& sequence);

// Where the cameras of the estimation stand and how they project; the world's up.
[[nodiscard]] std::string RigFingerprint(const Capture& capture);

// The light on frames [begin, end) of a sequence.
[[nodiscard]] std::string LightFingerprint(const Capture& capture,
                                           const Sequence& sequence,
                                           int begin,
                                           int end);

}  // namespace dyxel
