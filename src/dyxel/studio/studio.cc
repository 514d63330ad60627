#include "dyxel/studio/studio.h"

#include <atomic>
#include <cmath>
#include <map>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/image/image_io.h"
#include "dyxel/mesh/triangle_mesh.h"
#include "dyxel/studio/manifest.h"
#include "dyxel/studio/noise.h"
#include "dyxel/studio/person.h"
#include "dyxel/studio/picture.h"
#include "dyxel/studio/sensor.h"

namespace dyxel {
namespace {

using namespace studio;  // NOLINT: this file is the studio's

std::uint64_t NoiseSeed(const StudioPreset& preset, int where, int camera, int frame) {
  const std::uint32_t h = HashBits(
      static_cast<std::uint32_t>(frame) +
      HashBits(static_cast<std::uint32_t>(camera) + HashBits(static_cast<std::uint32_t>(where))));
  return preset.seed * 0x9e3779b97f4a7c15ULL + h;
}

void WritePicture(const std::filesystem::path& path, const ImageF& picture, StudioFiles files) {
  if (files == StudioFiles::kHalfExr) {
    WriteExr(path, picture, {"R", "G", "B"}, ExrType::kHalf, ExrPacking::kBlock);
    return;
  }
  ImageU16 stored(picture.width, picture.height, 3);
  for (std::size_t i = 0; i < stored.data.size(); ++i) {
    stored.data[i] = static_cast<std::uint16_t>(std::lround(picture.data[i] * 4095.0F));
  }
  WritePng(path, stored);
}

// The vertices with sx, sy, sz (binary PLY).
void WriteShift(const std::filesystem::path& path, const PosedPerson& posed) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property float sx\nproperty float sy\nproperty float sz\nend_header\n",
      posed.positions.size());
  for (std::size_t v = 0; v < posed.positions.size(); ++v) {
    bytes.append(reinterpret_cast<const char*>(posed.positions[v].data()), sizeof(Vec3f));
    bytes.append(reinterpret_cast<const char*>(posed.shift[v].data()), sizeof(Vec3f));
  }
  WriteFile(path, bytes);
}

class StudioRun {
 public:
  StudioRun(std::filesystem::path folder, const StudioPreset& preset, const ProgressFn& progress)
      : folder_(std::move(folder)),
        preset_(preset),
        progress_(progress),
        cameras_(MakeCameras(preset)),
        steps_(MakeTimeSteps(preset)),
        environment_(MakeEnvironmentMap(preset.environment_height), preset.environment_rotation),
        person_(BuildPerson(preset.mesh_cell)) {}

  void Run() {
    WriteManifest(folder_, preset_, cameras_);
    WriteExr(folder_ / "env" / "room.exr", environment_.radiance(), {"R", "G", "B"});
    ShootPlates();
    std::vector<std::array<Vec3f, kNumJoints>> joints(steps_.size());
    ParallelFor(steps_.size(), [&](std::size_t i) { joints[i] = RecordStep(steps_[i]); });
    WriteJointTruth(folder_, preset_, steps_, joints);
  }

 private:
  [[nodiscard]] Lighting LightingOf(const StudioSequence& sequence) const {
    Lighting lighting;
    lighting.room = preset_.room;
    for (const std::string& name : sequence.lights) {
      bool found = false;
      for (const Light& light : preset_.lights) {
        if (light.name != name) continue;
        lighting.lamps.push_back(light);
        found = true;
      }
      Require(
          found, Fault::kUsage, "Studio preset \"{}\" has no light \"{}\".", preset_.name, name);
    }
    if (sequence.lights.empty()) lighting.environment = &environment_;
    lighting.ambient = AmbientLight(lighting);
    lighting.environment_samples = preset_.environment_samples;
    return lighting;
  }

  void ShootPlates() {
    for (const StudioSequence& sequence : preset_.sequences) {
      const std::string place = PlateFolder(sequence);
      if (plates_.contains(place)) continue;
      std::vector<Plate>& plates = plates_[place];
      plates.resize(cameras_.size());
      const Lighting lighting = LightingOf(sequence);
      const int where = 1000 + static_cast<int>(plates_.size());
      ParallelFor(cameras_.size(), [&](std::size_t c) {
        plates[c] = ShootPlate(cameras_[c], lighting, preset_.samples);
        const std::string extension = PictureExtension(preset_);
        for (int n = 0; n < preset_.sensor.plates; ++n) {
          const std::string name =
              preset_.sensor.plates > 1
                  ? fmt::format("{}/{}/{:04}{}", place, cameras_[c].name, n, extension)
                  : fmt::format("{}/{}{}", place, cameras_[c].name, extension);
          WritePicture(folder_ / name,
                       Expose(plates[c].radiance,
                              preset_.sensor,
                              NoiseSeed(preset_, where, static_cast<int>(c), n)),
                       preset_.sensor.files);
        }
      });
    }
  }

