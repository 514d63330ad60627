#include <fmt/format.h>

#include "dyxel/app/commands.h"
#include "dyxel/base/progress.h"
#include "dyxel/studio/studio.h"

namespace dyxel {

void AddStudioCommand(CLI::App& program) {
  static std::string folder;
  static std::string preset = "demo";
  CLI::App* c = AddCommand(
      program, "studio", "Render a virtual capture of a clothed, moving person, with its truth");
  c->add_option("OUT", folder, "Folder of the capture")->required();
  c->add_option("--preset", preset, "demo (what a newcomer sees) or tiny (for tests)");
  c->callback([] {
    ProgressBar bar("studio");
    WriteStudioCapture(folder, FindStudioPreset(preset), bar.Callback());
    bar.Finish();
    fmt::print("{}\n", folder);
  });
}

}  // namespace dyxel
