#include "dyxel/pipeline/stamps.h"

#include <algorithm>

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

std::string FileSafe(std::string id) {
  std::replace(id.begin(), id.end(), '/', '.');
  return id;
}

}  // namespace

struct StampBook::Record {
  std::int64_t written = 0;  // ctime of the stamp itself
  std::string options;
  std::map<std::string, std::string> inputs, outputs;  // short name → hash
};

StampBook::StampBook(fs::path project, std::map<std::string, fs::path> roots)
    : project_(std::move(project)), roots_(std::move(roots)) {}

fs::path StampBook::StampPath(const Unit& unit) const {
  return project_ / "state" / unit.stage / (FileSafe(unit.id) + ".json");
}

std::string StampBook::ShortName(const fs::path& path) const {
  const auto below = [&](const fs::path& root) {
    const fs::path relative = path.lexically_relative(root);
    return relative.empty() || *relative.begin() == ".." ? std::string()
                                                         : relative.generic_string();
  };
  if (std::string name = below(project_); !name.empty()) return name;
  for (const auto& [label, root] : roots_) {
    if (std::string name = below(root); !name.empty()) return fmt::format("{}/{}", label, name);
  }
  return path.generic_string();
}

std::string StampBook::HashOf(const fs::path& path) {
  const auto found = known_.find(path);
  if (found != known_.end()) return found->second;
  std::string hash = ChangeTime(path) < 0 ? "absent" : HashFile(path);
  known_[path] = hash;
  return hash;
}

bool StampBook::Load(const Unit& unit, Record& record) const {
  const fs::path path = StampPath(unit);
  record.written = ChangeTime(path);
  if (record.written < 0) return false;
  const auto json = nlohmann::json::parse(ReadFile(path), nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || json.value("version", 0) != kStampVersion) return false;
  try {
    record.options = json.at("options").get<std::string>();
    record.inputs = json.at("inputs").get<std::map<std::string, std::string>>();
    record.outputs = json.at("outputs").get<std::map<std::string, std::string>>();
  } catch (const nlohmann::json::exception&) {
    return false;  // a damaged stamp is no stamp
  }
  return true;
}

UnitState StampBook::State(const Unit& unit) {
  Record record;
  if (!Load(unit, record)) return UnitState::kMissing;
  const auto unchanged = [&](const fs::path& path,
                             const std::map<std::string, std::string>& hashes) {
    const auto stored = hashes.find(ShortName(path));
    if (stored == hashes.end()) return false;
    const std::int64_t changed = ChangeTime(path);
    // Inputs that this process has rewritten are in known_; their ctime is newer anyway.
    if (changed >= 0 && changed < record.written) {
      known_.emplace(path, stored->second);
      return true;
    }
    known_.erase(path);
    return HashOf(path) == stored->second;
  };
  bool edited = false;
  for (const fs::path& path : unit.outputs) {
    if (ChangeTime(path) < 0) return UnitState::kMissing;
    if (record.outputs.find(ShortName(path)) == record.outputs.end()) return UnitState::kMissing;
    edited = !unchanged(path, record.outputs) || edited;
  }
  if (edited) return UnitState::kEdited;
  if (record.options != unit.options || record.inputs.size() != unit.inputs.size()) {
    return UnitState::kStale;
  }
  for (const fs::path& path : unit.inputs) {
    if (!unchanged(path, record.inputs)) return UnitState::kStale;
  }
  return UnitState::kDone;
}

std::vector<fs::path> StampBook::EditedOutputs(const Unit& unit) {
  std::vector<fs::path> edited;
  Record record;
  if (!Load(unit, record)) return edited;
  for (const fs::path& path : unit.outputs) {
    const auto stored = record.outputs.find(ShortName(path));
    if (stored != record.outputs.end() && ChangeTime(path) >= 0 && HashOf(path) != stored->second) {
      edited.push_back(path);
    }
  }
  return edited;
}

void StampBook::Stamp(const Unit& unit) {
  nlohmann::json json;
  json["version"] = kStampVersion;
  json["stage"] = unit.stage;
  json["unit"] = unit.id;
  json["options"] = unit.options;
  json["inputs"] = nlohmann::json::object();
  json["outputs"] = nlohmann::json::object();
  for (const fs::path& path : unit.inputs) json["inputs"][ShortName(path)] = HashOf(path);
  for (const fs::path& path : unit.outputs) {
    known_.erase(path);
    json["outputs"][ShortName(path)] = HashOf(path);
  }
  WriteFile(StampPath(unit), json.dump(1) + "\n");
}

}  // namespace dyxel
