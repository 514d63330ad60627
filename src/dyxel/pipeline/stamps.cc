#include "dyxel/pipeline/stamps.h"

#include <algorithm>
#include <limits>

#include <nlohmann/json.hpp>
#include <sys/stat.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/hash.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

// Raised when a stage's code changes what it computes from the same inputs.
constexpr int kStampVersion = 1;

// Time of the inode's last change in nanoseconds, or -1 where there is no file.
std::int64_t ChangeTime(const fs::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return -1;
  return static_cast<std::int64_t>(info.st_ctim.tv_sec) * 1'000'000'000 + info.st_ctim.tv_nsec;
}

// "res/0003" as a file's name, no two ids alike.
std::string FileSafe(const std::string& id) {
  std::string name;
  for (const char c : id) {
    switch (c) {
      case '/':
        name += '.';
        break;
      case '.':
        name += "%2E";
        break;
      case '%':
        name += "%25";
        break;
      default:
        name += c;
    }
  }
  return name;
}

// What tells a root folder from another that stands, or stood, in its place.
std::string Identity(const fs::path& path) {
  struct stat info {};
  std::error_code error;
  const fs::path real = fs::canonical(path, error);
  if (error || ::stat(real.c_str(), &info) != 0) return "";
  const nlohmann::json json = {
      {"path", real.string()}, {"device", info.st_dev}, {"inode", info.st_ino}};
  return json.dump(1) + "\n";
}

constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

}  // namespace

struct StampBook::Record {
  std::int64_t written = 0;  // ctime of the stamp itself
  bool begun = false;        // and not finished: `kept` alone counts
  bool outdated = false;     // by another version of the code
  std::string options;
  std::map<std::string, std::string> inputs, outputs;  // short name → hash, outputs as computed
  std::map<std::string, std::string> kept;             // edited outputs that a later run put back
};

StampBook::StampBook(fs::path project, const Roots& roots) : project_(std::move(project)) {
  for (const auto& [label, path] : roots) {
    if (path.empty()) continue;
    Root root{label, path, Identity(path), kNever};
    const fs::path file = RootPath(root);
    if (fs::exists(file) && ReadFile(file) == root.identity) root.since = ChangeTime(file);
    roots_.push_back(std::move(root));
  }
}

fs::path StampBook::StampPath(const Unit& unit) const {
  return project_ / "state" / unit.stage / (FileSafe(unit.id) + ".json");
}

fs::path StampBook::AsidePath(const Unit& unit, const std::string& name) const {
  return project_ / "state" / unit.stage / (FileSafe(unit.id) + ".edited") / FileSafe(name);
}

fs::path StampBook::RootPath(const Root& root) const {
  return project_ / "state" / (root.label + ".json");
}

namespace {

// `path` below `root`, or "".
std::string Below(const fs::path& root, const fs::path& path) {
  const fs::path relative = path.lexically_relative(root);
  return relative.empty() || *relative.begin() == ".." ? std::string() : relative.generic_string();
}

}  // namespace

const StampBook::Root* StampBook::RootOf(const fs::path& path) const {
  if (!Below(project_, path).empty()) return nullptr;
  for (const Root& root : roots_) {
    if (!Below(root.path, path).empty()) return &root;
  }
  return nullptr;
}

std::string StampBook::ShortName(const fs::path& path) const {
  if (std::string name = Below(project_, path); !name.empty()) return name;
  if (const Root* root = RootOf(path)) {
    return fmt::format("{}/{}", root->label, Below(root->path, path));
  }
  return path.generic_string();
}

void StampBook::WriteRoots() {
  for (Root& root : roots_) {
    if (root.since != kNever) continue;
    WriteFile(RootPath(root), root.identity);
    root.since = ChangeTime(RootPath(root));
  }
}

std::string StampBook::HashOf(const fs::path& path) {
  const auto found = known_.find(path);
  if (found != known_.end()) return found->second;
  std::string hash = ChangeTime(path) < 0 ? "absent" : HashFile(path);
  known_[path] = hash;
  return hash;
}

bool StampBook::RootsHold(const fs::path& path, std::int64_t written) {
  const Root* root = RootOf(path);
  if (root == nullptr) return true;
  const auto older = [&](const fs::path& folder) {
    const auto [entry, added] = folder_times_.try_emplace(folder);
    if (added) entry->second = ChangeTime(folder);
    return entry->second < written;
  };
  bool hold = root->since < written && older(root->path);
  for (fs::path folder = path.parent_path(); hold && !Below(root->path, folder).empty();
       folder = folder.parent_path()) {
    if (folder == root->path) break;
    hold = older(folder);
  }
  return hold;
}

std::string StampBook::HashSince(const fs::path& path,
                                 const std::string& stored,
                                 std::int64_t written,
                                 bool& reread) {
  const std::int64_t changed = ChangeTime(path);
  if (changed >= 0 && changed < written) {
    if (RootsHold(path, written)) {
      known_.try_emplace(path, stored);
    } else {
      reread = true;
    }
  }
  return HashOf(path);
}

