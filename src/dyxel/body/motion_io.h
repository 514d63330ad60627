// motion/SEQ.json: a pose and a confidence a frame, with the names of joints and hinges.
//
//   {"format": "dyxel-motion", "version": 1,
//    "joints": ["pelvis", …], "dofs": ["abdomen_flexion", …],
//    "frames": [
//      {"confidence": 0.97, "translation": [x, y, z], "rotation": [w, x, y, z], "angles": […],
//       "shifts": […]},
//      …]}
//
// Translation in metres and rotation (unit quaternion) are world_from_body of the root, angles in
// radians. Numbers are written so that reading gives the same bits. A confidence that is not known
// (NaN) is null. `shifts`, which may be absent, are those of the nodes (x, y, z each, in their
// frames; nodes.h) in whole kShiftUnit.
#pragma once

#include <filesystem>

#include "dyxel/body/skeleton.h"

namespace dyxel {

void WriteMotion(const std::filesystem::path& path, const Skeleton& skeleton, const Motion& motion);

// Throws Error(kInput) where the file is damaged or belongs to another skeleton.
[[nodiscard]] Motion ReadMotion(const std::filesystem::path& path, const Skeleton& skeleton);

}  // namespace dyxel
