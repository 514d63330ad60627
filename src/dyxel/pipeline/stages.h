// The whole pipeline as one table: every stage with what it reads, what it writes, its unit of
// work, and the function that lists those units.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "dyxel/pipeline/stamps.h"
#include "dyxel/pipeline/workspace.h"

namespace dyxel {

// What is to be made of a project: by `dyxel run`, the reflectance of its RES and a video of every
// DSS; by `dyxel evaluate` also fits to other sequences and poses of validation sequences.
struct Job {
  Workspace* workspace = nullptr;
  std::vector<std::string> reflectance;  // sequences of the fit, together; none: only tracking
  std::string fit;                       // "": the project's own; else its folder is fits/FIT
  std::vector<std::string> dynamic;      // sequences that become videos
  std::vector<std::string> validation;   // sequences that are only tracked

  [[nodiscard]] const Project& project() const { return workspace->project(); }
  // The id of a unit that is made for this fit alone.
  [[nodiscard]] std::string FitId(const std::string& id) const {
    return fit.empty() ? id : "fits/" + fit + "/" + id;
  }
  // Folder of the fit's reflectance maps.
  [[nodiscard]] std::filesystem::path ReflectanceFolder() const;
  [[nodiscard]] std::filesystem::path NormalFile(const std::string& sequence, int frame) const;
  [[nodiscard]] std::filesystem::path VideoFile(const std::string& sequence) const {
    return project().folder / "video" / (sequence + ".glb");
  }
  // Of one frame.
  [[nodiscard]] std::filesystem::path TextureFolder(const Sequence& sequence, int frame) const {
    return project().folder / "textures" / sequence.name / Project::FrameName(sequence, frame);
  }
};

// What `dyxel run` makes.
[[nodiscard]] Job ProjectJob(Workspace& workspace);

// One chunk of a DSS: frames [begin, end), and the frame that its normals belong to.
struct Chunk {
  int begin, end, centre;
};
[[nodiscard]] std::vector<Chunk> Chunks(int num_frames, int chunk);

struct Stage {
  std::string_view name;
  std::string_view reads, writes;  // project folders, for people
  std::string_view unit;
  std::vector<Unit> (*units)(const Job& job);
};

// In the order of the work.
[[nodiscard]] const std::vector<Stage>& Stages();

// Throws Error(kUsage) naming the stages there are.
[[nodiscard]] const Stage& FindStage(const std::string& name);

}  // namespace dyxel
