#include "dyxel/app/clip.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/error.h"
#include "dyxel/image/exr.h"
#include "dyxel/image/image_io.h"
#include "dyxel/image/video.h"
#include "dyxel/render/tone_map.h"

namespace dyxel {
namespace {

// 1 / the 99.5th percentile of the person's channels.
double DisplayScaleOf(const ImageF& picture) {
  std::vector<float> values;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      if (picture.At(x, y, 3) < 0.5F) continue;
      for (int c = 0; c < 3; ++c) values.push_back(picture.At(x, y, c));
    }
  }
  if (values.empty()) return 1;
  const auto rank = static_cast<std::ptrdiff_t>(0.995 * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  const float top = values[static_cast<std::size_t>(rank)];
  return top > 0 ? 1.0 / static_cast<double>(top) : 1.0;
}

// Passes that are no radiance are shown as they are.
double ScaleOf(const ImageF& picture, Pass pass, double exposure) {
  if (pass != Pass::kBeauty)
    return exposure > 0 ? exposure : (pass == Pass::kDepth ? DisplayScaleOf(picture) : 1);
  return exposure > 0 ? exposure : DisplayScaleOf(picture);
}

ImageU8 ForTheEye(const ImageF& picture,
                  Pass pass,
                  double scale,
                  const std::optional<Rgb>& background) {
  if (pass == Pass::kNormal) return NormalsToDisplay(picture);
  if (pass == Pass::kMaterial) return MaterialsToDisplay(picture);
  return ToDisplay(picture, static_cast<float>(scale), background);
}

}  // namespace

Orbit FitClipOrbit(const RelightableVideo& video, int first, int last, int width, int height) {
  std::vector<Vec3f> positions;
  for (int frame = first; frame <= last; ++frame) {
    const std::vector<Vec3f> skin = SkinPositionsAt(video, frame);
    positions.insert(positions.end(), skin.begin(), skin.end());
  }
  return FitOrbit(positions, video.up, width, height);
}

ImageF RenderShot(const RelightableVideo& video,
                  const Shot& shot,
                  Pass pass,
                  const RenderOptions& options) {
  const PosedSurface surface = SurfaceAt(video, shot.frame);
  const ImageF normal_map = NormalMapAt(video, shot.frame);
  return Render({&video.atlas, &surface, &video.maps, &normal_map},
                shot.camera,
                shot.lighting,
                pass,
                options);
}

void WritePicture(const std::filesystem::path& file,
                  const ImageF& picture,
                  Pass pass,
                  double exposure) {
  const std::string extension = file.extension().string();
  if (extension == ".exr") {
    WriteExr(file, picture, {"R", "G", "B", "A"}, ExrType::kFloat);
  } else if (extension == ".png") {
    WritePng(file, ForTheEye(picture, pass, ScaleOf(picture, pass, exposure), std::nullopt));
  } else {
    throw Error(
        Fault::kUsage,
        fmt::format("{}: pictures are written as .exr or .png, clips as .mp4.", file.string()));
  }
}

void WriteClip(const std::filesystem::path& file,
               const RelightableVideo& video,
               int count,
               double fps,
               const std::function<Shot(int)>& shot,
               Pass pass,
               double exposure,
               const RenderOptions& options,
               const ProgressFn& progress) {
  const Shot first = shot(0);
  VideoWriter writer(file, first.camera.width, first.camera.height, fps);
  double scale = exposure;
  for (int i = 0; i < count; ++i) {
    const ImageF picture = RenderShot(video, shot(i), pass, options);
    if (i == 0) scale = ScaleOf(picture, pass, exposure);
    writer.Add(ForTheEye(picture, pass, scale, Rgb::Constant(static_cast<float>(0.03 / scale))));
    if (progress) progress(static_cast<double>(i + 1) / count);
  }
  writer.Finish();
}

}  // namespace dyxel
