#include <filesystem>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "dyxel/app/commands.h"
#include "dyxel/app/ranges.h"
#include "dyxel/base/error.h"
#include "dyxel/base/log.h"
#include "dyxel/pipeline/check_first.h"
#include "dyxel/pipeline/run.h"

namespace dyxel {
namespace {

struct Arguments {
  std::string capture, project, until, stage, units, frames;
  std::optional<std::string> geometry;
  std::optional<int> smooth_normals;
  std::optional<double> scale;
  std::vector<std::string> settings;
  bool json = false;
};

GivenInputs InputsOf(const Arguments& a) {
  GivenInputs inputs;
  inputs.capture = a.capture;
  if (a.geometry) inputs.geometry = *a.geometry == "none" ? std::string() : *a.geometry;
  inputs.smooth_normals = a.smooth_normals;
  inputs.scale = a.scale;
  if (a.frames == "all") inputs.frames.emplace(std::nullopt);
  if (!a.frames.empty() && a.frames != "all") inputs.frames = ParseRange("--frames", a.frames);
  return inputs;
}

// Says what dyxel.toml holds back that this command line does not name.
void TellOldInputs(const Arguments& a, const Project& project) {
  const ProjectInputs& in = project.inputs;
  const std::string file = (project.folder / "dyxel.toml").string();
  if (in.scale != 1 && !a.scale) {
    spdlog::info("{}: scale {} as before; --scale 1 for whole pictures", file, in.scale);
  }
  if (in.frames && a.frames.empty()) {
    spdlog::info("{}: frames {}-{} as before; --frames all for all of them",
                 file,
                 in.frames->first,
                 in.frames->second);
  }
  if (project.HasGivenGeometry() && !a.geometry) {
    spdlog::info("{}: surfaces from {} as before; --geometry none to track a body",
                 file,
                 in.geometry.string());
  }
}

void Run(const Arguments& a) {
  const Project project = OpenProject(a.project, InputsOf(a), a.settings);
  TellOldInputs(a, project);
  RefuseBrokenCapture(project);
  Workspace workspace(project);
  const Job job = ProjectJob(workspace);
  RunSelection selection;
  selection.record_times = true;
  selection.until = a.until;
  selection.stage = a.stage;
  if (!a.units.empty()) selection.units = ParseRange("--units", a.units);
  const std::vector<StageTiming> timings = RunStages(job, selection);
  if (a.json) {
    nlohmann::json json = nlohmann::json::object();
    for (const StageTiming& t : timings) json[t.stage] = {{"wall_s", t.wall_s}, {"units", t.units}};
    fmt::print("{}\n", json.dump(1));
    return;
  }
  if (timings.empty()) spdlog::info("{}: everything is up to date", project.folder.string());
  if (job.reflectance.empty()) {
    spdlog::warn("{}", project.WhyNoReflectance());
  } else if (a.stage.empty() && a.until.empty()) {
    for (const std::string& sequence : job.dynamic) {
      fmt::print("{}\n", job.VideoFile(sequence).string());
    }
  }
}

}  // namespace

void AddRunCommand(CLI::App& program) {
  static Arguments a;
  CLI::App* command = AddCommand(
      program, "run", "Make relightable videos of a capture; goes on where it was stopped");
  command->add_option("CAPTURE", a.capture, "The capture's folder")->required();
  command->add_option("-o,--output", a.project, "The project's folder")->required();
  command->add_option("--until", a.until, "Stop after this stage");
  command->add_option("--stage", a.stage, "Run only this stage");
  command->add_option("--units", a.units, "With --stage: only units A-B of it");
  command->add_option("--set", a.settings, "Set an option: stage.name=value (see `dyxel options`)")
      ->take_all();
  command->add_option("--frames", a.frames, "Only frames A-B of the dynamic sequences, or all");
  command->add_option("--scale", a.scale, "Shrink the pictures, for a quick look")
      ->check(CLI::Range(0.05, 1.0));
  command->add_option("--geometry",
                      a.geometry,
                      "Given surfaces, MESHES/SEQUENCE/0000.ply, instead of body and tracking; "
                      "none: track a body");
  command
      ->add_option(
          "--smooth-normals",
          a.smooth_normals,
          "With --geometry: take the model's normals from the surface after N rounds of smoothing")
      ->check(CLI::Range(0, 1000));
  command->add_flag("--json", a.json, "Report times as JSON");
  command->callback([] { Run(a); });
}

}  // namespace dyxel
