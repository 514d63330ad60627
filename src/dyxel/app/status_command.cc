#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "dyxel/app/commands.h"
#include "dyxel/pipeline/run.h"

namespace dyxel {
namespace {

struct Arguments {
  std::string project;
  bool json = false;
};

void PrintTable(const std::vector<StageStatus>& all) {
  fmt::print("{:<12} {:>11} {:>7} {:>7} {:>9} {:>10}\n",
             "stage",
             "done",
             "stale",
             "edited",
             "time",
             "size");
  for (const StageStatus& s : all) {
    if (s.units == 0) continue;
    fmt::print("{:<12} {:>5}/{:<5} {:>7} {:>7} {:>7.1f} s {:>7.1f} MB\n",
               s.stage,
               s.done,
               s.units,
               s.stale,
               s.edited,
               s.wall_s,
               static_cast<double>(s.bytes) / 1e6);
  }
  for (const StageStatus& s : all) {
    for (const std::string& file : s.edited_files) fmt::print("edited, and kept: {}\n", file);
  }
}

void PrintJson(const std::vector<StageStatus>& all) {
  nlohmann::json json = nlohmann::json::array();
  for (const StageStatus& s : all) {
    json.push_back({{"stage", s.stage},
                    {"units", s.units},
                    {"done", s.done},
                    {"stale", s.stale},
                    {"edited", s.edited},
                    {"wall_s", s.wall_s},
                    {"bytes", s.bytes},
                    {"edited_files", s.edited_files}});
  }
  fmt::print("{}\n", json.dump(1));
}

}  // namespace

void AddStatusCommand(CLI::App& program) {
  static Arguments a;
  CLI::App* command = AddCommand(
      program, "status", "Show a project's stages: units done, times, sizes, edited files");
  command->add_option("PROJECT", a.project, "The project's folder")->required();
  command->add_flag("--json", a.json, "As JSON");
  command->callback([] {
    const Project project = LoadProject(a.project);
    Workspace workspace(project);
    const std::vector<StageStatus> all = ProjectStatus(ProjectJob(workspace));
    a.json ? PrintJson(all) : PrintTable(all);
  });
}

}  // namespace dyxel
