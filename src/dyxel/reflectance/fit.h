// Reflectance from the dyxels of the reflectance sequences (A §VI-A); docs/method.md, section R.
#pragma once

#include <string>

#include "dyxel/base/option.h"
#include "dyxel/base/progress.h"
#include "dyxel/reflectance/dyxels.h"
#include "dyxel/reflectance/reflectance.h"

namespace dyxel {

struct ReflectanceOptions {
  std::string model = "ggx";
  int materials = 0;
  bool second_pass = true;
  int views = 2;
  int rounds = 1;
  double alpha = 0.2;
  double gamma = 2;
  double robust = 2.5;
  int sample_texels = 16000;
  int seed = 1;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(o.model,
          {.name = "model",
           .choices = {"phong", "ggx"},
           .help = "reflectance model: a name of the BRDF table"});
    field(o.materials,
          {.name = "materials",
           .min = 0,
           .max = 32,
           .help = "clusters of texels that share specular behaviour; 0: chosen by their colours"});
    field(o.second_pass,
          {.name = "second_pass", .help = "estimate normals too, and fit again with them"});
    field(
        o.views,
        {.name = "views",
         .min = 0,
         .max = 64,
         .help = "cameras a time step, the most frontal ones, that normals are fitted to; 0: all"});
    field(o.rounds,
          {.name = "rounds", .min = 1, .max = 10, .help = "rounds of normals and specular fit"});
    field(o.alpha,
          {.name = "alpha",
           .min = 0,
           .max = 1,
           .help = "weight of the samples against the model's normal, which has 1 - alpha"});
    field(o.gamma,
          {.name = "gamma",
           .min = 1,
           .max = 4,
           .help = "exponent of a normal's angle to the model's, in its penalty"});
    field(o.robust,
          {.name = "robust",
           .min = 0,
           .max = 100,
           .help = "errors beyond so many times the noise count less and less; 0: all count"});
    field(o.sample_texels,
          {.name = "sample_texels",
           .min = 100,
           .max = 1000000,
           .help = "texels drawn for the materials' specular fit"});
    field(o.seed, {.name = "seed", .min = 0, .max = 1e9, .help = "of all random draws"});
  }
};

// The diffuse albedo and normal of every texel and the specular parameters of every material:
// a Lambertian fit; materials by its colours; per material the specular parameters by
// Levenberg-Marquardt over a seeded subset of its texels, with the diffuse albedo of each
// eliminated; normals of the subset, minimising (A eq. 2)
//   (1 − β) E(n) + β Δ(n)^γ,
// E the mean robust squared error in units of the noise, and the specular parameters again; then
// normal and diffuse of every texel. Texels that no trusted sample saw lit take the material of the
// nearest sure one and the model's normal; their albedo, and that of unsure texels, is smoothed
// within the material (fill.h).
// Loads every tile twice. The result depends neither on exposure (radiance and irradiance scaled
// alike) nor on the number of threads. Throws Error(kStage) where no texel has a lit sample,
// Error(kUsage) for an unknown model or options out of range.
[[nodiscard]] Reflectance FitReflectance(const DyxelSource& source,
                                         const TexelGraph& graph,
                                         const ReflectanceOptions& options = {},
                                         const ProgressFn& progress = {});

}  // namespace dyxel
