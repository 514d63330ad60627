// A capture: the manifest in memory and its pictures on demand (capture-format.md).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dyxel/capture/camera.h"
#include "dyxel/capture/light.h"
#include "dyxel/image/image.h"

namespace dyxel {

enum class SequenceKind { kReflectance, kDynamic, kValidation };

struct EnvironmentRef {
  std::filesystem::path file;  // relative to the capture
  double rotation = 0;         // radians
};

struct Sequence {
  std::string name;
  SequenceKind kind = SequenceKind::kDynamic;
  int first = 0;                    // number of the first frame file
  int count = 0;                    // frames; everywhere else a frame is an index in [0, count)
  std::vector<std::string> lights;  // names; empty: none, or an environment
  std::vector<std::vector<std::string>> frame_lights;  // [count] or empty
  std::optional<EnvironmentRef> environment;
  std::string images;        // pattern
  std::string background;    // pattern, "" for none
  int background_count = 0;  // plates a camera; 0 where the pattern has no {frame}: one plate
  std::string masks;         // pattern, "" for none
  bool srgb = false;         // transfer
  double white_level = 0;    // 0: the file type's
  bool allow_missing = false;
};

struct Capture {
  std::filesystem::path folder;
  std::string name;
  double fps = 25;
  Vec3d up = Vec3d::UnitZ();
  std::vector<Camera> cameras;
  std::vector<Light> lights;
  std::vector<Sequence> sequences;
  // --scale: pictures are shrunk by area averaging on reading; `cameras` are already scaled.
  double scale = 1;

  // Throw Error(kUsage) naming what is there.
  [[nodiscard]] const Sequence& FindSequence(const std::string& name) const;
  [[nodiscard]] int FindCamera(const std::string& name) const;
  // The lights that burn in a frame; empty for an environment.
  [[nodiscard]] std::vector<Light> LightsOf(const Sequence& sequence, int frame) const;
  // Indices of cameras that may be used for estimation.
  [[nodiscard]] std::vector<int> EstimationCameras() const;
};

// Reads and validates FOLDER/capture.json (FOLDER may also be the manifest itself). Throws
// Error(kInput) with the first thing wrong; `CheckCapture` lists all.
[[nodiscard]] Capture LoadCapture(const std::filesystem::path& folder, double scale = 1);

// The file of a frame: a picture, or the camera's video.
[[nodiscard]] std::filesystem::path FramePath(const Capture&,
                                              const Sequence&,
                                              int camera,
                                              int frame);
// All files that a camera's frame is seen in: its picture (or video), its plates, its given mask.
[[nodiscard]] std::vector<std::filesystem::path> FrameFiles(const Capture&,
                                                            const Sequence&,
                                                            int camera,
                                                            int frame);
// True where `images` names a video a camera.
[[nodiscard]] bool IsVideo(const Sequence&);

// True where the file of that frame is there (always so for videos).
[[nodiscard]] bool HasFrame(const Capture&, const Sequence&, int camera, int frame);

// What a pixel of which a channel is clipped becomes: what the file holds, or NaN. Integers are
// clipped from 0.99 times their white level on (of 8 bits with a smaller one: of 255), before the
// colour matrix and before --scale; floats never are.
enum class Clipped { kAsStored, kNoValue };

// One picture: linear radiance after white level, transfer and colour matrix; [h][w][3]. With
// `window`, only that part of the picture (in pixels of the scaled camera) is decoded where the
// format allows; the window is clipped to the picture. A missing frame that the sequence allows
// gives an empty picture. Throws Error(kInput) with the file.
[[nodiscard]] Picture ReadFrame(const Capture&,
                                const Sequence&,
                                int camera,
                                int frame,
                                const std::optional<Rect>& window = std::nullopt,
                                Clipped clipped = Clipped::kAsStored);

// Plates of a camera, all of them (at least one; several are numbered from 0), as ReadFrame gives
// pictures; empty without any.
[[nodiscard]] std::vector<ImageF> ReadPlates(const Capture&, const Sequence&, int camera);

// The given mask, 255 inside, or an empty image where the sequence has none.
[[nodiscard]] ImageU8 ReadGivenMask(const Capture&, const Sequence&, int camera, int frame);

[[nodiscard]] Environment LoadEnvironment(const Capture&, const EnvironmentRef&);
// A latitude-longitude EXR or Radiance .hdr file.
[[nodiscard]] Environment LoadEnvironmentFile(const std::filesystem::path& file,
                                              double rotation,
                                              const Vec3d& up);

}  // namespace dyxel
