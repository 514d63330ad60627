// Foreground masks from background plates; docs/method.md (S1)-(S5).
#pragma once

#include <cstdint>
#include <span>

#include "dyxel/base/option.h"
#include "dyxel/image/image.h"

namespace dyxel {

struct SilhouetteOptions {
  double noise_threshold = 6;
  double shadow_tolerance = 1;
  int smooth_radius = 1;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(o.noise_threshold,
          {.name = "noise_threshold",
           .unit = "sigma",
           .min = 1,
           .max = 100,
           .help = "distance from the plate, in its noise, above which a pixel is the person"});
    field(o.shadow_tolerance,
          {.name = "shadow_tolerance",
           .min = 0,
           .max = 1,
           .help =
               "how much darker the plate may get with its colour unchanged and still be shadow"});
    field(o.smooth_radius,
          {.name = "smooth_radius",
           .unit = "px",
           .min = 0,
           .max = 10,
           .help = "radius of the median that smooths the boundary; 0 leaves it"});
  }
};

// Values of a silhouette. From 128 on a pixel is the person. kMaskUnknown is outside for all who
// don't ask: neither the person nor the plate is bright enough there to tell them apart; a person
// whom no lamp reaches would look the same. The tracker asks.
inline constexpr std::uint8_t kMaskPerson = 255;
inline constexpr std::uint8_t kMaskUnknown = 64;

// The mask (kMaskPerson, kMaskUnknown or 0) of one picture [h][w][3] against its plates (each
// [h][w][3], at least one): the component with the most lit pixels, holes filled.
[[nodiscard]] ImageU8 ExtractSilhouette(const ImageF& picture,
                                        std::span<const ImageF> plates,
                                        const SilhouetteOptions& options = {});

}  // namespace dyxel
