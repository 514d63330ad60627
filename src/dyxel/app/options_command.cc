#include <fmt/format.h>

#include "dyxel/app/commands.h"
#include "dyxel/pipeline/options.h"

namespace dyxel {

void AddOptionsCommand(CLI::App& program) {
  static bool json = false;
  static bool markdown = false;
  CLI::App* command =
      AddCommand(program, "options", "List all options: default, unit, range, what they decide");
  CLI::Option* as_json = command->add_flag("--json", json, "As JSON");
  command->add_flag("--markdown", markdown, "As docs/options.md")->excludes(as_json);
  command->callback([] {
    if (markdown) {
      fmt::print("{}", OptionTableMarkdown());
    } else {
      fmt::print("{}\n", json ? OptionTableJson() : FormatOptionTable());
    }
  });
}

}  // namespace dyxel
