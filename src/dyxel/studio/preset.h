// What a virtual capture is made of, as data: a preset is a table, never code.
#pragma once

#include <string>
#include <vector>

#include "dyxel/capture/capture.h"
#include "dyxel/capture/light.h"
#include "dyxel/math/types.h"
#include "dyxel/studio/appearance.h"
#include "dyxel/studio/motion.h"
#include "dyxel/studio/room.h"

namespace dyxel {

// A camera of the rig, looking at (0, 0, target_height).
struct StudioCamera {
  double azimuth_deg = 0;      // counter-clockwise from +x, seen from above
  double distance = 3.4;       // metres from the up axis; small: overhead
  double height = 1.2;         // metres
  double target_height = 0.9;  // metres
  double focal = 1.35;         // in picture widths
  bool holdout = false;
};

// A recording. Either `frames` of a motion of its own, or, with `geometry_of`, the time steps
// `source_frames` of an earlier sequence under other light.
struct StudioSequence {
  std::string name;
  SequenceKind kind = SequenceKind::kDynamic;
  std::vector<std::string> lights;  // empty: the environment
  studio::MotionKind motion = studio::MotionKind::kTurn;
  int frames = 0;
  int variant = 0;  // of the motion: where a turn starts, how it sways
  std::string geometry_of;
  std::vector<int> source_frames;
  std::vector<int> pass_frames;  // frames with truth passes
  bool slides = false;           // the shirt's pattern slides (slide_amplitude)
};

enum class StudioFiles { kHalfExr, kPng12 };

// Shot and read noise, then the quantization of a 12-bit camera: radiance 1 is a full well. EXR
// files keep what lies above it, PNG files clip.
struct StudioSensor {
  StudioFiles files = StudioFiles::kHalfExr;
  double full_well = 60000;  // electrons at radiance 1
  double read_noise = 6;     // electrons, rms
  int plates = 1;            // a camera and lighting
};

struct StudioPreset {
  std::string name;
  std::string help;        // one line
  int picture_size = 256;  // pixels, square
  double fps = 12.5;
  float mesh_cell = 0.008F;         // metres
  float fold_strength = 1;          // of the cloth's wrinkles
  int samples = 8;                  // a pixel
  int bounce_rays = 32;             // a vertex of the person
  int environment_samples = 8;      // light directions a pixel sample
  int environment_height = 128;     // rows of the map
  double environment_rotation = 0;  // radians
  double slide_amplitude = 0;       // metres
  double slide_period = 2;          // seconds
  std::uint64_t seed = 1;           // of the sensor's noise and the sampling
  std::vector<StudioCamera> rig;
  std::vector<Light> lights;
  studio::Room room;
  studio::Wardrobe wardrobe;
  std::vector<StudioSequence> sequences;
  StudioSensor sensor;
};

// All presets, the smallest first.
[[nodiscard]] const std::vector<StudioPreset>& StudioPresets();
// Throws Error(kUsage) naming the presets that exist.
[[nodiscard]] const StudioPreset& FindStudioPreset(const std::string& name);

}  // namespace dyxel
