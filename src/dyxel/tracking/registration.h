// Registration by appearance: the nodes' shifts of a sequence from flow between predicted and
// recorded pictures, together with the silhouettes; docs/method.md (P1).
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "dyxel/image/image.h"
#include "dyxel/tracking/track.h"

namespace dyxel {

struct RegistrationOptions {
  int rounds = 2;
  double picture_weight = 32;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(
        o.rounds,
        {.name = "rounds",
         .min = 0,
         .max = 20,
         .help = "rounds in which a DSS's surface is moved under its pictures; 0 leaves it to the "
                 "silhouettes"});
    field(o.picture_weight,
          {.name = "picture_weight",
           .unit = "1/m",
           .min = 0,
           .max = 10000,
           .help = "metres of contour that the flow on a square metre of skin counts for, in each "
                   "camera that sees it"});
  }
};

// What a camera would see of a surface: radiance [h][w][4] (premultiplied, with coverage) and depth
// along its axis [h][w][1 or more] of the whole picture.
struct PredictedPicture {
  ImageF radiance;
  ImageF depth;
};

// Of one time step and the silhouettes' cameras, for a surface's positions; a recorded picture may
// be a crop, or empty.
using PredictPictures =
    std::function<std::vector<PredictedPicture>(std::size_t frame, std::span<const Vec3f>)>;
using RecordedPictures =
    std::function<std::vector<Picture>(std::size_t frame, std::span<const Vec3f>)>;

// The motion with the nodes' shifts moved so that what is predicted lies under what was recorded.
// Poses and confidences stay. A stripe says nothing along itself (structure tensor), flow that does
// not come back is dropped, and so is what has no contrast: highlights and plain cloth don't pull.
// Past the papers. Throws Error(kUsage) for an option out of range, Error(kInput) where masks and
// cameras don't fit together, and what the two functions throw.
[[nodiscard]] Motion RegisterMotion(const SilhouetteSet& silhouettes,
                                    const Actor& actor_with_nodes,
                                    Motion motion,
                                    const PredictPictures& predict,
                                    const RecordedPictures& recorded,
                                    const RegistrationOptions& options = {},
                                    const MotionOptions& motion_options = {},
                                    const ProgressFn& progress = {});

}  // namespace dyxel
