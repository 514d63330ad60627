#include <fmt/format.h>

#include "dyxel/app/commands.h"
#include "dyxel/base/error.h"
#include "dyxel/base/progress.h"
#include "dyxel/capture/check.h"

namespace dyxel {

void AddCheckCommand(CLI::App& program) {
  static std::string capture;
  static bool json = false;
  CLI::App* c = AddCommand(program, "check", "Read all of a capture and say what is wrong with it");
  c->add_option("CAPTURE", capture, "The capture's folder")->required();
  c->add_flag("--json", json, "As JSON");
  c->callback([] {
    ProgressBar bar("check");
    const CheckReport report = CheckCapture(capture, bar.Callback());
    bar.Finish();
    fmt::print("{}\n", json ? CheckReportJson(report) : FormatCheckReport(report));
    const int errors = report.Count(Severity::kError);
    Require(
        errors == 0, Fault::kInput, "{}: {} errors; `dyxel run` will refuse it.", capture, errors);
  });
}

}  // namespace dyxel
