#include "dyxel/base/option.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/ranges.h>

namespace dyxel {
namespace {

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;

std::string_view Trim(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\"'");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\"'") - first + 1);
}

// Levenshtein's distance, to name the key that was meant.
std::size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

[[noreturn]] void Refuse(const OptionRow& row, std::string_view value, const std::string& rule) {
  throw Error(Fault::kUsage,
              fmt::format("option {} = {}: {} ({}).", row.key, value, rule, row.info.help));
}

void CheckRange(const OptionRow& row, double value) {
  if (!(value >= row.info.min && value <= row.info.max)) {
    Refuse(row,
           fmt::format("{}", value),
           fmt::format("must be in [{}, {}] {}", row.info.min, row.info.max, row.info.unit));
  }
}

template <class T>
T ParseNumber(const OptionRow& row, std::string_view text) {
  T value{};
  const auto result = std::from_chars(text.data(), text.data() + text.size(), value);
  if (result.ec != std::errc() || result.ptr != text.data() + text.size()) {
    Refuse(row, text, std::is_integral_v<T> ? "must be a whole number" : "must be a number");
  }
  return value;
}

std::vector<std::string> ParseList(std::string_view text) {
  if (!text.empty() && text.front() == '[') text.remove_prefix(1);
  if (!text.empty() && text.back() == ']') text.remove_suffix(1);
  std::vector<std::string> list;
  while (!text.empty()) {
    const auto comma = text.find(',');
    const std::string_view item = Trim(text.substr(0, comma));
    if (!item.empty()) list.emplace_back(item);
    text = comma == std::string_view::npos ? std::string_view{} : text.substr(comma + 1);
  }
  return list;
}

}  // namespace

OptionValue OptionRow::Value() const {
  return std::visit([](const auto* pointer) { return OptionValue(*pointer); }, target);
}

std::string FormatOption(const OptionValue& value) {
  return std::visit(Overloaded{[](bool v) { return std::string(v ? "true" : "false"); },
                               [](const std::string& v) { return v; },
                               [](const std::vector<std::string>& v) {
                                 return fmt::format("[{}]", fmt::join(v, ", "));
                               },
                               [](auto v) { return fmt::format("{}", v); }},
                    value);
}

OptionRow& OptionTable::Find(std::string_view key) {
  const auto found = std::find_if(
      rows_.begin(), rows_.end(), [&](const OptionRow& row) { return row.key == key; });
  if (found != rows_.end()) return *found;
  const auto nearest =
      std::min_element(rows_.begin(), rows_.end(), [&](const OptionRow& a, const OptionRow& b) {
        return EditDistance(a.key, key) < EditDistance(b.key, key);
      });
  throw Error(Fault::kUsage,
              fmt::format("option {}: unknown. Did you mean {}? `dyxel options` lists all.",
                          key,
                          nearest == rows_.end() ? std::string("none") : nearest->key));
}

void OptionTable::SetValue(std::string_view key, const OptionValue& value) {
  OptionRow& row = Find(key);
  std::visit(
      [&](auto* target) {
        using T = std::remove_pointer_t<decltype(target)>;
        if constexpr (std::is_same_v<T, double>) {
          if (const int* whole = std::get_if<int>(&value)) {
            CheckRange(row, *whole);
            *target = *whole;
            return;
          }
        }
        const T* held = std::get_if<T>(&value);
        if (held == nullptr) Refuse(row, FormatOption(value), "is of the wrong kind");
        if constexpr (std::is_same_v<T, double> || std::is_same_v<T, int>) {
          CheckRange(row, static_cast<double>(*held));
        }
        if constexpr (std::is_same_v<T, std::string>) {
          if (!row.info.choices.empty() &&
              std::find(row.info.choices.begin(), row.info.choices.end(), *held) ==
                  row.info.choices.end()) {
            Refuse(row, *held, fmt::format("must be one of {}", fmt::join(row.info.choices, ", ")));
          }
        }
        *target = *held;
      },
      row.target);
}

void OptionTable::Set(std::string_view key, std::string_view value) {
  OptionRow& row = Find(key);
  const std::string_view text = Trim(value);
  const OptionValue parsed = std::visit(
      Overloaded{[&](const bool*) -> OptionValue {
                   if (text == "true" || text == "on" || text == "1") return true;
                   if (text == "false" || text == "off" || text == "0") return false;
                   Refuse(row, text, "must be true or false");
                 },
                 [&](const int*) -> OptionValue { return ParseNumber<int>(row, text); },
                 [&](const double*) -> OptionValue { return ParseNumber<double>(row, text); },
                 [&](const std::string*) -> OptionValue { return std::string(text); },
                 [&](const std::vector<std::string>*) -> OptionValue { return ParseList(text); }},
      row.target);
  SetValue(key, parsed);
}

void OptionTable::SetAssignment(std::string_view assignment) {
  const auto equals = assignment.find('=');
  Require(equals != std::string_view::npos,
          Fault::kUsage,
          "--set {}: must be stage.name=value.",
          assignment);
  Set(Trim(assignment.substr(0, equals)), assignment.substr(equals + 1));
}

std::string OptionTable::Fingerprint(std::string_view stage) const {
  std::string lines;
  for (const OptionRow& row : rows_) {
    if (row.key.size() > stage.size() && row.key.compare(0, stage.size(), stage) == 0 &&
        row.key[stage.size()] == '.') {
      lines += row.info.name + "=" + FormatOption(row.Value()) + "\n";
    }
  }
  return lines;
}

}  // namespace dyxel
