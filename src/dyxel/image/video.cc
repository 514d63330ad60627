#include "dyxel/image/video.h"

#include <charconv>
#include <cstdlib>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/image/process.h"

namespace dyxel {
namespace {

using internal::Process;

constexpr std::size_t kRecentFrames = 6;  // kept a video: threads may ask a little out of order
constexpr std::size_t kOpenVideos = 32;
constexpr int kLongestSkip = 100;  // frames that are decoded and dropped rather than starting anew

void RequireFile(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw FileError(path, "there is no such file", "Check the name and the folder");
  }
}

// "./name", so that no name is taken for an option or a protocol.
std::string Argument(const std::filesystem::path& path) {
  return path.is_absolute() ? path.string() : "./" + path.string();
}

// One video being decoded.
class Stream {
 public:
  explicit Stream(std::filesystem::path path) : path_(std::move(path)) {}

  std::shared_ptr<const ImageU16> Frame(int frame) {
    const std::lock_guard lock(mutex_);
    for (const auto& [number, image] : recent_) {
      if (number == frame) return image;
    }
    if (!process_ || frame < next_ || frame > next_ + kLongestSkip) Start(frame);
    std::shared_ptr<const ImageU16> image;
    while (next_ <= frame) {
      image = Decode();
      recent_.emplace_back(next_++, image);
      if (recent_.size() > kRecentFrames) recent_.pop_front();
    }
    return image;
  }

 private:
  void Start(int frame) {
    RequireFile(path_);
    recent_.clear();
    // PPM carries each frame's size, after the rotation that the file may ask for.
    std::vector<std::string> arguments = {
        "ffmpeg", "-v", "error", "-nostdin", "-i", Argument(path_), "-map", "0:v:0"};
    if (frame > 0) {
      arguments.insert(arguments.end(), {"-vf", fmt::format("select='gte(n,{})'", frame)});
    }
    arguments.insert(arguments.end(),
                     {"-vsync",
                      "passthrough",
                      "-sws_flags",
                      "accurate_rnd+full_chroma_int",
                      "-c:v",
                      "ppm",
                      "-pix_fmt",
                      "rgb48be",
                      "-f",
                      "image2pipe",
                      "pipe:1"});
    process_ = std::make_unique<Process>(arguments, Process::Pipe::kFromOutput);
    next_ = frame;
  }

  int HeaderNumber() {
    int value = 0;
    char c = 0;
    while (process_->Read(&c, 1) == 1 && c >= '0' && c <= '9' && value < 1'000'000) {
      value = 10 * value + (c - '0');
    }
    return value;
  }

  std::shared_ptr<const ImageU16> Decode() {
    char magic[3];
    const std::size_t got = process_->Read(magic, 3);
    const bool good = got == 3 && magic[0] == 'P' && magic[1] == '6';
    const int width = good ? HeaderNumber() : 0;
    const int height = good ? HeaderNumber() : 0;
    const bool deep = good && HeaderNumber() == 65535;
    auto image = std::make_shared<ImageU16>();
    bool whole = deep && width > 0 && height > 0 && width <= 65536 && height <= 65536;
    if (whole) {
      *image = ImageU16(width, height, 3);
      const std::size_t bytes = 2 * image->data.size();
      whole = process_->Read(reinterpret_cast<char*>(image->data.data()), bytes) == bytes;
      for (std::uint16_t& value : image->data) {
        const auto* b = reinterpret_cast<const unsigned char*>(&value);  // big endian
        value = static_cast<std::uint16_t>(b[0] << 8U | b[1]);
      }
    }
    if (!whole) {
      process_->Wait();
      const std::string messages = process_->Messages();
      process_.reset();
      throw FileError(path_,
                      fmt::format("has no frame {} that can be read{}",
                                  next_,
                                  messages.empty() ? "" : " (" + messages + ")"),
                      "Check the sequence's first and count, and whether the file is whole");
    }
    return image;
  }

  std::filesystem::path path_;
  std::mutex mutex_;
  std::unique_ptr<Process> process_;
  int next_ = 0;
  std::deque<std::pair<int, std::shared_ptr<const ImageU16>>> recent_;
};

struct Streams {
  std::mutex mutex;
  std::uint64_t clock = 0;
  std::map<std::string, std::pair<std::uint64_t, std::shared_ptr<Stream>>> open;
};

Streams& OpenStreams() {
  static Streams streams;
  return streams;
}

std::shared_ptr<Stream> StreamOf(const std::filesystem::path& path) {
  Streams& streams = OpenStreams();
  const std::lock_guard lock(streams.mutex);
  auto& entry = streams.open[path.string()];
  entry.first = ++streams.clock;
  if (!entry.second) entry.second = std::make_shared<Stream>(path);
  std::shared_ptr<Stream> stream = entry.second;
  if (streams.open.size() > kOpenVideos) {
    auto oldest = streams.open.begin();
    for (auto it = streams.open.begin(); it != streams.open.end(); ++it) {
      if (it->second.first < oldest->second.first) oldest = it;
    }
    streams.open.erase(oldest);
  }
  return stream;
}

}  // namespace

