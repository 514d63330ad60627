// A video rendered from its file looks as it does from memory (asset-format.md).
#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "dyxel/image/sampling.h"
#include "dyxel/render/orbit.h"
#include "dyxel/render/renderer.h"
#include "dyxel/render/tone_map.h"
#include "dyxel/video/gltf_read.h"
#include "dyxel/video/gltf_write.h"
#include "dyxel/video/video_scene.h"

namespace dyxel {
namespace {

ImageF RenderFrame(const RelightableVideo& video, double frame) {
  const PosedSurface surface = SurfaceAt(video, frame);
  const ImageF normals = NormalMapAt(video, frame);
  const RenderSurface shown{&video.atlas, &surface, &video.maps, &normals};
  Light lamp;
  lamp.type = LightType::kPoint;
  lamp.position = {2, 1, 2.5};
  lamp.intensity = Rgb::Constant(20);
  Light back = lamp;
  back.position = {-2, -2, 1};
  Orbit orbit = FitOrbit(surface.positions, Vec3d::UnitZ(), 300, 300);
  return Render(shown, OrbitCamera(orbit, 0.4), {{lamp, back}, {}});
}

// As measures.md: display scale 1 / 99.5th percentile, sRGB, over what is covered.
double Psnr(const ImageF& a, const ImageF& b) {
  std::vector<float> values;
  for (std::size_t i = 0; i < a.data.size(); i += 4) {
    if (a.data[i + 3] > 0) values.insert(values.end(), &a.data[i], &a.data[i + 3]);
  }
  std::sort(values.begin(), values.end());
  const float scale = 1 / values[values.size() * 995 / 1000];
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < a.data.size(); i += 4) {
    if (a.data[i + 3] == 0 && b.data[i + 3] == 0) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const double d = static_cast<double>(SrgbFromLinear(scale * a.data[i + c])) -
                       static_cast<double>(SrgbFromLinear(scale * b.data[i + c]));
      sum += d * d;
      ++count;
    }
  }
  return -10 * std::log10(sum / count);
}

TEST(VideoFileTest, RendersFromFileAsFromMemory) {
  const auto path = std::filesystem::path(testing::TempDir()) / "dyxel_video_file_test.glb";
  for (const bool skinned : {true, false}) {
    const RelightableVideo video =
        skinned ? test_scene::MakeEgg(40, 60, 256) : test_scene::MakeSurfaceEgg(40, 60, 256);
    WriteVideo(path, video);
    const RelightableVideo back = ReadVideo(path);
    for (const double frame : {0.0, 1.5, 4.0}) {
      const ImageF memory = RenderFrame(video, frame);
      EXPECT_GT(Psnr(memory, RenderFrame(back, frame)), 50) << skinned << " " << frame;
    }
    // What the measure sees when the maps differ.
    RelightableVideo other = back;
    other.normals.clear();
    EXPECT_LT(Psnr(RenderFrame(video, 3), RenderFrame(other, 3)), 40);
  }
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace dyxel
