#include "dyxel/pipeline/check_first.h"

#include "dyxel/base/error.h"
#include "dyxel/base/log.h"
#include "dyxel/base/progress.h"
#include "dyxel/capture/check.h"
#include "dyxel/pipeline/stamps.h"

namespace dyxel {
namespace {

constexpr int kShownErrors = 5;

}  // namespace

void RefuseBrokenCapture(const Project& project) {
  const Capture& capture = project.capture;
  Unit unit;
  unit.stage = "check";
  unit.id = "capture";
  unit.inputs = {capture.folder / "capture.json"};
  for (const Sequence& sequence : capture.sequences) {
    for (int camera = 0; camera < static_cast<int>(capture.cameras.size()); ++camera) {
      for (int frame = 0; frame < sequence.count; ++frame) {
        for (std::filesystem::path& file : FrameFiles(capture, sequence, camera, frame)) {
          unit.inputs.push_back(std::move(file));
        }
      }
    }
  }
  std::sort(unit.inputs.begin(), unit.inputs.end());
  unit.inputs.erase(std::unique(unit.inputs.begin(), unit.inputs.end()), unit.inputs.end());
  StampBook book(project.folder, {{"capture", capture.folder}});
  if (const UnitReport found = book.Examine(unit); found.state == UnitState::kDone) {
    if (found.reread) book.Confirm(unit);
    return;
  }

  ProgressBar bar("check");
  const CheckReport report = CheckCapture(capture.folder, bar.Callback());
  bar.Finish();
  const int errors = report.Count(Severity::kError);
  for (const CheckItem& item : report.items) {
    if (item.severity == Severity::kWarning)
      spdlog::warn("{}: {}. {}.", item.file, item.what, item.mend);
  }
  if (errors > 0) {
    std::string message;
    int shown = 0;
    for (const CheckItem& item : report.items) {
      if (item.severity != Severity::kError || shown == kShownErrors) continue;
      message +=
          fmt::format("{}{}: {}. {}.", shown > 0 ? "\n" : "", item.file, item.what, item.mend);
      ++shown;
    }
    if (errors > shown)
      message += fmt::format("\n{} more; `dyxel check` lists all.", errors - shown);
    throw Error(Fault::kInput, message);
  }
  book.Stamp(unit);
}

}  // namespace dyxel
