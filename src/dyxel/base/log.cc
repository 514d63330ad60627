#include "dyxel/base/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>

namespace dyxel {
namespace {
Verbosity current = Verbosity::kNormal;
}  // namespace

void SetVerbosity(Verbosity verbosity) {
  current = verbosity;
  static const std::shared_ptr<spdlog::logger> logger = [] {
    auto created = spdlog::stderr_color_mt("dyxel");
    spdlog::set_default_logger(created);
    return created;
  }();
  logger->set_pattern("%^%v%$");
  logger->set_level(verbosity == Verbosity::kQuiet     ? spdlog::level::err
                    : verbosity == Verbosity::kVerbose ? spdlog::level::debug
                                                       : spdlog::level::info);
}

Verbosity GetVerbosity() { return current; }

}  // namespace dyxel
