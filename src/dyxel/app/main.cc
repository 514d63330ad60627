// dyxel: the command line. Exit status: 0 done, 1 a stage could not reach a result, 2 wrong usage,
// 3 bad input, 130 interrupted.
#include <exception>
#include <new>

#include <opencv2/core/utility.hpp>

#include "dyxel/app/commands.h"
#include "dyxel/base/error.h"
#include "dyxel/base/interrupt.h"
#include "dyxel/base/log.h"
#include "dyxel/base/parallel.h"

namespace dyxel {
namespace {

struct CommonFlags {
  int jobs = 0;
  bool quiet = false;
  bool verbose = false;
};

CommonFlags& Flags() {
  static CommonFlags flags;
  return flags;
}

void ApplyFlags() {
  const CommonFlags& flags = Flags();
  SetJobs(flags.jobs);
  // OpenCV's own threads know nothing of --jobs; ours run its calls side by side.
  cv::setNumThreads(1);
  SetVerbosity(flags.quiet     ? Verbosity::kQuiet
               : flags.verbose ? Verbosity::kVerbose
                               : Verbosity::kNormal);
}

int Main(int argc, char** argv) {
  CLI::App program(
      "Dyxel: relightable 3D video of people from a handful of calibrated cameras and lights.");
  program.name("dyxel");
  program.require_subcommand(1);
  program.set_version_flag("--version", DYXEL_VERSION);
  AddDemoCommand(program);
  AddCheckCommand(program);
  AddRunCommand(program);
  AddStatusCommand(program);
  AddRenderCommand(program);
  AddEvaluateCommand(program);
  AddStudioCommand(program);
  AddOptionsCommand(program);
  HandleInterrupts();
  SetVerbosity(Verbosity::kNormal);
  try {
    program.parse(argc, argv);
    return 0;
  } catch (const CLI::ParseError& error) {
    // --help and --version also come this way, with exit code 0.
    return program.exit(error) == 0 ? 0 : static_cast<int>(Fault::kUsage);
  } catch (const Error& error) {
    spdlog::error("dyxel: {}", error.what());
    return static_cast<int>(error.fault());
  } catch (const std::bad_alloc&) {
    spdlog::error(
        "dyxel: out of memory. Try --scale 0.5, or fewer --frames; what is done is kept.");
    return static_cast<int>(Fault::kStage);
  } catch (const std::exception& error) {
    spdlog::error("dyxel: {}", error.what());
    return static_cast<int>(Fault::kStage);
  }
}

}  // namespace

CLI::App* AddCommand(CLI::App& program, const std::string& name, const std::string& help) {
  CLI::App* command = program.add_subcommand(name, help);
  command->add_option("-j,--jobs", Flags().jobs, "Threads; 0: all cores")
      ->check(CLI::Range(0, 1024));
  command->add_flag("-q,--quiet", Flags().quiet, "Only errors");
  command->add_flag("-v,--verbose", Flags().verbose, "Also details");
  command->parse_complete_callback(ApplyFlags);
  return command;
}

}  // namespace dyxel

int main(int argc, char** argv) { return dyxel::Main(argc, argv); }
