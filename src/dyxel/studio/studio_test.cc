#include "dyxel/studio/studio.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/capture/capture.h"
#include "dyxel/image/image_io.h"
#include "dyxel/mesh/rasterizer.h"
#include "dyxel/mesh/triangle_mesh.h"
#include "dyxel/studio/manifest.h"
#include "dyxel/studio/sensor.h"

namespace dyxel {
namespace {

namespace fs = std::filesystem;

// A preset as small as sense allows, with everything in it; sliding cloth, too.
StudioPreset Smallest() {
  StudioPreset preset = FindStudioPreset("tiny");
  preset.picture_size = 96;
  preset.mesh_cell = 0.024F;
  preset.samples = 4;
  preset.bounce_rays = 8;
  preset.environment_height = 16;
  preset.slide_amplitude = 0.03;
  preset.rig = {preset.rig[0], preset.rig[7]};
  preset.sequences[0].frames = 2;
  preset.sequences[1].frames = 2;
  preset.sequences[1].pass_frames = {1};
  preset.sequences[1].slides = true;
  preset.sequences[2].frames = 2;
  preset.sequences[3].source_frames = {1};
  preset.sequences[4].source_frames = {1};
  return preset;
}

class Studio : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / fs::path("studio_test");
    fs::remove_all(folder_);
  }
  void TearDown() override {
    SetJobs(0);
    fs::remove_all(folder_);
  }
  fs::path folder_;
};

TEST_F(Studio, WritesACaptureThatReadsBackWithItsTruth) {
  double last = 0;
  WriteStudioCapture(folder_, Smallest(), [&](double share) { last = std::max(last, share); });
  EXPECT_EQ(last, 1);
  const Capture capture = LoadCapture(folder_);
  ASSERT_EQ(capture.cameras.size(), 2U);
  ASSERT_EQ(capture.sequences.size(), 5U);
  for (const Sequence& sequence : capture.sequences) {
    for (int frame = 0; frame < sequence.count; ++frame) {
      EXPECT_EQ(ReadFrame(capture, sequence, 0, frame).image.width, 96);
      EXPECT_TRUE(
          fs::exists(folder_ / "truth/meshes" / sequence.name / fmt::format("{:04}.ply", frame)));
    }
    EXPECT_EQ(ReadPlates(capture, sequence, 1).size(), 2U);
    EXPECT_TRUE(fs::exists(folder_ / "truth/joints" / (sequence.name + ".json")));
  }

  // The mesh, projected by the pipeline's camera, agrees with mask and depth.
  const fs::path truth = folder_ / "truth";
  const TriangleMesh mesh = ReadPly(truth / "meshes/dss/0001.ply");
  const ImageU8 mask = ReadPngMask(truth / "masks/dss/cam0/0001.png");
  const ImageF depth = ReadExr(truth / "passes/dss/cam0/0001.depth.exr").image;
  std::vector<ScreenVertex> screen;
  for (const Vec3f& p : mesh.positions) {
    const Vec2d pixel = capture.cameras[0].Project(p.cast<double>());
    screen.push_back({static_cast<float>(pixel.x()),
                      static_cast<float>(pixel.y()),
                      static_cast<float>(1 / capture.cameras[0].Depth(p.cast<double>()))});
  }
  const VisibilityBuffer seen = Rasterize(screen, mesh.triangles, 96, 96);
  int both = 0;
  int either = 0;
  for (std::size_t i = 0; i < mask.data.size(); ++i) {
    const bool covered = seen.triangle[i] >= 0;
    both += covered && mask.data[i] != 0 ? 1 : 0;
    either += covered || mask.data[i] != 0 ? 1 : 0;
    if (covered && mask.data[i] != 0) {
      EXPECT_NEAR(depth.data[i], 1 / seen.inverse_depth[i], 2e-3F);
    }
  }
  EXPECT_GT(both, 300);
  EXPECT_GT(static_cast<double>(both) / either, 0.94);

  // val_a shows res_b's time step, and what slides is on record.
  EXPECT_EQ(ReadFile(truth / "meshes/val_a/0000.ply"), ReadFile(truth / "meshes/res_b/0001.ply"));
  EXPECT_EQ(ReadFile(truth / "meshes/env/0000.ply"), ReadFile(truth / "meshes/dss/0001.ply"));
  EXPECT_THAT(ReadFile(truth / "shift/dss/0001.ply"), testing::HasSubstr("property float sz"));
}

TEST_F(Studio, LampsOfEveryTypeReadBack) {
  StudioPreset preset = Smallest();
  ASSERT_GE(preset.lights.size(), 3U);
  preset.lights[1].type = LightType::kPoint;
  preset.lights[2].type = LightType::kDirectional;
  preset.lights[2].irradiance = Rgb(3, 2.5F, 1);
  studio::WriteManifest(folder_, preset, studio::MakeCameras(preset));
  const Capture capture = LoadCapture(folder_);
  ASSERT_EQ(capture.lights.size(), preset.lights.size());
  const Vec3f x(0.1F, 0.2F, 1.1F);
  for (std::size_t i = 0; i < capture.lights.size(); ++i) {
    EXPECT_EQ(capture.lights[i].type, preset.lights[i].type);
    const Illumination read = Illuminate(capture.lights[i], x);
    const Illumination meant = Illuminate(preset.lights[i], x);
    EXPECT_TRUE(read.irradiance.isApprox(meant.irradiance, 1e-5F));
    EXPECT_TRUE(read.to_light.isApprox(meant.to_light, 1e-5F));
  }
}

TEST_F(Studio, GivesTheSameBytesForAnyNumberOfThreads) {
  StudioPreset preset = Smallest();
  preset.sensor.files = StudioFiles::kPng12;
  SetJobs(1);
  WriteStudioCapture(folder_ / "one", preset);
  SetJobs(3);
  WriteStudioCapture(folder_ / "three", preset);
  int files = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "one")) {
    if (!entry.is_regular_file()) continue;
    const fs::path other = folder_ / "three" / fs::relative(entry.path(), folder_ / "one");
    EXPECT_EQ(ReadFile(entry.path()), ReadFile(other)) << other;
    ++files;
  }
  EXPECT_GT(files, 50);
}

TEST_F(Studio, NamesThePresetsThatExist) {
  try {
    WriteStudioCapture(folder_, "huge");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::kUsage);
    EXPECT_THAT(error.what(), testing::HasSubstr("tiny"));
    EXPECT_THAT(error.what(), testing::HasSubstr("demo"));
  }
}

TEST(StudioSensor, NoiseHasTheVarianceOfShotAndRead) {
  const StudioSensor sensor{.full_well = 20000, .read_noise = 10};
  const ImageF exposed = studio::Expose(ImageF(200, 200, 3, 0.25F), sensor, 1);
  double sum = 0;
  double squares = 0;
  for (const float v : exposed.data) {
    sum += static_cast<double>(v);
    squares += static_cast<double>(v) * static_cast<double>(v);
  }
  const double n = static_cast<double>(exposed.data.size());
  const double mean = sum / n;
  EXPECT_NEAR(mean, 0.25, 1e-4);
  const double step = 1.0 / 4095;
  const double expected = (0.25 * 20000 + 100) / (20000.0 * 20000.0) + step * step / 12;
  EXPECT_NEAR((squares / n - mean * mean) / expected, 1, 0.02);
}

}  // namespace
}  // namespace dyxel
