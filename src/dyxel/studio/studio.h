// The virtual capture studio: a clothed, moving person, ray traced, as a capture with its truth.
#pragma once

#include <filesystem>

#include "dyxel/base/progress.h"
#include "dyxel/studio/preset.h"

namespace dyxel {

// Writes the capture and its truth folder (capture-format.md) into `folder`; files that are there
// are replaced. The same bytes for any number of threads. Throws Error(kStage) where a file can't
// be written.
void WriteStudioCapture(const std::filesystem::path& folder,
                        const StudioPreset& preset,
                        const ProgressFn& progress = {});
// The preset by name; throws Error(kUsage) where there is none.
void WriteStudioCapture(const std::filesystem::path& folder,
                        const std::string& preset,
                        const ProgressFn& progress = {});

}  // namespace dyxel
