// A TOML table into options; only for sources that read dyxel.toml.
#pragma once

#include <string>

#include <toml++/toml.h>

#include "dyxel/base/option.h"

namespace dyxel {

// Sets options[prefix + key] for every key below `table`; `file` is for messages. Throws
// Error(kUsage) for a key or value that an option refuses.
void ReadTomlTable(const toml::table& table,
                   const std::string& prefix,
                   const std::string& file,
                   OptionTable& options);

}  // namespace dyxel
