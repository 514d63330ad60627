// The options of all stages in one place.
#pragma once

#include <string>
#include <vector>

#include "dyxel/base/option.h"
#include "dyxel/mesh/closed_atlas.h"
#include "dyxel/reflectance/dss_normals.h"
#include "dyxel/reflectance/fit.h"
#include "dyxel/render/renderer.h"
#include "dyxel/texture/mvv_textures.h"
#include "dyxel/tracking/registration.h"
#include "dyxel/tracking/silhouettes.h"
#include "dyxel/tracking/track.h"

namespace dyxel {

// Which sequences the reflectance is fitted to.
struct SequenceOptions {
  std::vector<std::string> sequence;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(
        o.sequence,
        {.name = "sequence",
         .help =
             "sequences that the reflectance is fitted to; empty: the first of kind reflectance"});
  }
};

struct PipelineOptions {
  SilhouetteOptions silhouettes;
  ActorOptions actor;
  MotionOptions motion;
  AtlasOptions atlas;
  TextureOptions textures;
  SequenceOptions reflectance_sequence;
  ReflectanceOptions reflectance;
  RegistrationOptions registration;
  NormalOptions normals;
  RenderOptions render;

  // All of them by key. The table points into *this.
  [[nodiscard]] OptionTable Table();
};

// Reads [stage] tables of dyxel.toml into `options`; `file` is for messages. Throws Error(kInput)
// for text that isn't TOML, Error(kUsage) for a key or value that an option refuses.
void ReadTomlOptions(const std::string& text, const std::string& file, PipelineOptions& options);

// "[stage]\n# help (unit, default)\nname = value" for all options.
[[nodiscard]] std::string WriteTomlOptions(const PipelineOptions& options);

// The table that `dyxel options` prints; the same as the page docs/options.md, and as JSON.
[[nodiscard]] std::string FormatOptionTable();
[[nodiscard]] std::string OptionTableMarkdown();
[[nodiscard]] std::string OptionTableJson();

}  // namespace dyxel
