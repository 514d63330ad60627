// Reading JSON that anyone may have written: every wrong type, range and unknown key becomes an
// item of a list, and reading goes on.
#pragma once

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "dyxel/capture/manifest.h"

namespace dyxel::internal {

using Json = nlohmann::json;

// What stands there, short, for messages.
[[nodiscard]] std::string Describe(const Json& value);

// The known name nearest to `name` by edits, or "" where none is near (two edits, or a third of
// it).
[[nodiscard]] std::string Nearest(const std::string& name, const std::vector<std::string>& known);

// The fields of one JSON object at `where` ("cameras[2] (cam2)"). Every look-up makes its key
// known; ReportUnknown() then names the keys that nobody asked for.
class Fields {
 public:
  Fields(std::vector<CheckItem>& items, const Json& object, std::string where)
      : items_(items), object_(object), where_(std::move(where)) {
    if (!object_.is_object()) {
      Fail(fmt::format("{} is {}, not an object", where_, Describe(object_)),
           "Write it as {\"key\": value, …}");
    }
  }

  void SetWhere(std::string where) { where_ = std::move(where); }
  void Fail(std::string what, std::string mend) {
    items_.push_back({Severity::kError, "capture.json", std::move(what), std::move(mend)});
  }
  void Warn(std::string what, std::string mend) {
    items_.push_back({Severity::kWarning, "capture.json", std::move(what), std::move(mend)});
  }

  // Null where the key is absent (an item if it is required).
  const Json* Find(const std::string& key, bool required = false) {
    known_.insert(key);
    if (object_.is_object()) {
      const auto it = object_.find(key);
      if (it != object_.end()) return &*it;
      if (required)
        Fail(Place(key) + " is missing", "Add it; docs/capture-format.md says what it is");
    }
    return nullptr;
  }

  // Each leaves `target` as it is, and says false, where the key is absent or wrong.
  bool Number(
      const std::string& key, double& target, double min, double max, bool required = false) {
    const Json* value = Find(key, required);
    return value != nullptr && NumberOf(*value, Place(key), target, min, max);
  }
  bool Integer(const std::string& key, int& target, int min, int max, bool required = false) {
    const Json* value = Find(key, required);
    double number = 0;
    if (value == nullptr || !NumberOf(*value, Place(key), number, min, max)) return false;
    if (number != std::floor(number)) {
      Fail(fmt::format("{} is {}, not a whole number", Place(key), number), "Write a whole number");
      return false;
    }
    target = static_cast<int>(number);
    return true;
  }
  bool Text(const std::string& key, std::string& target, bool required = false) {
    const Json* value = Find(key, required);
    return value != nullptr && TextOf(*value, Place(key), target);
  }
  bool Flag(const std::string& key, bool& target) {
    const Json* value = Find(key);
    if (value == nullptr) return false;
    if (!value->is_boolean()) {
      Fail(fmt::format("{} is {}, not true or false", Place(key), Describe(*value)),
           "Write true or false");
      return false;
    }
    target = value->get<bool>();
    return true;
  }
  template <std::size_t N>
  bool Numbers(const std::string& key,
               std::array<double, N>& target,
               double min,
               double max,
               bool required = false) {
    const Json* value = Find(key, required);
    if (value == nullptr) return false;
    if (!value->is_array() || value->size() != N) {
      Fail(fmt::format("{} is {}, not a list of {} numbers", Place(key), Describe(*value), N),
           fmt::format("Write {} numbers in brackets", N));
      return false;
    }
    std::array<double, N> numbers{};
    for (std::size_t i = 0; i < N; ++i) {
      const std::string place = fmt::format("{}[{}]", Place(key), i);
      if (!NumberOf((*value)[i], place, numbers[i], min, max)) return false;
    }
    target = numbers;
    return true;
  }
  bool Texts(const Json& value, const std::string& place, std::vector<std::string>& target) {
    if (!value.is_array()) {
      Fail(fmt::format("{} is {}, not a list of names", place, Describe(value)),
           "Write names in brackets");
      return false;
    }
    std::vector<std::string> texts(value.size());
    for (std::size_t i = 0; i < texts.size(); ++i) {
      if (!TextOf(value[i], fmt::format("{}[{}]", place, i), texts[i])) return false;
    }
    target = std::move(texts);
    return true;
  }

  void ReportUnknown() {
    if (!object_.is_object()) return;
    const std::vector<std::string> known(known_.begin(), known_.end());
    for (const auto& item : object_.items()) {
      if (known_.count(item.key()) != 0) continue;
      const std::string nearest = Nearest(item.key(), known);
      const std::string what = fmt::format("{} is no known key", Place(item.key()));
      if (nearest.empty()) {
        Warn(what + " and is left out", "Remove it, or keep it for yourself");
      } else {
        Fail(what, fmt::format("Write \"{}\", if that is what was meant", nearest));
      }
    }
  }

  [[nodiscard]] std::vector<CheckItem>& items() { return items_; }
  [[nodiscard]] std::string Place(const std::string& key) const {
    return where_.empty() ? key : where_ + "." + key;
  }

 private:
  bool NumberOf(
      const Json& value, const std::string& place, double& target, double min, double max) {
    if (!value.is_number()) {
      Fail(fmt::format("{} is {}, not a number", place, Describe(value)), "Write a number");
      return false;
    }
    const auto number = value.get<double>();
    if (!(number >= min && number <= max)) {
      Fail(fmt::format("{} is {}, which is not in [{}, {}]", place, number, min, max),
           "Write a value in that range");
      return false;
    }
    target = number;
    return true;
  }
  bool TextOf(const Json& value, const std::string& place, std::string& target) {
    if (!value.is_string()) {
      Fail(fmt::format("{} is {}, not a text", place, Describe(value)), "Write it in quotes");
      return false;
    }
    target = value.get<std::string>();
    return true;
  }

  std::vector<CheckItem>& items_;
  const Json& object_;
  std::string where_;
  std::set<std::string> known_;
};

}  // namespace dyxel::internal
