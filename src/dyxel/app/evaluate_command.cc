#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "dyxel/app/commands.h"
#include "dyxel/pipeline/evaluate.h"

namespace dyxel {
namespace {

struct Arguments {
  std::string project, truth, output;
  std::vector<std::string> fits, ablations;
  bool json = false;
};

}  // namespace

void AddEvaluateCommand(CLI::App& program) {
  static Arguments a;
  CLI::App* c = AddCommand(
      program, "evaluate", "Measure a project: figures, side-by-side pictures, a report");
  c->add_option("PROJECT", a.project, "The project's folder")->required();
  c->add_option("--truth", a.truth, "The capture's truth: meshes/, joints/, masks/, passes/");
  c->add_option("--fit", a.fits, "Also fit to this sequence alone; its figures stand under fit.SEQ")
      ->take_all();
  c->add_option("--ablate",
                a.ablations,
                "Also measure without a part of the method: no_second_pass, base_normals, "
                "model_phong; under ablation.NAME")
      ->delimiter(',')
      ->take_all();
  c->add_option("-o,--output", a.output, "Folder of the report; default PROJECT/report");
  c->add_flag("--json", a.json, "Print the figures as JSON");
  c->callback([] {
    const Project project = LoadProject(a.project);
    EvaluateRequest request;
    request.truth = a.truth;
    request.fits = a.fits;
    request.ablations = a.ablations;
    request.output = a.output.empty() ? project.folder / "report" : std::filesystem::path(a.output);
    const Metrics metrics = Evaluate(project, request);
    if (a.json) {
      fmt::print("{}\n", nlohmann::json(metrics.values()).dump(1));
      return;
    }
    for (const auto& [key, value] : metrics.values()) fmt::print("{:<46} {:>12.4g}\n", key, value);
    fmt::print("{}\n", (request.output / "index.html").string());
  });
}

}  // namespace dyxel
