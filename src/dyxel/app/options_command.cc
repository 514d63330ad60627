#include <fmt/format.h>

#include "dyxel/app/commands.h"
#include "dyxel/pipeline/options.h"

namespace dyxel {

void AddOptionsCommand(CLI::App& program) {
  static bool json = false;
  CLI::App* command =
      AddCommand(program, "options", "List all options: default, unit, range, what they decide");
  command->add_flag("--json", json, "As JSON");
  command->callback([] { fmt::print("{}\n", json ? OptionTableJson() : FormatOptionTable()); });
}

}  // namespace dyxel
