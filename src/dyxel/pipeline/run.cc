#include "dyxel/pipeline/run.h"

#include <algorithm>
#include <chrono>
#include <fstream>

#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/interrupt.h"
#include "dyxel/base/log.h"
#include "dyxel/base/parallel.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

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

// What a stage has cost since its start.
class StageClock {
 public:
  StageClock() { ResetPeakMemory(); }
  void Read(StageTiming& timing) const {
    timing.wall_s = Seconds();
    timing.cpu_s = CpuSeconds() - cpu_;
    timing.peak_rss_mb = PeakMemoryMb();
  }
  [[nodiscard]] double Seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double cpu_ = CpuSeconds();
};

// Writes a stage's times into timings.json, now and then while it runs.
class TimesRecord {
 public:
  TimesRecord(const Project& project, std::string_view stage, std::size_t units)
      : project_(project), stage_(stage), units_(static_cast<int>(units)) {
    const nlohmann::json all = ReadTimings(project);
    if (all.contains(stage_) && all[stage_].is_object()) before_ = all[stage_];
  }

  void Write(const StageTiming& t) const {
    nlohmann::json entry = {{"wall_s", t.wall_s},
                            {"cpu_s", t.cpu_s},
                            {"units", t.units},
                            {"peak_rss_mb", t.peak_rss_mb},
                            {"threads", Jobs()}};
    const bool goes_on = before_.value("units", 0) + t.units <= units_;
    if (goes_on) {
      for (const char* key : {"wall_s", "cpu_s"}) {
        entry[key] = entry[key].get<double>() + before_.value(key, 0.0);
      }
      entry["units"] = t.units + before_.value("units", 0);
      entry["peak_rss_mb"] = std::max(t.peak_rss_mb, before_.value("peak_rss_mb", 0.0));
    }
    nlohmann::json all = ReadTimings(project_);
    all[stage_] = entry;
    WriteFile(TimingsFile(project_), all.dump(1) + "\n");
  }

 private:
  const Project& project_;
  std::string stage_;
  int units_;
  nlohmann::json before_ = nlohmann::json::object();
};

void RunUnit(const Unit& unit, StampBook& book, const ProgressFn& progress) {
  for (const fs::path& input : unit.inputs) {
    Require(fs::exists(input),
            Fault::kInput,
            "{}: is missing, and stage {} needs it. Run without --stage, or `dyxel check` the "
            "capture.",
            input.string(),
            unit.stage);
  }
  const StageClock clock;
  book.Begin(unit);
  try {
    unit.run(progress);
  } catch (...) {
    book.Abandon(unit);
    throw;
  }
  book.Finish(unit);
  spdlog::debug("{} {}: {:.2f} s", unit.stage, unit.id, clock.Seconds());
}

// Runs the units that are not up to date, and calls `done` after each.
void RunUnits(const std::vector<Unit>& units,
              StampBook& book,
              ProgressBar& bar,
              const std::function<void()>& done) {
  for (std::size_t i = 0; i < units.size(); ++i) {
    ThrowIfInterrupted();
    const Unit& unit = units[i];
    const UnitReport report = book.Examine(unit);
    for (const fs::path& file : report.edited) spdlog::info("kept as edited: {}", file.string());
    if (report.state == UnitState::kDone && report.reread) book.Confirm(unit);
    if (report.state == UnitState::kDone || report.state == UnitState::kEdited) continue;
    RunUnit(unit, book, [&](double share) {
      bar.Update((static_cast<double>(i) + share) / static_cast<double>(units.size()));
    });
    done();
    bar.Update(static_cast<double>(i + 1) / static_cast<double>(units.size()));
  }
}

// Runs a stage's units and times them.
StageTiming RunStage(const Job& job,
                     std::string_view stage,
                     const std::vector<Unit>& units,
                     StampBook& book,
                     bool record_times) {
  constexpr double kBetweenRecords = 2;  // seconds
  StageTiming timing;
  timing.stage = stage;
  const StageClock clock;
  const TimesRecord record(job.project(), stage, units.size());
  ProgressBar bar{std::string(stage)};
  double recorded = 0;
  const auto write = [&] {
    clock.Read(timing);
    if (record_times && timing.units > 0) record.Write(timing);
    recorded = clock.Seconds();
  };
  try {
    RunUnits(units, book, bar, [&] {
      ++timing.units;
      if (clock.Seconds() - recorded > kBetweenRecords) write();
    });
  } catch (...) {
    write();
    throw;
  }
  write();
  if (timing.units > 0) {
    bar.Finish();
    job.workspace->Forget();
  }
  return timing;
}

// Units [first, last] of a stage.
std::vector<Unit> Selected(std::vector<Unit> units, std::pair<int, int> range, const Stage& stage) {
  const auto [first, last] = range;
  const int count = static_cast<int>(units.size());
  Require(count > 0,
          Fault::kUsage,
          "--units {}-{}: stage {} has no units in this project.",
          first,
          last,
          stage.name);
  Require(first >= 0 && first <= last && last < count,
          Fault::kUsage,
          "--units {}-{}: stage {} has units 0-{}.",
          first,
          last,
          stage.name,
          count - 1);
  units.erase(units.begin() + last + 1, units.end());
  units.erase(units.begin(), units.begin() + first);
  return units;
}

}  // namespace

std::vector<StageTiming> RunStages(const Job& job, const RunSelection& selection) {
  if (!selection.until.empty()) (void)FindStage(selection.until);
  if (!selection.stage.empty()) (void)FindStage(selection.stage);
  Require(!selection.units || !selection.stage.empty(),
          Fault::kUsage,
          "--units needs --stage: it numbers the units of one stage.");
  StampBook book = Book(job.project());
  std::vector<StageTiming> timings;
  try {
    for (const Stage& stage : Stages()) {
      if (!selection.stage.empty() && stage.name != selection.stage) continue;
      std::vector<Unit> units = stage.units(job);
      if (selection.units) units = Selected(std::move(units), *selection.units, stage);
      const StageTiming timing = RunStage(job, stage.name, units, book, selection.record_times);
      if (timing.units > 0) timings.push_back(timing);
      if (stage.name == selection.until) break;
    }
  } catch (const Error& error) {
    if (error.fault() != Fault::kInterrupted) throw;
    throw Error(Fault::kInterrupted,
                "Stopped; what is done is kept: run the same command to go on.");
  }
  return timings;
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
      const UnitReport report = book.Examine(unit);
      const UnitState state = report.state;
      status.done += state == UnitState::kDone || state == UnitState::kEdited ? 1 : 0;
      status.stale += state == UnitState::kStale ? 1 : 0;
      status.edited += report.edited.empty() ? 0 : 1;
      for (const fs::path& file : report.edited) {
        status.edited_files.push_back(file.lexically_relative(job.project().folder).string());
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
