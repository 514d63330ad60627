// capture.json and the truth's small text files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "dyxel/capture/camera.h"
#include "dyxel/studio/preset.h"

namespace dyxel::studio {

// One picture-taking instant: what stands there, and what of it is recorded where.
struct TimeStep {
  int sequence = 0;
  int frame = 0;
  Posture posture;
  float slide = 0;  // metres
  bool passes = false;
};

// The cameras of a preset's rig: "cam0", "cam1", …
[[nodiscard]] std::vector<Camera> MakeCameras(const StudioPreset& preset);
// All time steps in the order of the sequences. Throws Error(kUsage) where a sequence takes its
// geometry from one that isn't before it.
[[nodiscard]] std::vector<TimeStep> MakeTimeSteps(const StudioPreset& preset);

// Sequences under the same light share plates: "background/spot0+spot1" or "background/env".
[[nodiscard]] std::string PlateFolder(const StudioSequence& sequence);
[[nodiscard]] std::string PictureExtension(const StudioPreset& preset);

void WriteManifest(const std::filesystem::path& folder,
                   const StudioPreset& preset,
                   const std::vector<Camera>& cameras);
// truth/joints/SEQ.json and truth/frames.json.
void WriteJointTruth(const std::filesystem::path& folder,
                     const StudioPreset& preset,
                     const std::vector<TimeStep>& steps,
                     const std::vector<std::array<Vec3f, kNumJoints>>& joints);

}  // namespace dyxel::studio
