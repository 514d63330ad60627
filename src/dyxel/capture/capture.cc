#include "dyxel/capture/capture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/ranges.h>

#include "dyxel/base/error.h"
#include "dyxel/capture/manifest.h"
#include "dyxel/image/image_io.h"
#include "dyxel/image/sampling.h"
#include "dyxel/image/video.h"

namespace dyxel {
namespace {

template <class T>
std::string Names(const std::vector<T>& things) {
  std::vector<std::string> names;
  for (const T& thing : things) names.push_back(thing.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

const Camera& CameraOf(const Capture& capture, int camera) {
  return capture.cameras.at(static_cast<std::size_t>(camera));
}

constexpr float kClippedFrom = 0.99F;  // of the level where a sensor ends

// The radiance, before the colour matrix, from which a channel is clipped.
float ClippingLevel(const Sequence& sequence, const StoredPicture& stored) {
  if (stored.is_float) return std::numeric_limits<float>::infinity();
  const double full = IsVideo(sequence) && sequence.white_level <= 255 ? 255 : stored.white_level;
  // 16 bits may hold fewer: then the white level is where the sensor ends.
  if (full > 255 || sequence.white_level <= 0) return kClippedFrom;
  const auto level = static_cast<float>(full / sequence.white_level);
  return kClippedFrom * (sequence.srgb ? LinearFromSrgb(level) : level);
}

// Stored values to linear radiance of the reference colours, in place.
void Linearise(const Camera& camera,
               const Sequence& sequence,
               Clipped clipped,
               StoredPicture& stored) {
  ImageF& image = stored.image;
  double white = stored.white_level;
  if (!stored.is_float && sequence.white_level > 0) {
    white = sequence.white_level;
    // Videos come as 16 bits whatever they hold; a white level of 8 bits is meant as such.
    if (IsVideo(sequence) && white <= 255) white *= 257;
  }
  const auto scale = static_cast<float>(1 / white);
  if (sequence.srgb) {
    if (stored.is_float) {
      for (float& value : image.data) value = LinearFromSrgb(value);
    } else {
      // Integers: a table of all values is cheaper than as many powers.
      std::vector<float> table(65536);
      for (std::size_t i = 0; i < table.size(); ++i) {
        table[i] = LinearFromSrgb(static_cast<float>(i) * scale);
      }
      for (float& value : image.data) value = table[static_cast<std::size_t>(value)];
    }
  } else if (scale != 1) {
    for (float& value : image.data) value *= scale;
  }
  if (clipped == Clipped::kNoValue && !stored.is_float) {
    const float level = ClippingLevel(sequence, stored);
    for (std::size_t i = 0; i + 2 < image.data.size(); i += 3) {
      float* c = &image.data[i];
      if (std::max({c[0], c[1], c[2]}) < level) continue;
      std::fill_n(c, 3, std::numeric_limits<float>::quiet_NaN());
    }
  }
  if (camera.color_matrix != Mat3d::Identity()) {
    const Mat3f matrix = camera.color_matrix.cast<float>();
    for (std::size_t i = 0; i + 2 < image.data.size(); i += 3) {
      Eigen::Map<Vec3f> pixel(&image.data[i]);
      pixel = (matrix * pixel).eval();
    }
  }
}

// `window` of the camera's picture in the file `path`. `read(choose)` reads a part of the full-size
// picture, which choose(width, height) picks.
template <class Read>
Picture ReadScaled(const Capture& capture,
                   const Sequence& sequence,
                   const Camera& camera,
                   const std::filesystem::path& path,
                   const std::optional<Rect>& window,
                   Clipped clipped,
                   Read&& read) {
  const Rect all{0, 0, camera.width, camera.height};
  Picture picture;
  picture.window = window ? Intersect(*window, all) : all;
  if (picture.window.width == 0 || picture.window.height == 0) {
    picture.image.channels = 3;
    return picture;
  }
  StoredPicture stored = read([&](int width, int height) {
    if (std::lround(width * capture.scale) != camera.width ||
        std::lround(height * capture.scale) != camera.height) {
      throw FileError(path,
                      fmt::format("is {}x{} pixels, the camera {} {}x{}",
                                  width,
                                  height,
                                  camera.name,
                                  std::lround(camera.width / capture.scale),
                                  std::lround(camera.height / capture.scale)),
                      "Mend the size in capture.json, or the picture");
    }
    if (capture.scale == 1) return picture.window;
    return SourceWindow(picture.window, camera.width, camera.height, width, height);
  });
  Linearise(camera, sequence, clipped, stored);
  if (capture.scale == 1) {
    picture.image = std::move(stored.image);
  } else {
    picture.image = ResizeAreaWindow(
        stored.image, picture.window, camera.width, camera.height, stored.width, stored.height);
  }
  return picture;
}

std::filesystem::path FilePath(const Capture& capture,
                               const std::string& pattern,
                               const Camera& camera,
                               int number) {
  return capture.folder / ExpandPattern(pattern, camera.name, number);
}

}  // namespace

const Sequence& Capture::FindSequence(const std::string& sequence_name) const {
  const auto found = std::find_if(sequences.begin(), sequences.end(), [&](const Sequence& s) {
    return s.name == sequence_name;
  });
  Require(found != sequences.end(),
          Fault::kUsage,
          "There is no sequence \"{}\"; there are {}.",
          sequence_name,
          Names(sequences));
  return *found;
}

int Capture::FindCamera(const std::string& camera_name) const {
  const auto found = std::find_if(
      cameras.begin(), cameras.end(), [&](const Camera& c) { return c.name == camera_name; });
  Require(found != cameras.end(),
          Fault::kUsage,
          "There is no camera \"{}\"; there are {}.",
          camera_name,
          Names(cameras));
  return static_cast<int>(found - cameras.begin());
}

std::vector<Light> Capture::LightsOf(const Sequence& sequence, int frame) const {
  const std::vector<std::string>& wanted =
      sequence.frame_lights.empty() ? sequence.lights
                                    : sequence.frame_lights.at(static_cast<std::size_t>(frame));
  std::vector<Light> burning;
  for (const std::string& light_name : wanted) {
    const auto found = std::find_if(
        lights.begin(), lights.end(), [&](const Light& light) { return light.name == light_name; });
    Require(found != lights.end(),
            Fault::kUsage,
            "There is no light \"{}\"; there are {}.",
            light_name,
            Names(lights));
    burning.push_back(*found);
  }
  return burning;
}

std::vector<int> Capture::EstimationCameras() const {
  std::vector<int> indices;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (!cameras[i].holdout) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

Capture LoadCapture(const std::filesystem::path& folder, double scale) {
  Require(scale > 0 && scale <= 1,
          Fault::kUsage,
          "The scale is {}; it must be above 0 and at most 1.",
          scale);
  Manifest manifest = ReadManifest(folder);
  for (const CheckItem& item : manifest.items) {
    if (item.severity == Severity::kError) {
      throw FileError(manifest.capture.folder / item.file, item.what, item.mend);
    }
  }
  Capture& capture = manifest.capture;
  capture.scale = scale;
  if (scale != 1) {
    for (Camera& camera : capture.cameras) camera = camera.Scaled(scale);
  }
  return std::move(capture);
}

std::filesystem::path FramePath(const Capture& capture,
                                const Sequence& sequence,
                                int camera,
                                int frame) {
  return FilePath(capture, sequence.images, CameraOf(capture, camera), sequence.first + frame);
}

std::vector<std::filesystem::path> FrameFiles(const Capture& capture,
                                              const Sequence& sequence,
                                              int camera,
                                              int frame) {
  const Camera& cam = CameraOf(capture, camera);
  std::vector<std::filesystem::path> files = {FramePath(capture, sequence, camera, frame)};
  if (!sequence.background.empty()) {
    for (int i = 0; i < std::max(1, sequence.background_count); ++i) {
      files.push_back(FilePath(capture, sequence.background, cam, i));
    }
  }
  if (!sequence.masks.empty()) {
    files.push_back(FilePath(capture, sequence.masks, cam, sequence.first + frame));
  }
  return files;
}

bool IsVideo(const Sequence& sequence) {
  return !HasFrameField(sequence.images) && !IsPictureName(sequence.images);
}

bool HasFrame(const Capture& capture, const Sequence& sequence, int camera, int frame) {
  if (IsVideo(sequence)) return true;
  std::error_code error;
  return std::filesystem::is_regular_file(FramePath(capture, sequence, camera, frame), error);
}

Picture ReadFrame(const Capture& capture,
                  const Sequence& sequence,
                  int camera,
                  int frame,
                  const std::optional<Rect>& window,
                  Clipped clipped) {
  const Camera& cam = CameraOf(capture, camera);
  const std::filesystem::path path = FramePath(capture, sequence, camera, frame);
  if (IsVideo(sequence)) {
    return ReadScaled(capture, sequence, cam, path, window, clipped, [&](const auto& choose) {
      return ReadVideoFrame(path, sequence.first + frame, choose);
    });
  }
  if (sequence.allow_missing && !HasFrame(capture, sequence, camera, frame)) return {};
  return ReadScaled(capture, sequence, cam, path, window, clipped, [&](const auto& choose) {
    return ReadPicture(path, choose);
  });
}

std::vector<ImageF> ReadPlates(const Capture& capture, const Sequence& sequence, int camera) {
  std::vector<ImageF> plates;
  if (sequence.background.empty()) return plates;
  const Camera& cam = CameraOf(capture, camera);
  for (int i = 0; i < std::max(1, sequence.background_count); ++i) {
    const std::filesystem::path path = FilePath(capture, sequence.background, cam, i);
    Picture plate = ReadScaled(
        capture, sequence, cam, path, std::nullopt, Clipped::kAsStored, [&](const auto& choose) {
          return ReadPicture(path, choose);
        });
    plates.push_back(std::move(plate.image));
  }
  return plates;
}

ImageU8 ReadGivenMask(const Capture& capture, const Sequence& sequence, int camera, int frame) {
  if (sequence.masks.empty()) return {};
  const Camera& cam = CameraOf(capture, camera);
  const std::filesystem::path path = FilePath(capture, sequence.masks, cam, sequence.first + frame);
  std::error_code error;
  if (sequence.allow_missing && !std::filesystem::is_regular_file(path, error) &&
      !HasFrame(capture, sequence, camera, frame)) {
    return {};
  }
  ImageU8 mask = ReadPngMask(path);
  if (std::lround(mask.width * capture.scale) != cam.width ||
      std::lround(mask.height * capture.scale) != cam.height) {
    throw FileError(path,
                    fmt::format("is {}x{} pixels, which is not the size of camera {}",
                                mask.width,
                                mask.height,
                                cam.name),
                    "Masks must have the size of the pictures");
  }
  if (capture.scale != 1) mask = ResizeArea(mask, cam.width, cam.height);
  for (std::uint8_t& value : mask.data) value = value >= 128 ? 255 : 0;
  return mask;
}

Environment LoadEnvironment(const Capture& capture, const EnvironmentRef& environment) {
  return LoadEnvironmentFile(capture.folder / environment.file, environment.rotation, capture.up);
}

Environment LoadEnvironmentFile(const std::filesystem::path& file,
                                double rotation,
                                const Vec3d& up) {
  StoredPicture picture = ReadPicture(file);
  if (!picture.is_float) {
    throw FileError(file, "holds integers, not radiance", "Use an EXR or Radiance .hdr file");
  }
  for (float& value : picture.image.data) {
    // Lossy packing leaves small negative values; NaN is no light either.
    value = value > 0 ? std::min(value, 65504.0F * 16) : 0.0F;
  }
  return {std::move(picture.image), rotation, up};
}

}  // namespace dyxel
