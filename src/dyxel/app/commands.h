// The commands of the program, one file each. Every Add… declares its arguments under `program`.
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace dyxel {

void AddCheckCommand(CLI::App& program);
void AddDemoCommand(CLI::App& program);
void AddEvaluateCommand(CLI::App& program);
void AddOptionsCommand(CLI::App& program);
void AddRenderCommand(CLI::App& program);
void AddRunCommand(CLI::App& program);
void AddStatusCommand(CLI::App& program);
void AddStudioCommand(CLI::App& program);

// A command with the flags that all have: --jobs, --quiet, --verbose.
CLI::App* AddCommand(CLI::App& program, const std::string& name, const std::string& help);

}  // namespace dyxel
