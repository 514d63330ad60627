// A virtual capture so small that all stages take seconds on it; for tests.
#pragma once

#include "dyxel/studio/studio.h"

namespace dyxel {

// A RES and a DSS of two frames each; with `validation`, a third frame of the DSS, truth passes,
// and the first of the RES under another lamp.
inline StudioPreset SmallestPreset(bool validation = false) {
  StudioPreset preset = FindStudioPreset("tiny");
  preset.picture_size = 64;
  preset.mesh_cell = 0.03F;
  preset.samples = 1;
  preset.bounce_rays = 1;
  preset.sequences.resize(2);  // res, dss
  for (StudioSequence& s : preset.sequences) {
    s.frames = 2;
    s.pass_frames = {};
  }
  if (validation) {
    preset.sequences[1].frames = 3;
    for (StudioSequence& s : preset.sequences) s.pass_frames = {0};
    preset.sequences.push_back({.name = "val",
                                .kind = SequenceKind::kValidation,
                                .lights = {"spotA"},
                                .geometry_of = "res",
                                .source_frames = {0}});
  }
  return preset;
}

}  // namespace dyxel
