#include "dyxel/base/error.h"

namespace dyxel {

Error FileError(const std::filesystem::path& file,
                const std::string& what,
                const std::string& mend) {
  return {Fault::kInput, fmt::format("{}: {}. {}.", file.string(), what, mend)};
}

}  // namespace dyxel
