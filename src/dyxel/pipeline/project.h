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

// Where a project's surfaces come from and how much of the capture is used. Stands in dyxel.toml.
struct ProjectInputs {
  std::filesystem::path capture;   // folder
  std::filesystem::path geometry;  // --geometry: folder of MESHES/SEQ/0000.ply; empty: track a body
  int smooth_normals = 0;          // --smooth-normals: rounds
  double scale = 1;                // --scale
  std::optional<std::pair<int, int>> frames;  // --frames A-B of the dynamic sequences, file numbers
};

struct Project {
  std::filesystem::path folder;  // absolute
  ProjectInputs inputs;
  PipelineOptions options;
  Capture capture;  // scaled, dynamic sequences cut to `frames`

  [[nodiscard]] bool HasGivenGeometry() const { return !inputs.geometry.empty(); }
  // The sequences that the reflectance is fitted to: option reflectance.sequence, or the first of
  // kind `reflectance`. Throws Error(kInput) where the capture has none.
  [[nodiscard]] std::vector<std::string> ReflectanceSequences() const;
  [[nodiscard]] std::vector<std::string> DynamicSequences() const;
  // Four digits of the file number of a frame.
  [[nodiscard]] static std::string FrameName(const Sequence& sequence, int frame);
};

// Opens or makes the project FOLDER: options are the defaults, then dyxel.toml's, then `settings`
// ("stage.name=value"). `given` overrides what dyxel.toml says about inputs where it is set. Writes
// dyxel.toml. Throws Error(kUsage | kInput).
[[nodiscard]] Project OpenProject(const std::filesystem::path& folder,
                                  const ProjectInputs& given,
                                  const std::vector<std::string>& settings);

// Opens a project that is there, for reading. Throws Error(kInput) where it isn't one.
[[nodiscard]] Project LoadProject(const std::filesystem::path& folder,
                                  const std::vector<std::string>& settings = {});

}  // namespace dyxel
