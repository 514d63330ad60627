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
  kMissing,  // never done, broken off, or an output is gone
  kStale,    // an input or an option has changed since
  kDone,
  kEdited  // nothing to do, and a person has changed an output since: kept
};

// How a unit stands, and which of its outputs a person has changed. Such outputs are kept also
// where the unit is to be done again; where all of them are, it never is.
struct UnitReport {
  UnitState state = UnitState::kMissing;
  std::vector<std::filesystem::path> edited;
  bool reread = false;  // files below a root were read though their own inodes are old
};

// The folder PROJECT/state. A file is taken as unchanged without reading it where its inode has not
// changed since the stamp was written (ctime); else its content decides. Files outside the project
// are so trusted only while their root is the folder that it was (path, device, inode) and no
// folder between has changed either.
class StampBook {
 public:
  // `roots` name places for the stamps: a file below roots["capture"] is stored as
  // "capture/…", so that stamps of equal projects in different places are equal.
  using Roots = std::map<std::string, std::filesystem::path>;
  StampBook(std::filesystem::path project, const Roots& roots);

  [[nodiscard]] UnitReport Examine(const Unit& unit);
  [[nodiscard]] UnitState State(const Unit& unit) { return Examine(unit).state; }

  // Around unit.run: Begin() takes the old stamp away and puts what a person edited aside; Finish()
  // brings that back and writes the stamp. A unit that was begun and not finished is kMissing, and
  // its edited outputs are still safe. Abandon() brings them back where the run threw.
  void Begin(const Unit& unit);
  void Finish(const Unit& unit);
  void Abandon(const Unit& unit);

  // Writes the unit's stamp from the files as they are now.
  void Stamp(const Unit& unit);
  // Of a unit that is done: saves the next run from reading what this one has reread.
  void Confirm(const Unit& unit);

 private:
  struct Record;
  struct Root {
    std::string label;
    std::filesystem::path path;
    std::string identity;    // content of its file in state/
    std::int64_t since = 0;  // when that was written, ns; none while it is to be written
  };

  [[nodiscard]] std::filesystem::path StampPath(const Unit& unit) const;
  [[nodiscard]] std::filesystem::path AsidePath(const Unit& unit, const std::string& name) const;
  [[nodiscard]] std::filesystem::path RootPath(const Root& root) const;
  [[nodiscard]] std::string ShortName(const std::filesystem::path& path) const;
  [[nodiscard]] const Root* RootOf(const std::filesystem::path& path) const;
  [[nodiscard]] bool RootsHold(const std::filesystem::path& path, std::int64_t written);
  [[nodiscard]] std::string HashOf(const std::filesystem::path& path);
  // The content's hash; `stored` where the file is unchanged since `written`.
  [[nodiscard]] std::string HashSince(const std::filesystem::path& path,
                                      const std::string& stored,
                                      std::int64_t written,
                                      bool& reread);
  [[nodiscard]] bool Load(const Unit& unit, Record& record) const;
  void WriteRoots();
  // Brings back what Begin() put aside: the outputs' short names with their hashes.
  std::map<std::string, std::string> Restore(const Unit& unit);
  void Write(const Unit& unit,
             const std::map<std::string, std::string>& outputs,
             const std::map<std::string, std::string>& kept);

  std::filesystem::path project_;
  std::vector<Root> roots_;
  std::map<std::filesystem::path, std::string> known_;          // hashes computed by this process
  std::map<std::filesystem::path, std::int64_t> folder_times_;  // of folders below roots
};

}  // namespace dyxel
