// The actor and its poses from silhouettes; docs/method.md, section T.
#pragma once

#include <span>
#include <vector>

#include "dyxel/base/option.h"
#include "dyxel/base/progress.h"
#include "dyxel/body/actor.h"
#include "dyxel/capture/camera.h"
#include "dyxel/image/image.h"

namespace dyxel {

// Masks of one sequence: masks[frame][camera], an empty image where that camera has no picture. The
// cameras are those used for estimation.
struct SilhouetteSet {
  std::vector<Camera> cameras;
  std::vector<std::vector<ImageU8>> masks;
  Vec3d up = Vec3d::UnitZ();
};

struct ActorOptions {
  int rounds = 3;
  int max_frames = 24;
  int refine = 5;
  double smoothness = 0.03;
  double max_displacement = 0.08;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(o.rounds,
          {.name = "rounds", .min = 1, .max = 20, .help = "rounds of proportions and poses"});
    field(o.max_frames,
          {.name = "max_frames",
           .unit = "frames",
           .min = 1,
           .max = 1000,
           .help = "most frames that the proportions are fitted to, spread over the sequence"});
    field(o.refine,
          {.name = "refine",
           .min = 0,
           .max = 20,
           .help = "rounds in which the skin is moved to the silhouettes; 0 keeps the template's"});
    field(o.smoothness,
          {.name = "smoothness",
           .unit = "m",
           .min = 0.005,
           .max = 0.5,
           .help = "length over which the skin's displacement is smooth"});
    field(o.max_displacement,
          {.name = "max_displacement",
           .unit = "m",
           .min = 0,
           .max = 0.5,
           .help = "how far the skin may move off the proportioned template"});
  }
};

struct MotionOptions {
  int max_iterations = 30;
  int node_rounds = 4;
  double node_stiffness = 0.02;
  double node_inertia = 0.05;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(o.max_iterations,
          {.name = "max_iterations",
           .unit = "steps",
           .min = 1,
           .max = 500,
           .help = "most Gauss-Newton steps of a time step's pose"});
    field(o.node_rounds,
          {.name = "node_rounds",
           .min = 0,
           .max = 20,
           .help = "rounds in which the nodes are shifted to the silhouettes; 0 leaves the skin to "
                   "the bones"});
    field(o.node_stiffness,
          {.name = "node_stiffness",
           .min = 1e-4,
           .max = 100,
           .help = "how smooth the shifts are over the skin, against the silhouettes"});
    field(o.node_inertia,
          {.name = "node_inertia",
           .min = 0,
           .max = 100,
           .help = "how near a shift stays to those of the time steps beside it"});
  }
};

struct ActorFit {
  Actor actor;
  Proportions proportions;
  Motion motion;  // of the sequence that it was fitted to
};

// Proportions of the template and the poses of the sequence (a RES, or any), without a hand-placed
// start: place, facing and height are found from the silhouettes. Throws Error(kStage) where no
// person is found.
[[nodiscard]] ActorFit FitActor(const SilhouetteSet& silhouettes,
                                const Actor& body_template,
                                const ActorOptions& actor_options = {},
                                const MotionOptions& motion_options = {},
                                const ProgressFn& progress = {});

// Poses of a sequence with a known actor. The first frame is found as FitActor finds its start, or
// `known` poses of all frames (FitActor's own, say) are gone on from.
[[nodiscard]] Motion TrackMotion(const SilhouetteSet& silhouettes,
                                 const Actor& actor,
                                 const MotionOptions& options = {},
                                 const ProgressFn& progress = {},
                                 const Motion* known = nullptr);

// The motion with shifts of the actor's nodes (body/nodes.h), so that what the bones leave, cloth
// above all, meets the silhouettes too; docs/method.md (G3). Poses and confidences stay. Where the
// shifts of the whole sequence explain less than a quarter of the mismatch there are none: it is
// then the silhouettes that are wrong, and each in its own way.
[[nodiscard]] Motion FitShifts(const SilhouetteSet& silhouettes,
                               const Actor& actor_with_nodes,
                               Motion motion,
                               const MotionOptions& options = {},
                               const ProgressFn& progress = {});

}  // namespace dyxel
