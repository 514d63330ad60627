#include "dyxel/studio/preset.h"

#include "dyxel/base/error.h"
#include "dyxel/studio/optics.h"

namespace dyxel {
namespace {

using studio::MotionKind;

// Seven around, one overhead, one held out between two others.
std::vector<StudioCamera> Rig() {
  return {{.azimuth_deg = 4, .distance = 3.35, .height = 1.50, .focal = 1.30},
          {.azimuth_deg = 57, .distance = 3.45, .height = 1.05, .focal = 1.34},
          {.azimuth_deg = 108, .distance = 3.30, .height = 1.75, .focal = 1.28},
          {.azimuth_deg = 161, .distance = 3.50, .height = 1.15, .focal = 1.36},
          {.azimuth_deg = 212, .distance = 3.40, .height = 1.90, .focal = 1.32},
          {.azimuth_deg = 263, .distance = 3.45, .height = 0.95, .focal = 1.34},
          {.azimuth_deg = 316, .distance = 3.55, .height = 1.60, .focal = 1.38},
          {.azimuth_deg = 290, .distance = 0.25, .height = 4.30, .focal = 1.02},
          {.azimuth_deg = 31, .distance = 3.60, .height = 1.45, .focal = 1.38, .holdout = true}};
}

// Two spots on opposite sides for RES and DSS; spotB, and spotA 45 degrees from it.
std::vector<Light> Lights() {
  const Vec3d target(0, 0, 0.95);
  return {
      studio::AimSpot("spot0", {2.55, -1.75, 2.75}, target, Rgb(32.0F, 30.6F, 28.6F), 0.50, 0.62),
      studio::AimSpot("spot1", {-2.20, 2.35, 2.60}, target, Rgb(29.0F, 30.0F, 31.5F), 0.50, 0.62),
      studio::AimSpot("spotB", {2.85, 0.75, 2.65}, target, Rgb(32.0F, 31.2F, 30.0F), 0.50, 0.62),
      studio::AimSpot("spotA", {1.48, 2.55, 2.40}, target, Rgb(30.3F, 30.0F, 29.4F), 0.50, 0.62)};
}

studio::Wardrobe Clothes() {
  studio::Wardrobe w;
  w[studio::kSkin] = {
      .base = {.albedo = Rgb(0.53F, 0.325F, 0.235F), .roughness = 0.48F, .ior = 1.40F},
      .variation = 0.05F};
  w[studio::kShirt] = {
      .base = {.albedo = Rgb(0.055F, 0.215F, 0.260F), .roughness = 0.62F, .ior = 1.46F},
      .pattern = studio::Pattern::kPlaid,
      .second = Rgb(0.50F, 0.47F, 0.36F),
      .third = Rgb(0.50F, 0.070F, 0.045F),
      .print = true,
      .variation = 0.05F};
  w[studio::kTrousers] = {
      .base = {.albedo = Rgb(0.36F, 0.265F, 0.165F), .roughness = 0.55F, .ior = 1.48F},
      .variation = 0.05F};
  w[studio::kShoes] = {
      .base = {.albedo = Rgb(0.30F, 0.035F, 0.035F), .roughness = 0.36F, .ior = 1.50F},
      .second = Rgb(0.62F, 0.60F, 0.55F),
      .variation = 0.04F};
  w[studio::kHair] = {
      .base = {.albedo = Rgb(0.055F, 0.028F, 0.015F), .roughness = 0.42F, .ior = 1.55F},
      .variation = 0.05F};
  return w;
}

StudioSequence Turn(const std::string& name,
                    int frames,
                    int variant,
                    std::vector<std::string> lights,
                    std::vector<int> passes) {
  return {.name = name,
          .kind = SequenceKind::kReflectance,
          .lights = std::move(lights),
          .motion = MotionKind::kTurn,
          .frames = frames,
          .variant = variant,
          .pass_frames = std::move(passes)};
}

StudioSequence Again(const std::string& name,
                     const std::string& source,
                     std::vector<int> frames,
                     std::vector<std::string> lights) {
  return {.name = name,
          .kind = SequenceKind::kValidation,
          .lights = std::move(lights),
          .geometry_of = source,
          .source_frames = std::move(frames)};
}

std::vector<StudioPreset> MakePresets() {
  StudioPreset tiny;
  tiny.name = "tiny";
  tiny.help = "the whole path in well under a minute, for tests";
  tiny.picture_size = 224;
  tiny.mesh_cell = 0.013F;
  tiny.samples = 4;
  tiny.bounce_rays = 16;
  tiny.environment_samples = 6;
  tiny.environment_height = 64;
  tiny.environment_rotation = 0.7;
  tiny.rig = Rig();
  tiny.lights = Lights();
  tiny.wardrobe = Clothes();
  tiny.sensor.plates = 2;
  tiny.sequences = {
      Turn("res", 8, 0, {"spot0", "spot1"}, {0}),
      {.name = "dss",
       .kind = SequenceKind::kDynamic,
       .lights = {"spot0", "spot1"},
       .motion = MotionKind::kLively,
       .frames = 6,
       .pass_frames = {2}},
      Turn("res_b", 4, 1, {"spotB"}, {}),
      Again("val_a", "res_b", {0, 2}, {"spotA"}),
      Again("env", "dss", {2}, {}),
  };

  StudioPreset demo = tiny;
  demo.name = "demo";
  demo.help = "a person in a plaid shirt, for a first look";
  demo.picture_size = 480;
  demo.mesh_cell = 0.0075F;
  demo.samples = 5;
  demo.bounce_rays = 16;
  demo.environment_samples = 12;
  demo.environment_height = 512;
  demo.sensor.plates = 3;
  demo.sequences = {
      Turn("res", 10, 0, {"spot0", "spot1"}, {0, 4}),
      {.name = "dss",
       .kind = SequenceKind::kDynamic,
       .lights = {"spot0", "spot1"},
       .motion = MotionKind::kLively,
       .frames = 16,
       .pass_frames = {2, 8, 13}},
      Turn("res_b", 4, 1, {"spotB"}, {}),
      Again("val_a", "res_b", {0, 2}, {"spotA"}),
      Again("env", "dss", {5, 13}, {}),
  };
  return {tiny, demo};
}

}  // namespace

const std::vector<StudioPreset>& StudioPresets() {
  static const std::vector<StudioPreset> presets = MakePresets();
  return presets;
}

const StudioPreset& FindStudioPreset(const std::string& name) {
  std::string known;
  for (const StudioPreset& preset : StudioPresets()) {
    if (preset.name == name) return preset;
    known += (known.empty() ? "" : ", ") + preset.name;
  }
  throw Error(Fault::kUsage,
              fmt::format("There is no studio preset \"{}\". There are: {}.", name, known));
}

}  // namespace dyxel
