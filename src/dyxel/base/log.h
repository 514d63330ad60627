// Messages to the person at the terminal: spdlog on stderr, plain lines.
#pragma once

#include <spdlog/spdlog.h>

namespace dyxel {

enum class Verbosity { kQuiet, kNormal, kVerbose };

// Sets what is shown: kQuiet only errors, kNormal also warnings and notes, kVerbose also details.
void SetVerbosity(Verbosity verbosity);
[[nodiscard]] Verbosity GetVerbosity();

}  // namespace dyxel
