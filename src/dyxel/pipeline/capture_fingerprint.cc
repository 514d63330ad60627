#include "dyxel/pipeline/capture_fingerprint.h"

#include <fmt/ranges.h>

#include "dyxel/base/hash.h"

namespace dyxel {
namespace {

template <class Derived>
std::string Numbers(const Eigen::DenseBase<Derived>& m) {
  std::string text;
  for (int i = 0; i < m.rows(); ++i) {
    for (int j = 0; j < m.cols(); ++j) text += fmt::format("{} ", m(i, j));
  }
  return text;
}

std::string Line(std::string_view name, const Hasher& hash) {
  return fmt::format("{}={}\n", name, hash.Digest());
}

void AddLight(Hasher& hash, const Light& light) {
  hash.Add(
          fmt::format("{} {} {}", static_cast<int>(light.type), light.cone_inner, light.cone_outer))
      .Add(Numbers(light.position))
      .Add(Numbers(light.direction))
      .Add(Numbers(light.intensity))
      .Add(Numbers(light.irradiance));
}

}  // namespace

std::string PictureFingerprint(const Capture& capture, const Sequence& sequence) {
  Hasher hash;
  hash.Add(fmt::format("{} {} {}", capture.scale, sequence.white_level, sequence.srgb));
  for (const int c : capture.EstimationCameras()) {
    const Camera& camera = capture.cameras[static_cast<std::size_t>(c)];
    hash.Add(camera.name)
        .Add(fmt::format("{} {}", camera.width, camera.height))
        .Add(Numbers(camera.color_matrix));
  }
  return Line("pictures", hash);
}

std::string RigFingerprint(const Capture& capture) {
  Hasher hash;
  hash.Add(Numbers(capture.up));
  for (const int c : capture.EstimationCameras()) {
    const Camera& camera = capture.cameras[static_cast<std::size_t>(c)];
    hash.Add(camera.name)
        .Add(fmt::format("{} {} {} {} {} {} {}",
                         camera.width,
                         camera.height,
                         camera.fx,
                         camera.fy,
                         camera.cx,
                         camera.cy,
                         fmt::join(camera.distortion, " ")))
        .Add(Numbers(camera.cam_from_world.rotation))
        .Add(Numbers(camera.cam_from_world.translation));
  }
  return Line("rig", hash);
}

std::string LightFingerprint(const Capture& capture, const Sequence& sequence, int begin, int end) {
  Hasher hash;
  for (int frame = begin; frame < end; ++frame) {
    hash.Add("frame");
    for (const Light& light : capture.LightsOf(sequence, frame)) AddLight(hash, light);
  }
  return Line("light", hash);
}

}  // namespace dyxel
