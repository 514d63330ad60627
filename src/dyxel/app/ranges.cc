#include "dyxel/app/ranges.h"

#include <charconv>

#include "dyxel/base/error.h"

namespace dyxel {

std::pair<int, int> ParseRange(const std::string& flag, const std::string& text) {
  int first = -1;
  int last = -1;
  const char* end = text.data() + text.size();
  auto result = std::from_chars(text.data(), end, first);
  bool ok = result.ec == std::errc();
  if (ok && result.ptr == end) {
    last = first;
  } else if (ok && *result.ptr == '-') {
    result = std::from_chars(result.ptr + 1, end, last);
    ok = result.ec == std::errc() && result.ptr == end;
  } else {
    ok = false;
  }
  Require(ok && first >= 0 && last >= first,
          Fault::kUsage,
          "{} {}: must be A-B with 0 <= A <= B.",
          flag,
          text);
  return {first, last};
}

}  // namespace dyxel
