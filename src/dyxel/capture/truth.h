// The truth of a capture made by a program (capture-format.md, "Truth"): read by `evaluate --truth`
// and `--geometry` alone.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dyxel/capture/capture.h"

namespace dyxel {

// The truth's own skeleton over a sequence.
struct TruthJoints {
  std::vector<std::string> names;             // (J)
  std::vector<int> parents;                   // (J) -1 for a root
  std::vector<std::vector<Vec3d>> positions;  // [frames][J] world
};

// Passes of one picture at the capture's scale; an image is empty where there is no such file.
struct TruthPasses {
  ImageF normal;  // [h][w][3] unit, world; 0 where there is no surface
  ImageF albedo;  // [h][w][3] diffuse albedo
  ImageF depth;   // [h][w][1] z along the camera's axis, metres; 0 where there is no surface
};

// A folder of truth. Files carry the number of the picture that they belong to (first + frame). All
// readers throw Error(kInput) with the file where one is damaged, and give nothing (an empty image,
// path or list, or nullopt) where there is none.
struct Truth {
  std::filesystem::path folder;

  // The true surface of a frame, a PLY.
  [[nodiscard]] std::filesystem::path MeshPath(const Sequence&, int frame) const;
  // Those of all frames, [count]; empty where there are none. Throws Error(kInput) naming the
  // frames where only some are there.
  [[nodiscard]] std::vector<std::filesystem::path> MeshPaths(const Sequence&) const;
  // The mesh with the vertex properties sx, sy, sz.
  [[nodiscard]] std::filesystem::path ShiftPath(const Sequence&, int frame) const;
  [[nodiscard]] std::optional<TruthJoints> Joints(const Sequence&) const;
  // 255 inside, [h][w][1].
  [[nodiscard]] ImageU8 Mask(const Capture&, const Sequence&, int camera, int frame) const;
  [[nodiscard]] TruthPasses Passes(const Capture&, const Sequence&, int camera, int frame) const;
  // The frames of which that camera has a normal, albedo or depth pass, ascending.
  [[nodiscard]] std::vector<int> PassFrames(const Capture&, const Sequence&, int camera) const;
};

// Throws Error(kInput) where it is no folder or none of the truth's parts lies in it.
[[nodiscard]] Truth OpenTruth(const std::filesystem::path& folder);

}  // namespace dyxel
