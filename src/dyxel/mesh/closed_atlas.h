// The atlas of a closed single skin: seam, charts, parameterizations I and II; docs/method.md, A.
#pragma once

#include <span>

#include "dyxel/base/option.h"
#include "dyxel/mesh/atlas.h"

namespace dyxel {

struct AtlasOptions {
  int size = 1024;
  int gutter = 3;
  bool divide = true;
  int packing_trials = 4000;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(o.size,
          {.name = "size", .unit = "texels", .min = 64, .max = 16384, .help = "texture's side"});
    field(o.gutter,
          {.name = "gutter",
           .unit = "texels",
           .min = 1,
           .max = 32,
           .help = "empty texels between charts, and at the texture's border"});
    field(o.divide,
          {.name = "divide",
           .help = "charts cut until they pack tightly; false: one chart, cut only where it would "
                   "overlap itself"});
    field(o.packing_trials,
          {.name = "packing_trials",
           .min = 0,
           .max = 1e6,
           .help = "steps of the search for a tight packing"});
  }
};

// Cuts the skin (positions (V), triangles (F) counter-clockwise from outside) open and maps it to
// the plane twice. The skin must be closed, manifold, in one piece and without handles.
// - The seam is a tree of shortest paths over hidden ground between the extremities.
// - I: border free, least symmetric Dirichlet energy. The one chart that the seam leaves is cut
//   further where it overlaps itself, and where that packs tighter: a body in one piece fills 0.37
//   of the texture, in nine 0.7. The image is not mirrored: u to the right and v down as the
//   surface is seen from outside.
// - II: the skin cut along the seam alone, its border on the unit square, same orientation.
//   Copies that only I needs share their uv_ii.
// No triangle is flipped and no two overlap in either, by construction (in double precision). The
// first V cut vertices are the skin's own. Deterministic for any number of threads.
// Throws Error(kInput) for a skin of another kind, Error(kStage) where no such map was found.
[[nodiscard]] Atlas MakeClosedAtlas(std::span<const Vec3f> positions,
                                    std::span<const Triangle> triangles,
                                    const AtlasOptions& options = {});

}  // namespace dyxel
