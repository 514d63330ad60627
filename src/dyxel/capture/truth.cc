#include "dyxel/capture/truth.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <nlohmann/json.hpp>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/capture/check.h"
#include "dyxel/image/image_io.h"
#include "dyxel/image/sampling.h"

namespace dyxel {
namespace {

constexpr float kFar = 1e6F;  // renderers write a huge depth where there is nothing

bool IsFile(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path, error);
}

std::filesystem::path IfThere(std::filesystem::path path) {
  return IsFile(path) ? path : std::filesystem::path();
}

std::string Number(const Sequence& sequence, int frame) {
  return fmt::format("{:04}", sequence.first + frame);
}

void RequireSize(const Capture& capture,
                 const Camera& camera,
                 const std::filesystem::path& path,
                 int width,
                 int height) {
  if (std::lround(width * capture.scale) == camera.width &&
      std::lround(height * capture.scale) == camera.height) {
    return;
  }
  throw FileError(
      path,
      fmt::format(
          "is {}x{} pixels, which is not the size of camera {}", width, height, camera.name),
      "Check that the truth belongs to this capture");
}

}  // namespace

Truth OpenTruth(const std::filesystem::path& folder) {
  std::error_code error;
  for (const char* part : {"meshes", "joints", "masks", "passes", "shift"}) {
    if (std::filesystem::is_directory(folder / part, error)) return {folder};
  }
  throw FileError(folder,
                  "is no folder of truth: none of meshes, joints, masks, passes and shift is in it",
                  "Name the folder that has them");
}

std::filesystem::path Truth::MeshPath(const Sequence& sequence, int frame) const {
  return IfThere(folder / "meshes" / sequence.name / (Number(sequence, frame) + ".ply"));
}

std::vector<std::filesystem::path> Truth::MeshPaths(const Sequence& sequence) const {
  std::vector<std::filesystem::path> paths;
  std::vector<int> missing;
  for (int frame = 0; frame < sequence.count; ++frame) {
    std::filesystem::path path = MeshPath(sequence, frame);
    if (path.empty()) {
      missing.push_back(sequence.first + frame);
    } else {
      paths.push_back(std::move(path));
    }
  }
  if (!paths.empty() && !missing.empty()) {
    throw FileError(folder / "meshes" / sequence.name,
                    "has no mesh for the frames " + internal::Ranges(missing),
                    "Give one for every frame of the sequence");
  }
  return paths;
}

std::filesystem::path Truth::ShiftPath(const Sequence& sequence, int frame) const {
  return IfThere(folder / "shift" / sequence.name / (Number(sequence, frame) + ".ply"));
}

std::optional<TruthJoints> Truth::Joints(const Sequence& sequence) const {
  const std::filesystem::path path = folder / "joints" / (sequence.name + ".json");
  if (!IsFile(path)) return std::nullopt;
  TruthJoints joints;
  try {
    const auto json = nlohmann::json::parse(ReadFile(path));
    json.at("names").get_to(joints.names);
    json.at("parents").get_to(joints.parents);
    for (const auto& frame : json.at("positions")) {
      std::vector<Vec3d>& row = joints.positions.emplace_back();
      for (const auto& x : frame) {
        row.emplace_back(x.at(0).get<double>(), x.at(1).get<double>(), x.at(2).get<double>());
      }
    }
  } catch (const nlohmann::json::exception& e) {
    throw FileError(path,
                    fmt::format("is no file of joints ({})", e.what()),
                    "It must have names, parents and positions [frame][joint][xyz]");
  }
  const std::size_t count = joints.names.size();
  const auto bad_row = [&](const std::vector<Vec3d>& row) { return row.size() != count; };
  if (joints.parents.size() != count ||
      std::any_of(joints.positions.begin(), joints.positions.end(), bad_row)) {
    throw FileError(
        path,
        fmt::format(
            "has {} names, {} parents and frames of other sizes", count, joints.parents.size()),
        "All must have one entry a joint");
  }
  for (std::size_t j = 0; j < count; ++j) {
    if (joints.parents[j] < -1 || joints.parents[j] >= static_cast<int>(count)) {
      throw FileError(path,
                      fmt::format("joint {} has the parent {}", j, joints.parents[j]),
                      "Parents are indices of joints, or -1");
    }
  }
  return joints;
}

