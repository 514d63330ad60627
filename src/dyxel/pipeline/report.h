// The HTML report: figures, times, pictures.
#pragma once

#include <filesystem>
#include <vector>

#include "dyxel/pipeline/evaluate_parts.h"

namespace dyxel {

// Writes OUTPUT/index.html, which shows the metrics by group, the project's stage times, and the
// pictures (whose files stand below OUTPUT).
void WriteReport(const Project& project,
                 const Metrics& metrics,
                 const std::vector<ReportPicture>& pictures,
                 const std::filesystem::path& output);

}  // namespace dyxel
