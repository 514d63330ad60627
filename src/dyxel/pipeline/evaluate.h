// `dyxel evaluate`: every figure of docs/method.md, section M, with pictures.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "dyxel/pipeline/metrics_file.h"
#include "dyxel/pipeline/stages.h"

namespace dyxel {

struct EvaluateRequest {
  std::filesystem::path truth;         // folder of the truth, or empty
  std::vector<std::string> fits;       // --fit: sequences that are also fitted to alone
  std::vector<std::string> ablations;  // --ablate: no_second_pass, base_normals, model_phong
  std::filesystem::path output;        // folder of metrics.json, pictures and index.html
};

// Brings the project up to date, tracks its validation sequences, makes the fits, measures, and
// writes metrics.json, pictures/ and index.html. Held-out cameras and validation sequences never
// touch an estimate. Throws Error as the stages do.
Metrics Evaluate(const Project& project, const EvaluateRequest& request);

}  // namespace dyxel
