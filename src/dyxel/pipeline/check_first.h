// `dyxel run` refuses a capture that `dyxel check` calls broken, before it computes anything.
#pragma once

#include "dyxel/pipeline/project.h"

namespace dyxel {

// Checks the project's capture, all of it, unless nothing in it has changed since it was last found
// whole. Throws Error(kInput) with the first errors and how many more there are.
void RefuseBrokenCapture(const Project& project);

}  // namespace dyxel
