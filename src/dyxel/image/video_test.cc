#include "dyxel/image/video.h"

#include <cstdlib>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"

namespace dyxel {
namespace {

using ::testing::HasSubstr;

bool HaveFfmpeg() { return std::system("ffmpeg -version >/dev/null 2>&1") == 0; }

class Video : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::temp_directory_path() / ("dyxel_video_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override {
    CloseVideos();
    std::filesystem::remove_all(folder_);
  }
  // A video whose frame i is of the grey 20 + 10 i, with a bright left half.
  void Write(const std::filesystem::path& path, int frames) {
    VideoWriter writer(path, 63, 48, 25);
    for (int i = 0; i < frames; ++i) {
      ImageU8 frame(63, 48, 3, static_cast<std::uint8_t>(20 + 10 * i));
      for (int y = 0; y < 48; ++y) std::fill_n(&frame.At(0, y), 3 * 32, std::uint8_t{230});
      writer.Add(frame);
    }
    writer.Finish();
  }

  static constexpr auto kAll = [](int width, int height) { return Rect{0, 0, width, height}; };
  std::filesystem::path folder_;
};

TEST_F(Video, FramesComeBackInAnyOrder) {
  if (!HaveFfmpeg()) GTEST_SKIP() << "ffmpeg isn't installed";
  const std::filesystem::path path = folder_ / "a.mp4";
  Write(path, 20);
  const VideoInfo info = ReadVideoInfo(path);
  EXPECT_EQ(info.width, 64);  // padded
  EXPECT_EQ(info.height, 48);
  EXPECT_EQ(info.frames, 20);
  EXPECT_DOUBLE_EQ(info.fps, 25);
  for (const int frame : {0, 1, 2, 7, 5, 19, 3, 18}) {
    const StoredPicture picture = ReadVideoFrame(path, frame, kAll);
    EXPECT_EQ(picture.white_level, 65535);
    EXPECT_NEAR(picture.image.At(50, 20, 1) / 257, 20 + 10 * frame, 3) << frame;
    EXPECT_NEAR(picture.image.At(10, 20, 1) / 257, 230, 3);
  }
  const StoredPicture part = ReadVideoFrame(path, 4, [](int, int) { return Rect{40, 10, 5, 100}; });
  EXPECT_EQ(part.window, (Rect{40, 10, 5, 38}));
  EXPECT_NEAR(part.image.At(2, 3, 0) / 257, 60, 3);
  // Several threads at once.
  std::vector<float> greys(20);
  ParallelFor(20, [&](std::size_t i) {
    greys[i] = ReadVideoFrame(path, static_cast<int>(i), kAll).image.At(50, 20, 1) / 257;
  });
  for (std::size_t i = 0; i < 20; ++i)
    EXPECT_NEAR(greys[i], 20.0F + 10.0F * static_cast<float>(i), 3);
  // Beyond the end.
  try {
    (void)ReadVideoFrame(path, 20, kAll);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("a.mp4"));
    EXPECT_THAT(error.what(), HasSubstr("frame 20"));
  }
}

TEST_F(Video, WithoutFinishThereIsNoFile) {
  if (!HaveFfmpeg()) GTEST_SKIP() << "ffmpeg isn't installed";
  {
    VideoWriter writer(folder_ / "b.mp4", 16, 16, 25);
    writer.Add(ImageU8(16, 16, 3));
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(Video, ErrorsNameTheFile) {
  if (!HaveFfmpeg()) GTEST_SKIP() << "ffmpeg isn't installed";
  WriteFile(folder_ / "c.mp4", "no video");
  for (const char* name : {"c.mp4", "missing.mp4"}) {
    try {
      (void)ReadVideoFrame(folder_ / name, 0, kAll);
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::kInput);
      EXPECT_THAT(error.what(), HasSubstr(name));
    }
    EXPECT_THROW((void)ReadVideoInfo(folder_ / name), Error);
  }
}

TEST_F(Video, SaysWhatToInstall) {
  const char* before = std::getenv("PATH");
  const std::string path = before == nullptr ? "" : before;
  ::setenv("PATH", folder_.c_str(), 1);
  WriteFile(folder_ / "d.mp4", "anything");
  std::string message;
  try {
    (void)ReadVideoFrame(folder_ / "d.mp4", 0, kAll);
  } catch (const Error& error) {
    message = error.what();
  }
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_THAT(message, HasSubstr("apt install ffmpeg"));
}

}  // namespace
}  // namespace dyxel
