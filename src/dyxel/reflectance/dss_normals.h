// Time-varying normals of a dynamic scene sequence (A §VI-B): one normal a texel for a chunk of
// time steps, in the tangent frame of the model's surface; docs/method.md (R4, N1, N2).
#pragma once

#include <vector>

#include "dyxel/base/option.h"
#include "dyxel/base/progress.h"
#include "dyxel/reflectance/dyxels.h"
#include "dyxel/reflectance/reflectance.h"

namespace dyxel {

struct NormalOptions {
  int chunk = 5;
  int views = 0;
  double alpha = 0.2;
  double gamma = 2;
  double robust = 2.5;
  double refit = 4;
  bool toward_reference = false;
  double coupling = 0.5;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(
        o.chunk,
        {.name = "chunk", .unit = "frames", .min = 1, .max = 100, .help = "frames of one normal"});
    field(
        o.views,
        {.name = "views",
         .min = 0,
         .max = 64,
         .help = "cameras a time step, the most frontal ones, that normals are fitted to; 0: all"});
    field(o.alpha,
          {.name = "alpha",
           .min = 0,
           .max = 1,
           .help = "weight of the samples against the starting normal, which has 1 - alpha"});
    field(o.gamma,
          {.name = "gamma",
           .min = 1,
           .max = 4,
           .help = "exponent of a normal's angle to the starting one, in its penalty"});
    field(o.robust,
          {.name = "robust",
           .min = 0,
           .max = 100,
           .help = "errors beyond so many times the noise count less and less; 0: all count"});
    field(
        o.refit,
        {.name = "refit",
         .min = 0,
         .max = 100,
         .help = "a texel whose mean error stays above so many times the noise's is fitted again, "
                 "the samples weighing a quarter; 0: never"});
    field(o.toward_reference,
          {.name = "toward_reference",
           .help = "normals are kept near the reflectance's, not the model's"});
    field(o.coupling,
          {.name = "coupling",
           .min = 0,
           .max = 1e4,
           .help = "pull of neighbouring texels' normals towards each other; 0: texel by texel"});
  }
};

struct ChunkNormals {
  std::vector<Vec3f> normal;      // (K) unit, tangent frame; the starting normal where unseen
  std::vector<float> error;       // (K) mean robust error in units of the noise; NaN where unseen
  std::vector<float> confidence;  // (K) in [0, 1]
};

// The normals of one chunk, whose frames `source` holds (one frame or more): per texel the minimum
// of (1 − β) E(n) + β Δ(n)^γ by Levenberg-Marquardt over two slopes, the reflectance fixed. Δ is
// the angle to the model's normal, or with `toward_reference` to the reflectance's. Then the texels
// are coupled: Σ_x confidence_x E_x(n_x), with its penalty, to second order + coupling Σ |c_x −
// c_y|² over neighbours within a chart, c_x the change of the slopes. Texels that no camera sees
// lit keep that normal. Loads every tile once, and a few twice, to learn the noise. The result
// depends neither on exposure nor on the number of threads. Throws Error(kUsage) where options are
// out of range, Error(kInput) where sizes disagree.
[[nodiscard]] ChunkNormals FitNormals(const DyxelSource& source,
                                      const TexelGraph& graph,
                                      const Reflectance& reflectance,
                                      const NormalOptions& options = {},
                                      const ProgressFn& progress = {});

}  // namespace dyxel
