// Runs stages: what is up to date is skipped, what a person edited is kept, times are written.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dyxel/pipeline/stages.h"

namespace dyxel {

struct RunSelection {
  std::string until;                         // last stage; "": all
  std::string stage;                         // only this stage; "": all
  std::optional<std::pair<int, int>> units;  // with `stage`: only units [first, second]
  bool record_times = false;                 // in PROJECT/report/timings.json
};

struct StageTiming {
  std::string stage;
  double wall_s = 0, cpu_s = 0;
  int units = 0;  // done in this run
  double peak_rss_mb = 0;
};

// Brings `job` up to date; gives the stages that had something to do. Each finished unit is stamped
// at once, so that a killed run goes on where it was. At an interrupt it throws
// Error(kInterrupted).
//
// Recorded times are those of the last time that a stage was done: a run that goes on with a stage
// adds to its times, one that does it again replaces them, one that has nothing to do leaves them.
// They are written also where a unit throws.
std::vector<StageTiming> RunStages(const Job& job, const RunSelection& selection = {});

struct StageStatus {
  std::string stage;
  int units = 0, done = 0, stale = 0, edited = 0;
  std::uintmax_t bytes = 0;  // of the outputs
  double wall_s = 0;         // of the last run that did something
  std::vector<std::string> edited_files;
};
[[nodiscard]] std::vector<StageStatus> ProjectStatus(const Job& job);

}  // namespace dyxel
