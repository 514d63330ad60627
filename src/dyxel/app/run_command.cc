#include <charconv>

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
  std::string capture, project, until, stage, units, frames, geometry;
  int smooth_normals = 0;
  double scale = 1;
  std::vector<std::string> settings;
  bool json = false;
};

void Run(const Arguments& a) {
  Require(a.smooth_normals == 0 || !a.geometry.empty(),
          Fault::kUsage,
          "--smooth-normals needs --geometry: it smooths the normals of given surfaces.");
  ProjectInputs inputs;
  inputs.capture = a.capture;
  inputs.geometry = a.geometry;
  inputs.smooth_normals = a.smooth_normals;
  inputs.scale = a.scale;
  if (!a.frames.empty()) inputs.frames = ParseRange("--frames", a.frames);
  const Project project = OpenProject(a.project, inputs, a.settings);
  RefuseBrokenCapture(project);
  Workspace workspace(project);
  const Job job = ProjectJob(workspace);
  RunSelection selection;
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
  if (a.stage.empty() && a.until.empty()) {
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
  command->add_option("--frames", a.frames, "Only frames A-B of the dynamic sequences");
  command->add_option("--scale", a.scale, "Shrink the pictures, for a quick look")
      ->check(CLI::Range(0.05, 1.0));
  command->add_option("--geometry",
                      a.geometry,
                      "Given surfaces, MESHES/SEQUENCE/0000.ply, instead of body and tracking");
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