bool StampBook::Load(const Unit& unit, Record& record) const {
  const fs::path path = StampPath(unit);
  record.written = ChangeTime(path);
  if (record.written < 0) return false;
  const auto json = nlohmann::json::parse(ReadFile(path), nullptr, /*allow_exceptions=*/false);
  using Hashes = std::map<std::string, std::string>;
  try {
    record.outdated = json.at("version").get<int>() != kStampVersion;
    record.begun = json.value("begun", false);
    record.kept = json.value("kept", Hashes());
    if (record.begun) return true;
    record.options = json.at("options").get<std::string>();
    record.inputs = json.at("inputs").get<Hashes>();
    record.outputs = json.at("outputs").get<Hashes>();
  } catch (const nlohmann::json::exception&) {
    return false;  // a damaged stamp is no stamp
  }
  return true;
}

UnitReport StampBook::Examine(const Unit& unit) {
  UnitReport report;
  Record record;
  if (!Load(unit, record)) return report;
  bool missing = record.begun;
  for (const fs::path& path : unit.outputs) {
    const std::string name = ShortName(path);
    const auto kept = record.kept.find(name);
    if (record.begun) {
      if (kept != record.kept.end()) report.edited.push_back(path);
      continue;
    }
    const auto computed = record.outputs.find(name);
    if (ChangeTime(path) < 0 || computed == record.outputs.end()) {
      missing = true;
      continue;
    }
    const std::string& last = kept != record.kept.end() ? kept->second : computed->second;
    if (HashSince(path, last, record.written, report.reread) != computed->second)
      report.edited.push_back(path);
  }
  if (missing) return report;
  const auto stale = [&] {
    if (record.outdated || record.options != unit.options ||
        record.inputs.size() != unit.inputs.size()) {
      return true;
    }
    return std::any_of(unit.inputs.begin(), unit.inputs.end(), [&](const fs::path& path) {
      const auto stored = record.inputs.find(ShortName(path));
      return stored == record.inputs.end() ||
             HashSince(path, stored->second, record.written, report.reread) != stored->second;
    });
  };
  const bool all_edited = !unit.outputs.empty() && report.edited.size() == unit.outputs.size();
  if (!all_edited && stale()) {
    report.state = UnitState::kStale;
  } else {
    report.state = report.edited.empty() ? UnitState::kDone : UnitState::kEdited;
  }
  return report;
}

void StampBook::Begin(const Unit& unit) {
  WriteRoots();
  Record record;
  if (!Load(unit, record) || !record.begun) {
    const UnitReport report = Examine(unit);
    record.kept.clear();
    for (const fs::path& path : report.edited) {
      const std::string name = ShortName(path);
      WriteFile(AsidePath(unit, name), ReadFile(path));
      record.kept[name] = HashOf(path);
    }
  }
  const nlohmann::json json = {{"version", kStampVersion},
                               {"stage", unit.stage},
                               {"unit", unit.id},
                               {"begun", true},
                               {"kept", record.kept}};
  WriteFile(StampPath(unit), json.dump(1) + "\n");
}

std::map<std::string, std::string> StampBook::Restore(const Unit& unit) {
  Record record;
  std::map<std::string, std::string> kept;
  if (!Load(unit, record) || !record.begun) return kept;
  for (const fs::path& path : unit.outputs) {
    const std::string name = ShortName(path);
    const auto edited = record.kept.find(name);
    const fs::path aside = AsidePath(unit, name);
    if (edited == record.kept.end() || !fs::exists(aside)) continue;
    WriteFile(path, ReadFile(aside));
    known_[path] = edited->second;
    kept.insert(*edited);
  }
  return kept;
}

void StampBook::Finish(const Unit& unit) {
  std::map<std::string, std::string> outputs;
  for (const fs::path& path : unit.outputs) {
    known_.erase(path);
    outputs[ShortName(path)] = HashOf(path);
  }
  const std::map<std::string, std::string> kept = Restore(unit);
  Write(unit, outputs, kept);
  if (!kept.empty()) fs::remove_all(AsidePath(unit, "").parent_path());
}

void StampBook::Abandon(const Unit& unit) {
  for (const fs::path& path : unit.outputs) known_.erase(path);
  (void)Restore(unit);
}

void StampBook::Write(const Unit& unit,
                      const std::map<std::string, std::string>& outputs,
                      const std::map<std::string, std::string>& kept) {
  nlohmann::json json = {{"version", kStampVersion},
                         {"stage", unit.stage},
                         {"unit", unit.id},
                         {"options", unit.options},
                         {"inputs", nlohmann::json::object()},
                         {"outputs", outputs}};
  for (const fs::path& path : unit.inputs) json["inputs"][ShortName(path)] = HashOf(path);
  if (!kept.empty()) json["kept"] = kept;
  WriteFile(StampPath(unit), json.dump(1) + "\n");
}

void StampBook::Stamp(const Unit& unit) {
  WriteRoots();
  std::map<std::string, std::string> outputs;
  for (const fs::path& path : unit.outputs) {
    known_.erase(path);
    outputs[ShortName(path)] = HashOf(path);
  }
  Write(unit, outputs, {});
}

void StampBook::Confirm(const Unit& unit) {
  WriteRoots();
  WriteFile(StampPath(unit), ReadFile(StampPath(unit)));
}

}  // namespace dyxel
