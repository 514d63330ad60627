#include "dyxel/studio/manifest.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/studio/optics.h"

namespace dyxel::studio {
namespace {

using Json = nlohmann::ordered_json;

template <class Vector>
Json List(const Vector& v) {
  Json list = Json::array();
  for (const auto& x : v) list.push_back(x);
  return list;
}

// A colour in as many digits as a float has.
Json ColorList(const Rgb& c) {
  Json list = Json::array();
  for (int k = 0; k < 3; ++k) list.push_back(std::round(static_cast<double>(c[k]) * 1e6) / 1e6);
  return list;
}

const char* KindName(SequenceKind kind) {
  switch (kind) {
    case SequenceKind::kReflectance:
      return "reflectance";
    case SequenceKind::kDynamic:
      return "dynamic";
    default:
      return "validation";
  }
}

int FrameCount(const StudioSequence& sequence) {
  return sequence.geometry_of.empty() ? sequence.frames
                                      : static_cast<int>(sequence.source_frames.size());
}

Json LightEntry(const Light& light) {
  if (light.type == LightType::kDirectional) {
    return {{"name", light.name},
            {"type", "directional"},
            {"direction", List(light.direction)},
            {"irradiance", ColorList(light.irradiance)}};
  }
  Json entry = {{"name", light.name},
                {"type", light.type == LightType::kSpot ? "spot" : "point"},
                {"position", List(light.position)}};
  if (light.type == LightType::kSpot) entry["direction"] = List(light.direction);
  entry["intensity"] = ColorList(light.intensity);
  if (light.type == LightType::kSpot) {
    entry["cone_inner"] = light.cone_inner;
    entry["cone_outer"] = light.cone_outer;
  }
  return entry;
}

}  // namespace

std::vector<Camera> MakeCameras(const StudioPreset& preset) {
  std::vector<Camera> cameras;
  for (std::size_t i = 0; i < preset.rig.size(); ++i) {
    const StudioCamera& c = preset.rig[i];
    const double azimuth = c.azimuth_deg * kPiD / 180;
    const Vec3d position(c.distance * std::cos(azimuth), c.distance * std::sin(azimuth), c.height);
    cameras.push_back(AimCamera(
        fmt::format("cam{}", i), position, {0, 0, c.target_height}, preset.picture_size, c.focal));
    cameras.back().holdout = c.holdout;
  }
  return cameras;
}

std::vector<TimeStep> MakeTimeSteps(const StudioPreset& preset) {
  std::vector<TimeStep> steps;
  for (std::size_t s = 0; s < preset.sequences.size(); ++s) {
    const StudioSequence& sequence = preset.sequences[s];
    for (int f = 0; f < FrameCount(sequence); ++f) {
      TimeStep step;
      if (sequence.geometry_of.empty()) {
        step.posture = PostureAt(sequence.motion,
                                 static_cast<double>(f) / sequence.frames,
                                 sequence.frames / preset.fps,
                                 sequence.variant);
        if (sequence.slides) {
          step.slide =
              static_cast<float>(preset.slide_amplitude *
                                 std::sin(2 * kPiD * (f + 1) / (preset.fps * preset.slide_period)));
        }
      } else {
        const int wanted = sequence.source_frames[static_cast<std::size_t>(f)];
        const auto source = std::find_if(steps.begin(), steps.end(), [&](const TimeStep& t) {
          return preset.sequences[static_cast<std::size_t>(t.sequence)].name ==
                     sequence.geometry_of &&
                 t.frame == wanted;
        });
        Require(source != steps.end(),
                Fault::kUsage,
                "Studio preset \"{}\": {} shows frame {} of {}, which does not come before it.",
                preset.name,
                sequence.name,
                wanted,
                sequence.geometry_of);
        step = *source;
      }
      step.sequence = static_cast<int>(s);
      step.frame = f;
      step.passes = std::count(sequence.pass_frames.begin(), sequence.pass_frames.end(), f) > 0;
      steps.push_back(step);
    }
  }
  return steps;
}

std::string PlateFolder(const StudioSequence& sequence) {
  std::string name;
  for (const std::string& light : sequence.lights) name += (name.empty() ? "" : "+") + light;
  return "background/" + (name.empty() ? "env" : name);
}

std::string PictureExtension(const StudioPreset& preset) {
  return preset.sensor.files == StudioFiles::kPng12 ? ".png" : ".exr";
}

void WriteManifest(const std::filesystem::path& folder,
                   const StudioPreset& preset,
                   const std::vector<Camera>& cameras) {
  Json root;
  root["format"] = "dyxel.capture";
  root["version"] = 1;
  root["name"] = "studio-" + preset.name;
  root["fps"] = preset.fps;
  root["up"] = {0, 0, 1};
  for (const Camera& c : cameras) {
    Json rotation = Json::array();
    for (int i = 0; i < 9; ++i) rotation.push_back(c.cam_from_world.rotation(i / 3, i % 3));
    root["cameras"].push_back({{"name", c.name},
                               {"width", c.width},
                               {"height", c.height},
                               {"fx", c.fx},
                               {"fy", c.fy},
                               {"cx", c.cx},
                               {"cy", c.cy},
                               {"rotation", rotation},
                               {"translation", List(c.cam_from_world.translation)},
                               {"holdout", c.holdout}});
  }
  for (const Light& light : preset.lights) {
    root["lights"].push_back(LightEntry(light));
  }
  const std::string extension = PictureExtension(preset);
  for (const StudioSequence& sequence : preset.sequences) {
    Json s;
    s["name"] = sequence.name;
    s["kind"] = KindName(sequence.kind);
    if (sequence.lights.empty()) {
      s["environment"] = {{"file", "env/room.exr"}, {"rotation", preset.environment_rotation}};
    } else {
      s["lights"] = sequence.lights;
    }
    s["first"] = 0;
    s["count"] = FrameCount(sequence);
    if (preset.sensor.files == StudioFiles::kPng12) s["white_level"] = 4095;
    s["images"] = sequence.name + "/{camera}/{frame:04}" + extension;
    const bool several = preset.sensor.plates > 1;
    s["background"] =
        PlateFolder(sequence) + (several ? "/{camera}/{frame:04}" : "/{camera}") + extension;
    if (several) s["background_count"] = preset.sensor.plates;
    root["sequences"].push_back(s);
  }
  WriteFile(folder / "capture.json", root.dump(1) + "\n");
}

void WriteJointTruth(const std::filesystem::path& folder,
                     const StudioPreset& preset,
                     const std::vector<TimeStep>& steps,
                     const std::vector<std::array<Vec3f, kNumJoints>>& joints) {
  Json frames = Json::object();
  for (std::size_t s = 0; s < preset.sequences.size(); ++s) {
    const StudioSequence& sequence = preset.sequences[s];
    Json root;
    for (const RestJoint& joint : RestSkeleton()) {
      root["names"].push_back(joint.name);
      root["parents"].push_back(joint.parent);
    }
    for (std::size_t i = 0; i < steps.size(); ++i) {
      if (steps[i].sequence != static_cast<int>(s)) continue;
      Json row = Json::array();
      for (const Vec3f& x : joints[i]) {
        Json point = Json::array();
        for (int k = 0; k < 3; ++k) {
          point.push_back(std::round(static_cast<double>(x[k]) * 1e5) / 1e5);
        }
        row.push_back(point);
      }
      root["positions"].push_back(row);
    }
    WriteFile(folder / "truth" / "joints" / (sequence.name + ".json"), root.dump() + "\n");
    if (!sequence.pass_frames.empty()) frames["passes"][sequence.name] = sequence.pass_frames;
    for (std::size_t f = 0; f < sequence.source_frames.size(); ++f) {
      frames[sequence.name].push_back(
          {{"frame", f}, {sequence.geometry_of, sequence.source_frames[f]}});
    }
  }
  WriteFile(folder / "truth" / "frames.json", frames.dump(1) + "\n");
}

}  // namespace dyxel::studio
