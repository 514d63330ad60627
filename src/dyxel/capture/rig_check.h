// What the numbers of a rig alone tell: cameras and lights that can't be where they are said to be.
#pragma once

#include "dyxel/capture/check.h"

namespace dyxel::internal {

// Fills report.centre, of the cameras whose own entry is good, and adds items about good entries.
void CheckRig(const std::vector<bool>& good_cameras,
              const std::vector<bool>& good_lights,
              CheckReport& report);

}  // namespace dyxel::internal