  // Shoots a time step with all cameras and writes what belongs to it; returns the joints.
  std::array<Vec3f, kNumJoints> RecordStep(const TimeStep& step) {
    const StudioSequence& sequence = preset_.sequences[static_cast<std::size_t>(step.sequence)];
    const PosedPerson posed = PosePerson(person_, step.posture, preset_.fold_strength, step.slide);
    const Tracer tracer(posed.positions, person_.rest.triangles);
    Subject subject{
        &tracer,
        posed.positions,
        posed.normals,
        person_.rest.triangles,
        [&](int triangle, const Vec3f& bary) { return MaterialOf(posed, triangle, bary); }};
    const Lighting lighting = LightingOf(sequence);
    const std::vector<Rgb> bounce =
        GatherBounce(subject,
                     lighting,
                     preset_.bounce_rays,
                     NoiseSeed(preset_, 2000 + step.sequence, 0, step.frame));
    subject.bounce = bounce;
    const std::vector<Plate>& plates = plates_.at(PlateFolder(sequence));
    const std::string frame = fmt::format("{:04}", step.frame);
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      const std::uint64_t seed = NoiseSeed(preset_, step.sequence, static_cast<int>(c), step.frame);
      const PictureOptions options{.samples = preset_.samples, .passes = step.passes, .seed = seed};
      const Shot shot = Shoot(subject, lighting, cameras_[c], plates[c], options);
      WriteShot(sequence.name, cameras_[c].name, frame, shot, seed + 1);
      Advance();
    }
    const std::filesystem::path truth = folder_ / "truth";
    WritePly(truth / "meshes" / sequence.name / (frame + ".ply"),
             {posed.positions, person_.rest.triangles});
    if (sequence.kind == SequenceKind::kDynamic) {
      WriteShift(truth / "shift" / sequence.name / (frame + ".ply"), posed);
    }
    return posed.joints;
  }

  [[nodiscard]] StudioMaterial MaterialOf(const PosedPerson& posed,
                                          int triangle,
                                          const Vec3f& bary) const {
    const Triangle& t = person_.rest.triangles[static_cast<std::size_t>(triangle)];
    Vec3f at = Vec3f::Zero();
    CoverDistances covers{};
    for (int k = 0; k < 3; ++k) {
      const auto v = static_cast<std::size_t>(t[static_cast<std::size_t>(k)]);
      at += bary[k] * posed.pattern[v];
      for (std::size_t n = 0; n < kNumCovers; ++n) covers[n] += bary[k] * person_.covers[v][n];
    }
    return MaterialAt(preset_.wardrobe, at, covers);
  }

  void WriteShot(const std::string& sequence,
                 const std::string& camera,
                 const std::string& frame,
                 const Shot& shot,
                 std::uint64_t seed) const {
    WritePicture(folder_ / sequence / camera / (frame + PictureExtension(preset_)),
                 Expose(shot.radiance, preset_.sensor, seed),
                 preset_.sensor.files);
    const std::filesystem::path truth = folder_ / "truth";
    WritePng(truth / "masks" / sequence / camera / (frame + ".png"), shot.mask);
    if (shot.normal.empty()) return;
    const std::filesystem::path passes = truth / "passes" / sequence / camera;
    WriteExr(passes / (frame + ".normal.exr"), shot.normal, {"X", "Y", "Z"});
    WriteExr(passes / (frame + ".albedo.exr"), shot.albedo, {"R", "G", "B"});
    WriteExr(passes / (frame + ".depth.exr"), shot.depth, {"V"}, ExrType::kFloat);
  }

  void Advance() {
    if (!progress_) return;
    const auto all = static_cast<double>(steps_.size() * cameras_.size());
    progress_(static_cast<double>(++shots_) / all);
  }

  std::filesystem::path folder_;
  const StudioPreset& preset_;
  const ProgressFn& progress_;
  std::vector<Camera> cameras_;
  std::vector<TimeStep> steps_;
  StudioEnvironment environment_;
  PersonMesh person_;
  std::map<std::string, std::vector<Plate>> plates_;
  std::atomic<std::size_t> shots_ = 0;
};

}  // namespace

void WriteStudioCapture(const std::filesystem::path& folder,
                        const StudioPreset& preset,
                        const ProgressFn& progress) {
  StudioRun(folder, preset, progress).Run();
}

void WriteStudioCapture(const std::filesystem::path& folder,
                        const std::string& preset,
                        const ProgressFn& progress) {
  WriteStudioCapture(folder, FindStudioPreset(preset), progress);
}

}  // namespace dyxel
