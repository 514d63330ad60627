// Stamps: what each unit of work read and wrote, as content hashes, so that a unit whose inputs,
// options and outputs are as they were is not done again, and an output that a person edited is
// seen and kept (architecture.md, "Project folder").
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "dyxel/base/progress.h"

namespace dyxel {

// One piece of work of a stage: the files that it reads and writes, and the function that does it.
struct Unit {
  std::string stage;
  std::string id;       // "res/0003"; unique within the stage
  std::string options;  // what `run` depends on besides files: "name=value" lines
  std::vector<std::filesystem::path> inputs;   // files; all must be there when it runs
  std::vector<std::filesystem::path> outputs;  // files inside the project
  std::function<void(const ProgressFn&)> run;
};

enum class UnitState {
  kMissing,  // never done, or an output is gone
  kStale,    // an input or an option has changed since
  kDone,
  kEdited  // done, and a person has changed an output since: kept
};

// The folder PROJECT/state. A file is taken as unchanged without reading it where its inode has not
// changed since the stamp was written (ctime); else its content decides.
class StampBook {
 public:
  // `roots` name places for the stamps: a file below roots["capture"] is stored as
  // "capture/…", so that stamps of equal projects in different places are equal.
  StampBook(std::filesystem::path project, std::map<std::string, std::filesystem::path> roots);

  [[nodiscard]] UnitState State(const Unit& unit);
  // Outputs of `unit` that a person has changed.
  [[nodiscard]] std::vector<std::filesystem::path> EditedOutputs(const Unit& unit);
  // Writes the unit's stamp from the files as they are now.
  void Stamp(const Unit& unit);

 private:
  struct Record;
  [[nodiscard]] std::filesystem::path StampPath(const Unit& unit) const;
  [[nodiscard]] std::string ShortName(const std::filesystem::path& path) const;
  [[nodiscard]] std::string HashOf(const std::filesystem::path& path);
  [[nodiscard]] bool Load(const Unit& unit, Record& record) const;

  std::filesystem::path project_;
  std::map<std::string, std::filesystem::path> roots_;
  std::map<std::filesystem::path, std::string> known_;  // hashes computed by this process
};

}  // namespace dyxel
