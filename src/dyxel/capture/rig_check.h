// What the numbers of a rig alone tell: cameras and lights that can't be where they are said to be.
#pragma once

#include "dyxel/capture/check.h"

namespace dyxel::internal {

// Fills report.centre and adds items.
void CheckRig(CheckReport& report);

}  // namespace dyxel::internal
