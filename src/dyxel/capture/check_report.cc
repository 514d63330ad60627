// What CheckCapture found, as text and as JSON.
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "dyxel/capture/check.h"

namespace dyxel {
namespace {

constexpr std::size_t kMostShown = 100;  // items of a severity in the text

const char* TypeName(LightType type) {
  return type == LightType::kSpot ? "spot" : type == LightType::kPoint ? "point" : "directional";
}

std::string Triple(const Vec3d& v, const char* format) {
  return fmt::format(fmt::runtime(format), v.x(), v.y(), v.z());
}

// Pads every column to its widest cell; the first row is the head.
std::string Table(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line = " ";
    for (std::size_t i = 0; i < row.size(); ++i) {
      line += fmt::format(" {:<{}} ", row[i], widths[i]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string Items(const CheckReport& report, Severity severity, const char* title) {
  const int count = report.Count(severity);
  if (count == 0) return "";
  std::string text = fmt::format("\n{} ({}):\n", title, count);
  std::size_t shown = 0;
  for (const CheckItem& item : report.items) {
    if (item.severity != severity) continue;
    if (shown++ == kMostShown) {
      return text + fmt::format("  … and {} more; --json lists all\n",
                                static_cast<std::size_t>(count) - kMostShown);
    }
    text += fmt::format("  {}: {}.\n      {}.\n", item.file, item.what, item.mend);
  }
  return text;
}

}  // namespace

std::string FormatCheckReport(const CheckReport& report) {
  const Capture& capture = report.capture;
  std::string text = fmt::format("Capture \"{}\" in {}\n", capture.name, report.folder.string());
  if (!capture.cameras.empty()) {
    std::vector<std::vector<std::string>> rows = {
        {"camera", "position [m]", "focal [px]", "size [px]", "distance [m]", "held out"}};
    for (const Camera& camera : capture.cameras) {
      const double distance = (camera.Center() - report.centre).norm();
      rows.push_back({camera.name,
                      Triple(camera.Center(), "{:.2f} {:.2f} {:.2f}"),
                      fmt::format("{:.0f}", camera.fx),
                      fmt::format("{}x{}", camera.width, camera.height),
                      std::isfinite(distance) ? fmt::format("{:.2f}", distance) : "",
                      camera.holdout ? "yes" : ""});
    }
    text += "\n" + Table(rows);
  }
  if (!capture.lights.empty()) {
    std::vector<std::vector<std::string>> rows = {
        {"light", "type", "position [m]", "direction", "intensity", "cone [deg]"}};
    for (const Light& light : capture.lights) {
      const bool directional = light.type == LightType::kDirectional;
      const Rgb& power = directional ? light.irradiance : light.intensity;
      const bool spot = light.type == LightType::kSpot;
      rows.push_back(
          {light.name,
           TypeName(light.type),
           directional ? "" : Triple(light.position, "{:.2f} {:.2f} {:.2f}"),
           light.type == LightType::kPoint ? "" : Triple(light.direction, "{:.2f} {:.2f} {:.2f}"),
           Triple(power.matrix().cast<double>(), "{:.4g} {:.4g} {:.4g}"),
           spot ? fmt::format(
                      "{:.0f}-{:.0f}", light.cone_inner * 180 / kPiD, light.cone_outer * 180 / kPiD)
                : ""});
    }
    text += "\n" + Table(rows);
  }
  if (!report.sequences.empty()) {
    std::vector<std::vector<std::string>> rows = {{"sequence",
                                                   "kind",
                                                   "frames",
                                                   "pictures",
                                                   "missing",
                                                   "lights",
                                                   "silhouettes",
                                                   "exposure (most)",
                                                   "saturated"}};
    for (const SequenceCheck& sequence : report.sequences) {
      rows.push_back({sequence.name,
                      sequence.kind,
                      std::to_string(sequence.frames),
                      std::to_string(sequence.pictures),
                      std::to_string(sequence.missing),
                      sequence.lighting,
                      sequence.silhouette,
                      fmt::format("{:.3g} ({:.3g})", sequence.exposure, sequence.exposure_max),
                      fmt::format("{:.3f} %", 100 * sequence.saturated)});
    }
    text += "\n" + Table(rows);
  }
  text += Items(report, Severity::kError, "Errors");
  text += Items(report, Severity::kWarning, "Warnings");
  if (report.items.empty()) text += "\nNothing is wrong.\n";
  return text;
}

std::string CheckReportJson(const CheckReport& report) {
  using Json = nlohmann::ordered_json;
  const auto vector = [](const Vec3d& v) { return Json{v.x(), v.y(), v.z()}; };
  Json json = {{"capture", report.capture.name},
               {"folder", report.folder.string()},
               {"errors", report.Count(Severity::kError)},
               {"warnings", report.Count(Severity::kWarning)},
               {"cameras", Json::array()},
               {"lights", Json::array()},
               {"sequences", Json::array()},
               {"items", Json::array()}};
  if (report.centre.allFinite()) json["centre"] = vector(report.centre);
  for (const Camera& camera : report.capture.cameras) {
    json["cameras"].push_back({{"name", camera.name},
                               {"position", vector(camera.Center())},
                               {"focal_px", camera.fx},
                               {"width", camera.width},
                               {"height", camera.height},
                               {"holdout", camera.holdout}});
  }
  for (const Light& light : report.capture.lights) {
    const bool directional = light.type == LightType::kDirectional;
    const Rgb& power = directional ? light.irradiance : light.intensity;
    Json row = {{"name", light.name}, {"type", TypeName(light.type)}};
    if (!directional) row["position"] = vector(light.position);
    row[directional ? "irradiance" : "intensity"] = vector(power.matrix().cast<double>());
    json["lights"].push_back(row);
  }
  for (const SequenceCheck& sequence : report.sequences) {
    json["sequences"].push_back({{"name", sequence.name},
                                 {"kind", sequence.kind},
                                 {"frames", sequence.frames},
                                 {"pictures", sequence.pictures},
                                 {"missing", sequence.missing},
                                 {"lighting", sequence.lighting},
                                 {"silhouette", sequence.silhouette},
                                 {"exposure", sequence.exposure},
                                 {"exposure_max", sequence.exposure_max},
                                 {"saturated", sequence.saturated}});
  }
  for (const CheckItem& item : report.items) {
    json["items"].push_back({{"severity", item.severity == Severity::kError ? "error" : "warning"},
                             {"file", item.file},
                             {"what", item.what},
                             {"mend", item.mend}});
  }
  // Names of files on the disk need not be UTF-8.
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace dyxel