ImageU8 Truth::Mask(const Capture& capture, const Sequence& sequence, int camera, int frame) const {
  const Camera& cam = capture.cameras.at(static_cast<std::size_t>(camera));
  const std::filesystem::path path =
      folder / "masks" / sequence.name / cam.name / (Number(sequence, frame) + ".png");
  if (!IsFile(path)) return {};
  ImageU8 mask = ReadPngMask(path);
  RequireSize(capture, cam, path, mask.width, mask.height);
  if (capture.scale != 1) mask = ResizeArea(mask, cam.width, cam.height);
  for (std::uint8_t& value : mask.data) value = value >= 128 ? 255 : 0;
  return mask;
}

TruthPasses Truth::Passes(const Capture& capture,
                          const Sequence& sequence,
                          int camera,
                          int frame) const {
  const Camera& cam = capture.cameras.at(static_cast<std::size_t>(camera));
  const std::string stem =
      (folder / "passes" / sequence.name / cam.name / Number(sequence, frame)).string();
  // Shrunk, a pixel is the mean of the surface that it shows: values times cover over cover.
  const auto read = [&](const char* kind, auto&& covered, bool grey) {
    const std::filesystem::path path = stem + "." + kind + ".exr";
    if (!IsFile(path)) return ImageF();
    const ExrPicture picture = ReadExrRgb(path);
    RequireSize(capture, cam, path, picture.width, picture.height);
    ImageF weighted(picture.width, picture.height, 4);
    const std::size_t pixels = picture.image.data.size() / 3;
    for (std::size_t i = 0; i < pixels; ++i) {
      const float* v = &picture.image.data[3 * i];
      if (!covered(v)) continue;
      std::copy_n(v, 3, &weighted.data[4 * i]);
      weighted.data[4 * i + 3] = 1;
    }
    if (capture.scale != 1) weighted = ResizeArea(weighted, cam.width, cam.height);
    const std::size_t channels = grey ? 1 : 3;
    ImageF result(weighted.width, weighted.height, static_cast<int>(channels));
    for (std::size_t i = 0; i < weighted.data.size() / 4; ++i) {
      const float cover = weighted.data[4 * i + 3];
      if (cover < 0.5F) continue;
      for (std::size_t c = 0; c < channels; ++c) {
        result.data[channels * i + c] = weighted.data[4 * i + c] / cover;
      }
    }
    return result;
  };
  TruthPasses passes;
  passes.normal = read(
      "normal",
      [](const float* v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2] > 0.25F; },
      false);
  for (std::size_t i = 0; i + 2 < passes.normal.data.size(); i += 3) {
    Eigen::Map<Vec3f> normal(&passes.normal.data[i]);
    if (normal.squaredNorm() > 0) normal.normalize();
  }
  passes.albedo = read(
      "albedo", [](const float*) { return true; }, false);
  passes.depth = read(
      "depth", [](const float* v) { return v[0] > 0 && v[0] < kFar; }, true);
  return passes;
}

std::vector<int> Truth::PassFrames(const Capture& capture,
                                   const Sequence& sequence,
                                   int camera) const {
  const Camera& cam = capture.cameras.at(static_cast<std::size_t>(camera));
  std::set<int> frames;
  for (const char* kind : {"normal", "albedo", "depth"}) {
    const internal::FrameFiles files =
        internal::ListFrames(folder / "passes" / sequence.name / cam.name,
                             fmt::format("{{frame:04}}.{}.exr", kind),
                             cam.name,
                             sequence.first,
                             sequence.count);
    frames.insert(files.present.begin(), files.present.end());
  }
  return {frames.begin(), frames.end()};
}

}  // namespace dyxel
