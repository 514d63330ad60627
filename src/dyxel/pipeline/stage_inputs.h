// What several stages of the table need to name their inputs and to read them.
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "dyxel/capture/capture.h"
#include "dyxel/pipeline/stages.h"
#include "dyxel/reflectance/dyxels.h"
#include "dyxel/video/relightable_video.h"

namespace dyxel {

// The plates of a sequence, each camera's read once.
class PlateCache {
 public:
  PlateCache(const Capture& capture, const Sequence& sequence)
      : capture_(capture), sequence_(sequence) {}
  [[nodiscard]] const std::vector<ImageF>& Get(int camera);

 private:
  const Capture& capture_;
  const Sequence& sequence_;
  std::mutex mutex_;
  std::map<int, std::vector<ImageF>> plates_;
};

// Whether a sequence says what light falls on it.
[[nodiscard]] bool IsLit(const Sequence& sequence);
// Whether lamps fall on it, so that reflectance and normals can be fitted to it.
[[nodiscard]] bool HasLamps(const Sequence& sequence);

// Options of a sequence's silhouettes. Light from all around leaves no shadow darker than half.
[[nodiscard]] SilhouetteOptions SilhouetteOptionsOf(const Project& project,
                                                    const Sequence& sequence);

[[nodiscard]] std::vector<Camera> EstimationCamerasOf(const Capture& capture);
[[nodiscard]] std::vector<std::string> EstimationCameraNames(const Capture& capture);

// The pictures of the estimation cameras in a frame, cropped around `positions` (world); empty
// where a camera has no picture of that frame, or the person is out of it. In parallel.
[[nodiscard]] std::vector<Picture> ReadCrops(const Capture& capture,
                                             const Sequence& sequence,
                                             int frame,
                                             std::span<const Vec3f> positions);

// Bounding box of projected positions, 8 pixels wider, clipped to the picture; empty (width 0)
// where nothing projects into it.
[[nodiscard]] Rect CropAround(const Camera& camera, std::span<const Vec3f> positions);

// The files that frame's surface comes from.
[[nodiscard]] std::vector<std::filesystem::path> SurfaceFiles(const Job& job,
                                                              const Sequence& sequence,
                                                              int frame);
// Texture and surface files of frames [begin, end).
[[nodiscard]] std::vector<std::filesystem::path> TextureInputs(const Job& job,
                                                               const Sequence& sequence,
                                                               int begin,
                                                               int end);
// Normal keys of a DSS that the stage `normals` writes (none for a sequence without lamps).
[[nodiscard]] std::vector<std::filesystem::path> NormalFiles(const Job& job,
                                                             const Sequence& sequence);

[[nodiscard]] std::vector<NormalKey> ReadNormalKeys(const Job& job, const Sequence& sequence);

// The samples of all frames of `sequences`, or of frames [begin, end) of one, from the textures.
[[nodiscard]] DyxelSource SourceOf(const Job& job, const std::vector<std::string>& sequences);
[[nodiscard]] DyxelSource SourceOf(const Job& job, const std::string& sequence, int begin, int end);

// The relightable video of a DSS, from the project's files; of any other sequence with the normals
// of the reflectance's second pass throughout.
[[nodiscard]] RelightableVideo AssembleVideo(const Job& job, const std::string& sequence);

}  // namespace dyxel
