#include "dyxel/pipeline/options.h"

#include <sstream>

#include <nlohmann/json.hpp>
#include <toml++/toml.h>

#include "dyxel/pipeline/toml_options.h"

namespace dyxel {
namespace {

// The table of dyxel.toml that says where the inputs are: no stage's.
constexpr std::string_view kInputsTable = "capture";

OptionValue FromToml(const toml::node& node, const std::string& key, const std::string& file) {
  if (const auto* value = node.as_boolean()) return value->get();
  if (const auto* value = node.as_integer()) return static_cast<int>(value->get());
  if (const auto* value = node.as_floating_point()) return value->get();
  if (const auto* value = node.as_string()) return value->get();
  if (const auto* array = node.as_array()) {
    std::vector<std::string> list;
    for (const toml::node& item : *array) {
      const auto* text = item.as_string();
      if (text == nullptr) {
        throw Error(Fault::kUsage, fmt::format("{}: {} must be a list of texts.", file, key));
      }
      list.push_back(text->get());
    }
    return list;
  }
  throw Error(Fault::kUsage, fmt::format("{}: {} is of no kind that an option has.", file, key));
}

std::string TomlValue(const OptionValue& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return nlohmann::json(*text).dump();
  if (const auto* list = std::get_if<std::vector<std::string>>(&value)) {
    return nlohmann::json(*list).dump();
  }
  if (const auto* number = std::get_if<double>(&value)) {
    const std::string text = fmt::format("{}", *number);
    return text.find_first_of(".einf") == std::string::npos ? text + ".0" : text;
  }
  return FormatOption(value);
}

std::string Limits(const OptionInfo& info) {
  if (!info.choices.empty()) return fmt::format("{}", fmt::join(info.choices, "|"));
  if (std::isinf(info.min) && std::isinf(info.max)) return "";
  return fmt::format("[{}, {}]", info.min, info.max);
}

}  // namespace

void ReadTomlTable(const toml::table& table,
                   const std::string& prefix,
                   const std::string& file,
                   OptionTable& options) {
  for (auto&& [name, node] : table) {
    const std::string key = prefix + std::string(name.str());
    if (const auto* inner = node.as_table()) {
      ReadTomlTable(*inner, key + ".", file, options);
    } else {
      const OptionValue value = FromToml(node, key, file);
      try {
        options.SetValue(key, value);
      } catch (const Error& error) {
        throw Error(error.fault(), fmt::format("{}: {}", file, error.what()));
      }
    }
  }
}

OptionTable PipelineOptions::Table() {
  OptionTable table;
  table.Add("silhouettes", silhouettes);
  table.Add("actor", actor);
  table.Add("motion", motion);
  table.Add("atlas", atlas);
  table.Add("textures", textures);
  table.Add("reflectance", reflectance_sequence);
  table.Add("reflectance", reflectance);
  table.Add("registration", registration);
  table.Add("normals", normals);
  table.Add("render", render);
  return table;
}

void ReadTomlOptions(const std::string& text, const std::string& file, PipelineOptions& options) {
  toml::table parsed;
  try {
    parsed = toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw Error(Fault::kInput,
                fmt::format("{}: line {}: {}. Mend the line, or delete the file to start from the "
                            "defaults.",
                            file,
                            error.source().begin.line,
                            error.description()));
  }
  OptionTable table = options.Table();
  for (auto&& [name, node] : parsed) {
    const auto* stage = node.as_table();
    Require(stage != nullptr,
            Fault::kUsage,
            "{}: {} stands outside a [stage] table. Move it into one.",
            file,
            name.str());
    if (name.str() == kInputsTable) continue;
    ReadTomlTable(*stage, std::string(name.str()) + ".", file, table);
  }
}

std::string WriteTomlOptions(const PipelineOptions& options) {
  PipelineOptions copy = options;
  const OptionTable table = copy.Table();
  std::string text;
  std::string stage;
  for (const OptionRow& row : table.rows()) {
    const std::string row_stage = row.key.substr(0, row.key.find('.'));
    if (row_stage != stage) {
      stage = row_stage;
      text += fmt::format("\n[{}]\n", stage);
    }
    const std::string limits = Limits(row.info);
    text += fmt::format("# {}{}{}\n{} = {}\n",
                        row.info.help,
                        row.info.unit.empty() ? "" : ", " + row.info.unit,
                        limits.empty() ? "" : ", " + limits,
                        row.info.name,
                        TomlValue(row.Value()));
  }
  return text;
}

std::string FormatOptionTable() {
  PipelineOptions defaults;
  const OptionTable table = defaults.Table();
  std::string text = fmt::format(
      "{:<34} {:<12} {:<8} {:<16} {}\n", "option", "default", "unit", "range", "decides");
  for (const OptionRow& row : table.rows()) {
    text += fmt::format("{:<34} {:<12} {:<8} {:<16} {}\n",
                        row.key,
                        FormatOption(row.default_value),
                        row.info.unit,
                        Limits(row.info),
                        row.info.help);
  }
  return text;
}

std::string OptionTableMarkdown() {
  std::string text =
      "# Options\n\n"
      "Every option of the pipeline: set it in `PROJECT/dyxel.toml` under `[stage]`, or with\n"
      "`dyxel run … --set stage.name=value`, which writes it there. A stage whose options changed "
      "is "
      "done again.\n"
      "This page is what `dyxel options --markdown` prints.\n";
  PipelineOptions defaults;
  const OptionTable table = defaults.Table();
  std::string stage;
  for (const OptionRow& row : table.rows()) {
    const std::string row_stage = row.key.substr(0, row.key.find('.'));
    if (row_stage != stage) {
      stage = row_stage;
      text += fmt::format(
          "\n## {}\n\n| option | default | unit | range | decides |\n| --- | --- | --- | --- | --- "
          "|\n",
          stage);
    }
    std::string limits = Limits(row.info);
    if (!row.info.choices.empty()) limits = fmt::format("{}", fmt::join(row.info.choices, ", "));
    text += fmt::format("| `{}` | {} | {} | {} | {} |\n",
                        row.key,
                        FormatOption(row.default_value),
                        row.info.unit,
                        limits,
                        row.info.help);
  }
  return text;
}

std::string OptionTableJson() {
  PipelineOptions defaults;
  const OptionTable table = defaults.Table();
  nlohmann::json json = nlohmann::json::array();
  for (const OptionRow& row : table.rows()) {
    nlohmann::json entry = {{"name", row.key}, {"unit", row.info.unit}, {"help", row.info.help}};
    std::visit([&](const auto& value) { entry["default"] = value; }, row.default_value);
    if (!std::isinf(row.info.min)) entry["min"] = row.info.min;
    if (!std::isinf(row.info.max)) entry["max"] = row.info.max;
    if (!row.info.choices.empty()) entry["choices"] = row.info.choices;
    json.push_back(entry);
  }
  return json.dump(1);
}

}  // namespace dyxel
