// A project: the folder, the capture that it is made from, the options in force.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dyxel/capture/capture.h"
#include "dyxel/pipeline/options.h"

namespace dyxel {

// Where a project's surfaces come from and how much of the capture is used: [capture] in
// dyxel.toml.
struct ProjectInputs {
  std::filesystem::path capture;   // folder
  std::filesystem::path geometry;  // --geometry: folder of MESHES/SEQ/0000.ply; empty: track a body
  int smooth_normals = 0;          // --smooth-normals: rounds
  double scale = 1;                // --scale
  std::optional<std::pair<int, int>> frames;  // --frames A-B of the dynamic sequences, file numbers
};

// What the command line says of them, where it does.
struct GivenInputs {
  std::optional<std::filesystem::path> capture;
  std::optional<std::filesystem::path> geometry;  // "": track a body
  std::optional<int> smooth_normals;
  std::optional<double> scale;
  std::optional<std::optional<std::pair<int, int>>> frames;  // holding none: all frames
};

struct Project {
  std::filesystem::path folder;  // absolute
  ProjectInputs inputs;
  PipelineOptions options;
  Capture capture;  // scaled, dynamic sequences cut to `frames`

  [[nodiscard]] bool HasGivenGeometry() const { return !inputs.geometry.empty(); }
  // The sequences that the reflectance is fitted to: option reflectance.sequence, or the first of
  // kind `reflectance`. None where there is none or no lamps fall on it: then the capture can be
  // tracked, and no more.
  [[nodiscard]] std::vector<std::string> ReflectanceSequences() const;
  // Why there are none, and the mend; "" where there are.
  [[nodiscard]] std::string WhyNoReflectance() const;
  // The sequence that the actor is fitted to, and whose first frame shows the given surfaces'
  // topology: the RES, or without one the first dynamic sequence.
  [[nodiscard]] const Sequence& ActorSequence() const;
  [[nodiscard]] std::vector<std::string> DynamicSequences() const;
  // Four digits of the file number of a frame.
  [[nodiscard]] static std::string FrameName(const Sequence& sequence, int frame);
};

// Opens or makes the project FOLDER: options are the defaults, then dyxel.toml's, then `settings`
// ("stage.name=value"). `given` overrides what dyxel.toml says about inputs, and only what it
// names. Writes dyxel.toml. Throws Error(kUsage | kInput).
[[nodiscard]] Project OpenProject(const std::filesystem::path& folder,
                                  const GivenInputs& given,
                                  const std::vector<std::string>& settings);

// Opens a project that is there, for reading. Throws Error(kInput) where it isn't one.
[[nodiscard]] Project LoadProject(const std::filesystem::path& folder,
                                  const std::vector<std::string>& settings = {});

}  // namespace dyxel
