// Options declared once: each field of an options struct with its name, unit, range and help. That
// declaration serves dyxel.toml, --set, `dyxel options`, the range checks, the docs and the stamps.
//
//   struct ActorOptions {
//     int rounds = 3;
//     template <class Self, class Field>
//     static void Describe(Self& o, Field&& field) {
//       field(o.rounds, {.name = "rounds", .unit = "", .min = 1, .max = 10,
//                        .help = "rounds of proportions and poses"});
//     }
//   };
//
//   OptionTable table;
//   table.Add("actor", actor_options);     // the default is the struct's own
//   table.Set("actor.rounds", "5");
#pragma once

#include <limits>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "dyxel/base/error.h"
#include "dyxel/base/progress.h"

namespace dyxel {

struct OptionInfo {
  std::string name;  // lower_case; "group.name" for a grouped option
  std::string unit;  // "" for a pure number or text
  double min = -std::numeric_limits<double>::infinity();  // inclusive
  double max = std::numeric_limits<double>::infinity();   // inclusive
  std::vector<std::string> choices;                       // of a text; empty: any
  std::string help;                                       // one line: what the value decides
};

using OptionValue = std::variant<bool, int, double, std::string, std::vector<std::string>>;

// One option of a table: where it stands and what it was by default.
struct OptionRow {
  std::string key;  // "stage.name"
  OptionInfo info;
  OptionValue default_value;
  std::variant<bool*, int*, double*, std::string*, std::vector<std::string>*> target;

  [[nodiscard]] OptionValue Value() const;
};

// "0.5", "true", "phong", "[res, res_b]": as --set takes it and `dyxel options` prints it.
[[nodiscard]] std::string FormatOption(const OptionValue& value);

// The options of all stages by key. Holds pointers into the structs, which must outlive it.
class OptionTable {
 public:
  // Registers every field that Options::Describe names. `options` must hold the defaults.
  template <class Options>
  void Add(const std::string& stage, Options& options) {
    Options::Describe(options, [&](auto& value, OptionInfo info) {
      std::string key = stage + "." + info.name;
      rows_.push_back({std::move(key), std::move(info), OptionValue(value), &value});
    });
  }

  // Throws Error(kUsage): unknown key (with the nearest known), unreadable value, out of range.
  void Set(std::string_view key, std::string_view value);
  // "stage.name=value".
  void SetAssignment(std::string_view assignment);
  void SetValue(std::string_view key, const OptionValue& value);

  [[nodiscard]] const std::vector<OptionRow>& rows() const { return rows_; }
  // The values of one stage, a line each, for its stamp. All lines are "name=value".
  [[nodiscard]] std::string Fingerprint(std::string_view stage) const;

 private:
  OptionRow& Find(std::string_view key);
  std::vector<OptionRow> rows_;
};

// Throws Error(kUsage) naming the field, its value and the rule, where a field of `options` is out
// of its declared range. Every stage calls it first.
template <class Options>
void CheckOptions(const std::string& stage, const Options& options) {
  Options copy = options;
  OptionTable table;
  table.Add(stage, copy);
  for (const OptionRow& row : table.rows()) table.SetValue(row.key, row.Value());
}

}  // namespace dyxel
