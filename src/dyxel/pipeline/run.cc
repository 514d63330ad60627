#include "dyxel/pipeline/run.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>

#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/log.h"
#include "dyxel/base/parallel.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

std::atomic<bool> interrupted{false};

double CpuSeconds() {
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

// The kernel keeps a high-water mark a process; writing 5 to clear_refs sets it back.
void ResetPeakMemory() { std::ofstream("/proc/self/clear_refs") << "5"; }
double PeakMemoryMb() {
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word) {
    if (word == "VmHWM:") {
      double kib = 0;
      status >> kib;
      return kib / 1024;
    }
  }
  return 0;
}

StampBook Book(const Project& project) {
  return {project.folder,
          {{"capture", project.capture.folder}, {"geometry", project.inputs.geometry}}};
}

fs::path TimingsFile(const Project& project) { return project.folder / "report" / "timings.json"; }

nlohmann::json ReadTimings(const Project& project) {
  if (!fs::exists(TimingsFile(project))) return nlohmann::json::object();
  auto json = nlohmann::json::parse(ReadFile(TimingsFile(project)), nullptr, false);
  return json.is_object() ? json : nlohmann::json::object();
}

// Runs the units that are not up to date. Returns how many it ran.
int RunUnits(const std::vector<Unit>& units, StampBook& book, ProgressBar& bar) {
  int ran = 0;
  for (std::size_t i = 0; i < units.size(); ++i) {
    const Unit& unit = units[i];
    if (interrupted) {
      throw Error(Fault::kInterrupted,
                  "stopped; what is done is kept: run the same command to go on");
    }
    const UnitState state = book.State(unit);
    if (state == UnitState::kEdited) {
      for (const fs::path& file : book.EditedOutputs(unit)) {
        spdlog::info("kept as edited: {}", file.string());
      }
      continue;
    }
    if (state == UnitState::kDone) continue;
    for (const fs::path& input : unit.inputs) {
      Require(fs::exists(input),
              Fault::kInput,
              "{}: is missing, and stage {} needs it. Run without --stage, or `dyxel check` the "
              "capture.",
              input.string(),
              unit.stage);
    }
    unit.run([&](double share) {
      bar.Update((static_cast<double>(i) + share) / static_cast<double>(units.size()));
    });
    book.Stamp(unit);
    ++ran;
    bar.Update(static_cast<double>(i + 1) / static_cast<double>(units.size()));
  }
  return ran;
}

}  // namespace

void HandleInterrupts() {
  const auto handler = [](int signal) {
    if (interrupted.exchange(true)) std::_Exit(128 + signal);  // the second time at once
  };
  std::signal(SIGINT, handler);
  std::signal(SIGTERM, handler);
}

std::vector<StageTiming> RunStages(const Job& job, const RunSelection& selection) {
  if (!selection.until.empty()) (void)FindStage(selection.until);
  if (!selection.stage.empty()) (void)FindStage(selection.stage);
  Require(!selection.units || !selection.stage.empty(),
          Fault::kUsage,
          "--units needs --stage: it numbers the units of one stage.");
  StampBook book = Book(job.project());
  std::vector<StageTiming> timings;
  for (const Stage& stage : Stages()) {
    if (!selection.stage.empty() && stage.name != selection.stage) continue;
    std::vector<Unit> units = stage.units(job);
    if (selection.units) {
      const auto [first, last] = *selection.units;
      Require(first >= 0 && first <= last && last < static_cast<int>(units.size()),
              Fault::kUsage,
              "--units {}-{}: stage {} has units 0-{}.",
              first,
              last,
              stage.name,
              static_cast<int>(units.size()) - 1);
      units = std::vector<Unit>(units.begin() + first, units.begin() + last + 1);
    }
    StageTiming timing;
    timing.stage = stage.name;
    ResetPeakMemory();
    const auto start = std::chrono::steady_clock::now();
    const double cpu = CpuSeconds();
    ProgressBar bar(std::string(stage.name));
    timing.units = RunUnits(units, book, bar);
    timing.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    timing.cpu_s = CpuSeconds() - cpu;
    timing.peak_rss_mb = PeakMemoryMb();
    if (timing.units > 0) {
      bar.Finish();
      job.workspace->Forget();
      timings.push_back(timing);
      WriteTimings(job.project(), {timing});
    }
    if (stage.name == selection.until) break;
  }
  return timings;
}

void WriteTimings(const Project& project, const std::vector<StageTiming>& timings) {
  nlohmann::json json = ReadTimings(project);
  for (const StageTiming& t : timings) {
    json[t.stage] = {{"wall_s", t.wall_s},
                     {"cpu_s", t.cpu_s},
                     {"units", t.units},
                     {"peak_rss_mb", t.peak_rss_mb},
                     {"threads", Jobs()}};
  }
  WriteFile(TimingsFile(project), json.dump(1) + "\n");
}

std::vector<StageStatus> ProjectStatus(const Job& job) {
  StampBook book = Book(job.project());
  const nlohmann::json timings = ReadTimings(job.project());
  std::vector<StageStatus> all;
  for (const Stage& stage : Stages()) {
    StageStatus status;
    status.stage = stage.name;
    for (const Unit& unit : stage.units(job)) {
      ++status.units;
      const UnitState state = book.State(unit);
      status.done += state == UnitState::kDone || state == UnitState::kEdited ? 1 : 0;
      status.stale += state == UnitState::kStale ? 1 : 0;
      if (state == UnitState::kEdited) {
        ++status.edited;
        for (const fs::path& file : book.EditedOutputs(unit)) {
          status.edited_files.push_back(file.lexically_relative(job.project().folder).string());
        }
      }
      for (const fs::path& file : unit.outputs) {
        std::error_code missing;
        const auto size = fs::file_size(file, missing);
        if (!missing) status.bytes += size;
      }
    }
    if (timings.contains(stage.name))
      status.wall_s = timings[std::string(stage.name)].value("wall_s", 0.0);
    all.push_back(std::move(status));
  }
  return all;
}

}  // namespace dyxel