VideoInfo ReadVideoInfo(const std::filesystem::path& path) {
  RequireFile(path);
  Process process({"ffprobe",
                   "-v",
                   "error",
                   "-select_streams",
                   "v:0",
                   "-count_packets",
                   "-show_entries",
                   "stream=width,height,avg_frame_rate,nb_read_packets",
                   "-of",
                   "default=noprint_wrappers=1",
                   Argument(path)},
                  Process::Pipe::kFromOutput);
  std::string text(65536, ' ');
  text.resize(process.Read(text.data(), text.size()));
  process.Wait();
  const auto value = [&](const std::string& key) -> const char* {
    const std::size_t at = text.find(key + "=");
    return at == std::string::npos ? "0" : text.c_str() + at + key.size() + 1;
  };
  VideoInfo info;
  info.width = std::atoi(value("width"));
  info.height = std::atoi(value("height"));
  info.frames = std::atoi(value("nb_read_packets"));
  char* slash = nullptr;
  info.fps = std::strtod(value("avg_frame_rate"), &slash);
  if (*slash == '/') {
    const double divisor = std::strtod(slash + 1, nullptr);
    info.fps = divisor > 0 ? info.fps / divisor : 0;
  }
  if (info.width < 1 || info.height < 1 || info.frames < 1) {
    throw FileError(path,
                    fmt::format("is no readable video ({})", process.Messages()),
                    "Check that ffmpeg can play it");
  }
  return info;
}

StoredPicture ReadVideoFrame(const std::filesystem::path& path,
                             int frame,
                             const std::function<Rect(int width, int height)>& window) {
  const std::shared_ptr<const ImageU16> image = StreamOf(path)->Frame(frame);
  StoredPicture picture;
  picture.width = image->width;
  picture.height = image->height;
  picture.white_level = 65535;
  picture.window =
      Intersect(window(image->width, image->height), {0, 0, image->width, image->height});
  const Rect& part = picture.window;
  picture.image = ImageF(part.width, part.height, 3);
  for (int y = 0; y < part.height && part.width > 0; ++y) {
    const std::uint16_t* source = &image->At(part.x, part.y + y);
    std::copy_n(source, 3 * static_cast<std::size_t>(part.width), &picture.image.At(0, y));
  }
  return picture;
}

void CloseVideos() {
  Streams& streams = OpenStreams();
  const std::lock_guard lock(streams.mutex);
  streams.open.clear();
}

struct VideoWriter::State {
  AtomicFile file;
  int width;
  int height;
  Process process;

  State(const std::filesystem::path& path, int w, int h, double fps)
      : file(path),
        width(w),
        height(h),
        process({"ffmpeg",
                 "-v",
                 "error",
                 "-f",
                 "rawvideo",
                 "-pix_fmt",
                 "rgb24",
                 "-s",
                 fmt::format("{}x{}", w, h),
                 "-r",
                 fmt::format("{}", fps),
                 "-i",
                 "pipe:0",
                 "-vf",
                 "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709",
                 "-colorspace",
                 "bt709",
                 "-c:v",
                 "libx264",
                 "-crf",
                 "16",
                 "-pix_fmt",
                 "yuv420p",
                 "-movflags",
                 "+faststart",
                 "-y",
                 Argument(file.temporary())},
                Process::Pipe::kToInput) {}

  [[noreturn]] void Fail(const std::filesystem::path& path) {
    process.Wait();
    throw Error(Fault::kStage,
                fmt::format("{}: ffmpeg can't write it ({}). Check the free space, and that ffmpeg "
                            "has the encoder libx264.",
                            path.string(),
                            process.Messages()));
  }
};

VideoWriter::VideoWriter(const std::filesystem::path& path, int width, int height, double fps)
    : state_(std::make_unique<State>(path, width, height, fps)) {}

VideoWriter::~VideoWriter() = default;

void VideoWriter::Add(const ImageU8& frame) {
  Require(frame.width == state_->width && frame.height == state_->height && frame.channels == 3,
          Fault::kStage,
          "A frame of {}x{}x{} can't go into a video of {}x{}x3.",
          frame.width,
          frame.height,
          frame.channels,
          state_->width,
          state_->height);
  if (!state_->process.Write(reinterpret_cast<const char*>(frame.data.data()), frame.data.size())) {
    state_->Fail(state_->file.temporary());
  }
}

void VideoWriter::Finish() {
  if (state_->process.Wait() != 0) state_->Fail(state_->file.temporary());
  state_->file.Commit();
}

}  // namespace dyxel
