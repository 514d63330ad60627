#include "dyxel/pipeline/report.h"

#include <nlohmann/json.hpp>

#include "dyxel/base/atomic_file.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

std::string Escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

constexpr const char* kHead = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Dyxel report</title>
<style>
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 70rem; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; margin: 0 0 1.5rem; }
td, th { padding: .15rem .8rem .15rem 0; text-align: left; border-bottom: 1px solid #ddd; }
td.n { text-align: right; font-variant-numeric: tabular-nums; }
figure { margin: 0 0 1.5rem; } img { max-width: 100%; background: #111; }
h2 { margin-top: 2rem; }
</style></head><body>
)";

// "recorded.dss.psnr" → "recorded.dss"; "fit.res_b.albedo.res_b.albedo_psnr" → all but the last
// word.
std::string GroupOf(const std::string& key) { return key.substr(0, key.rfind('.')); }

}  // namespace

void WriteReport(const Project& project,
                 const Metrics& metrics,
                 const std::vector<ReportPicture>& pictures,
                 const fs::path& output) {
  std::string html = kHead;
  html += fmt::format("<h1>{}</h1>\n<p>Project <code>{}</code>, capture <code>{}</code>.</p>\n",
                      Escaped(project.capture.name),
                      Escaped(project.folder.string()),
                      Escaped(project.inputs.capture.string()));
  html += "<h2>Figures</h2>\n<table>\n";
  std::string group;
  for (const auto& [key, value] : metrics.values()) {
    if (GroupOf(key) != group) {
      group = GroupOf(key);
      html += fmt::format("<tr><th colspan=2>{}</th></tr>\n", Escaped(group));
    }
    html += fmt::format("<tr><td>{}</td><td class=n>{:.6g}</td></tr>\n",
                        Escaped(key.substr(group.size() + 1)),
                        value);
  }
  html += "</table>\n";

  const fs::path timings = project.folder / "report" / "timings.json";
  if (fs::exists(timings)) {
    const auto json = nlohmann::json::parse(ReadFile(timings), nullptr, false);
    html +=
        "<h2>Times of the last run</h2>\n<table><tr><th>stage</th><th>wall s</th><th>cpu s</th>"
        "<th>units</th><th>peak MB</th></tr>\n";
    if (json.is_object()) {
      for (const auto& [stage, t] : json.items()) {
        html += fmt::format(
            "<tr><td>{}</td><td class=n>{:.1f}</td><td class=n>{:.1f}</td><td class=n>{}</td>"
            "<td class=n>{:.0f}</td></tr>\n",
            Escaped(stage),
            t.value("wall_s", 0.0),
            t.value("cpu_s", 0.0),
            t.value("units", 0),
            t.value("peak_rss_mb", 0.0));
      }
    }
    html += "</table>\n";
  }

  html += "<h2>Pictures</h2>\n<p>Recorded, rendered, and twice their difference around grey.</p>\n";
  for (const ReportPicture& p : pictures) {
    html += fmt::format("<figure><img src=\"{}\" alt=\"\"><figcaption>{}</figcaption></figure>\n",
                        Escaped(p.file),
                        Escaped(p.title));
  }
  WriteFile(output / "index.html", html + "</body></html>\n");
}

}  // namespace dyxel
