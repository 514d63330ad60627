// Texts of the command line that several commands take.
#pragma once

#include <string>
#include <utility>

namespace dyxel {

// "3-7" or "5". Throws Error(kUsage) naming the flag.
[[nodiscard]] std::pair<int, int> ParseRange(const std::string& flag, const std::string& text);

}  // namespace dyxel
