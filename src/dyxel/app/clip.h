// Pictures and clips of a relightable video: what `render` writes and `demo` shows.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "dyxel/base/progress.h"
#include "dyxel/render/orbit.h"
#include "dyxel/render/renderer.h"
#include "dyxel/video/relightable_video.h"

namespace dyxel {

// One moment of a clip: which frame of the video, seen from where, under what.
struct Shot {
  double frame = 0;
  Camera camera;
  Lighting lighting;
};

// The orbit that shows the person whole in all frames first .. last.
[[nodiscard]] Orbit FitClipOrbit(
    const RelightableVideo& video, int first, int last, int width, int height);

// Renders one moment. [h][w][4] as Render gives it.
[[nodiscard]] ImageF RenderShot(const RelightableVideo& video,
                                const Shot& shot,
                                Pass pass,
                                const RenderOptions& options);

// Writes a picture by its extension: .exr linear with alpha, .png for the eye (display scale
// `exposure`; 0: 1 / the 99.5th percentile over the person) with straight alpha. Throws
// Error(kUsage) for another extension.
void WritePicture(const std::filesystem::path& file,
                  const ImageF& picture,
                  Pass pass,
                  double exposure);

// Writes `count` moments as an MP4 over a dark grey; the display scale is that of the first unless
// `exposure` is given.
void WriteClip(const std::filesystem::path& file,
               const RelightableVideo& video,
               int count,
               double fps,
               const std::function<Shot(int)>& shot,
               Pass pass,
               double exposure,
               const RenderOptions& options,
               const ProgressFn& progress);

}  // namespace dyxel
