// Video files, read and written through the programs ffmpeg and ffprobe.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "dyxel/image/image.h"
#include "dyxel/image/image_io.h"

namespace dyxel {

struct VideoInfo {
  int width = 0;  // as stored, before any rotation that the file asks for
  int height = 0;
  int frames = 0;
  double fps = 0;
};

// Asks ffprobe. Throws Error(kInput) where the file is missing or no video, Error(kStage) where the
// program isn't there; so do all below.
[[nodiscard]] VideoInfo ReadVideoInfo(const std::filesystem::path& path);

// Frame `frame` (0 is the first) as 16-bit codes: white_level is 65535 whatever the file's depth.
// `window(width, height)` picks the part. Frames are decoded in order by one ffmpeg a file, which
// stays open: going on is cheap, and so is a step of a few frames back; any other order starts the
// file again. May be called from several threads.
[[nodiscard]] StoredPicture ReadVideoFrame(
    const std::filesystem::path& path,
    int frame,
    const std::function<Rect(int width, int height)>& window);

// Closes all files that ReadVideoFrame keeps open.
void CloseVideos();

// Writes an MP4 (H.264) that every player shows; odd sizes are padded to even ones. Atomic: without
// Finish() no file is left.
class VideoWriter {
 public:
  VideoWriter(const std::filesystem::path& path, int width, int height, double fps);
  ~VideoWriter();
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;

  // [height][width][3], sRGB. Throws Error(kStage) where ffmpeg has given up, with what it said.
  void Add(const ImageU8& frame);
  void Finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace dyxel
