#include "dyxel/image/exr.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#ifdef __F16C__
#include <immintrin.h>
#endif

#include <Iex.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfPartType.h>
#include <ImfTileDescription.h>
#include <ImfTiledInputFile.h>
#include <half.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/image/picture_limits.h"

namespace dyxel {
namespace {

constexpr const char* kMend = "Copy the file again from where it was made";

void FloatsFromHalves(const half* source, std::size_t n, float* target) {
  std::size_t i = 0;
#ifdef __F16C__
  for (; i + 8 <= n; i += 8) {
    __m128i packed;
    std::memcpy(&packed, source + i, sizeof(packed));
    _mm256_storeu_ps(target + i, _mm256_cvtph_ps(packed));
  }
#endif
  for (; i < n; ++i) target[i] = static_cast<float>(source[i]);
}

half HalfFromFloat(float value) {
  constexpr float kMax = 65504.0F;
  return half(std::isnan(value) ? value : std::clamp(value, -kMax, kMax));
}

// An EXR file opened for reading, with the size of its picture.
class ExrFile {
 public:
  explicit ExrFile(const std::filesystem::path& path) : path_(path) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) {
      throw FileError(path, "there is no such file", "Check the name and the folder");
    }
    try {
      file_ = std::make_unique<Imf::InputFile>(path.c_str(), 0);
    } catch (const std::exception& e) {
      throw FileError(path, fmt::format("is no readable EXR picture ({})", e.what()), kMend);
    }
    const Imf::Header& header = file_->header();
    const Imath::Box2i& display = header.displayWindow();
    const Imath::Box2i& data = header.dataWindow();
    for (const Imath::Box2i* box : {&display, &data}) {
      const std::int64_t width = std::int64_t{box->max.x} - box->min.x + 1;
      const std::int64_t height = std::int64_t{box->max.y} - box->min.y + 1;
      if (width < 1 || height < 1 || width > internal::kMaxPixels ||
          height > internal::kMaxPixels || width * height > internal::kMaxPixels) {
        throw FileError(path, fmt::format("its size, {}x{}, is impossible", width, height), kMend);
      }
    }
    info_.width = display.max.x - display.min.x + 1;
    info_.height = display.max.y - display.min.y + 1;
    for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
      info_.channels.emplace_back(it.name());
    }
  }

  [[nodiscard]] const ExrInfo& info() const { return info_; }

  // Channels `names` of the part `window` of the picture, which must lie inside it.
  [[nodiscard]] ImageF Read(const std::vector<std::string>& names, const Rect& window) {
    bool all_half = true;
    for (const std::string& name : names) {
      const Imf::Channel* channel = file_->header().channels().findChannel(name.c_str());
      if (channel == nullptr) throw MissingChannel(name);
      if (channel->xSampling != 1 || channel->ySampling != 1) {
        throw FileError(path_,
                        fmt::format("channel {} is subsampled, which is not supported", name),
                        "Write the picture as RGB");
      }
      all_half = all_half && channel->type == Imf::HALF;
    }
    ImageF image(window.width, window.height, static_cast<int>(names.size()));
    if (image.empty()) return image;
    try {
      if (all_half) {
        ReadPlanes<half>(names, window, Imf::HALF, image);
      } else {
        ReadPlanes<float>(names, window, Imf::FLOAT, image);
      }
    } catch (const Iex::BaseExc& e) {
      throw FileError(path_, fmt::format("is damaged or incomplete ({})", e.what()), kMend);
    }
    return image;
  }

  [[nodiscard]] Error MissingChannel(const std::string& name) const {
    return FileError(path_,
                     fmt::format("has no channel {} but {}", name, fmt::join(info_.channels, ", ")),
                     "Write the picture with that channel");
  }

 private:
  // Unpacks planes of full lines (or full tiles), then interleaves the window.
  template <class T>
  void ReadPlanes(const std::vector<std::string>& names,
                  const Rect& window,
                  Imf::PixelType type,
                  ImageF& image) {
    const Imf::Header& header = file_->header();
    const Imath::Box2i display = header.displayWindow();
    const Imath::Box2i data = header.dataWindow();
    // The rows and columns wanted, in the file's coordinates, as far as there is data.
    const int y0 = std::max(display.min.y + window.y, data.min.y);
    const int y1 = std::min(display.min.y + window.y + window.height - 1, data.max.y);
    const int x0 = std::max(display.min.x + window.x, data.min.x);
    const int x1 = std::min(display.min.x + window.x + window.width - 1, data.max.x);
    if (y0 > y1 || x0 > x1) return;

    // What is unpacked: [left, left + stride) × [top, …].
    int left = data.min.x;
    int right = data.max.x;
    int top = y0;
    int bottom = y1;
    const bool tiled = header.hasTileDescription();
    Imath::Box2i tiles;
    if (tiled) {
      const Imf::TileDescription& tile = header.tileDescription();
      const int width = static_cast<int>(tile.xSize);
      const int height = static_cast<int>(tile.ySize);
      tiles.min = {(x0 - data.min.x) / width, (y0 - data.min.y) / height};
      tiles.max = {(x1 - data.min.x) / width, (y1 - data.min.y) / height};
      left = data.min.x + tiles.min.x * width;
      top = data.min.y + tiles.min.y * height;
      right = std::min(data.max.x, data.min.x + (tiles.max.x + 1) * width - 1);
      bottom = std::min(data.max.y, data.min.y + (tiles.max.y + 1) * height - 1);
    }
    const auto stride = static_cast<std::size_t>(right - left + 1);
    const auto rows = static_cast<std::size_t>(bottom - top + 1);
    std::vector<T> planes(stride * rows * names.size());
    Imf::FrameBuffer buffer;
    for (std::size_t c = 0; c < names.size(); ++c) {
      // Slice::Make puts the base where pixel (0, 0) of the file would be.
      buffer.insert(names[c],
                    Imf::Slice::Make(type,
                                     planes.data() + c * stride * rows,
                                     Imath::Box2i({left, top}, {right, bottom}),
                                     sizeof(T),
                                     sizeof(T) * stride));
    }
    if (tiled) {
      Imf::TiledInputFile file(path_.c_str(), 0);
      file.setFrameBuffer(buffer);
      file.readTiles(tiles.min.x, tiles.max.x, tiles.min.y, tiles.max.y);
    } else {
      file_->setFrameBuffer(buffer);
      file_->readPixels(top, bottom);
    }

    const auto channels = static_cast<std::size_t>(image.channels);
    const auto columns = static_cast<std::size_t>(x1 - x0 + 1);
    std::vector<float> line(columns);
    for (int y = y0; y <= y1; ++y) {
      float* target = &image.At(x0 - display.min.x - window.x, y - display.min.y - window.y);
      for (std::size_t c = 0; c < channels; ++c) {
        const T* source = planes.data() + (c * rows + static_cast<std::size_t>(y - top)) * stride +
                          static_cast<std::size_t>(x0 - left);
        const float* values = nullptr;
        if constexpr (std::is_same_v<T, half>) {
          FloatsFromHalves(source, columns, line.data());
          values = line.data();
        } else {
          values = source;
        }
        for (std::size_t x = 0; x < columns; ++x) target[x * channels + c] = values[x];
      }
    }
  }

  std::filesystem::path path_;
  std::unique_ptr<Imf::InputFile> file_;
  ExrInfo info_;
};

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// The names of the three channels that are colour, or empty.
std::vector<std::string> ColourChannels(const std::vector<std::string>& channels) {
  if (channels.size() == 1) return {channels[0], channels[0], channels[0]};
  const auto find = [&](const std::string& lower_name) -> std::string {
    for (const std::string& name : channels) {
      if (Lower(name) == lower_name) return name;
    }
    return "";
  };
  std::vector<std::string> layers = {""};
  for (const std::string& name : channels) {
    const std::size_t dot = name.rfind('.');
    if (dot != std::string::npos) layers.push_back(Lower(name.substr(0, dot + 1)));
  }
  for (const char* letters : {"rgb", "xyz"}) {
    for (const std::string& layer : layers) {
      std::vector<std::string> found;
      for (int i = 0; i < 3; ++i) {
        std::string name = find(layer + letters[i]);
        if (!name.empty()) found.push_back(std::move(name));
      }
      if (found.size() == 3) return found;
    }
  }
  // Grey with alpha; a luminance with chroma (RY, BY) is not grey.
  const std::string grey = find("y");
  if (!grey.empty() && find("ry").empty() && find("by").empty()) return {grey, grey, grey};
  return {};
}

Rect Clip(const std::optional<Rect>& window, const ExrInfo& info) {
  const Rect all{0, 0, info.width, info.height};
  return window ? Intersect(*window, all) : all;
}

}  // namespace

ExrInfo ReadExrInfo(const std::filesystem::path& path) { return ExrFile(path).info(); }

ExrImage ReadExr(const std::filesystem::path& path,
                 const std::vector<std::string>& channels,
                 const std::optional<Rect>& window) {
  ExrFile file(path);
  ExrImage result;
  result.channels = channels.empty() ? file.info().channels : channels;
  result.image = file.Read(result.channels, Clip(window, file.info()));
  return result;
}

ExrImage ReadExrRows(const std::filesystem::path& path,
                     int y0,
                     int y1,
                     const std::vector<std::string>& channels) {
  return ReadExr(path, channels, Rect{0, y0, std::numeric_limits<int>::max(), y1 - y0});
}

ExrPicture ReadExrRgb(const std::filesystem::path& path, const std::optional<Rect>& window) {
  ExrFile file(path);
  const std::vector<std::string> names = ColourChannels(file.info().channels);
  if (names.empty()) throw file.MissingChannel("R, G and B");
  ExrPicture picture;
  picture.width = file.info().width;
  picture.height = file.info().height;
  picture.window = Clip(window, file.info());
  if (names[0] != names[1]) {
    picture.image = file.Read(names, picture.window);
    return picture;
  }
  const ImageF grey = file.Read({names[0]}, picture.window);
  picture.image = ImageF(grey.width, grey.height, 3);
  for (std::size_t i = 0; i < grey.data.size(); ++i) {
    std::fill_n(picture.image.data.begin() + static_cast<std::ptrdiff_t>(3 * i), 3, grey.data[i]);
  }
  return picture;
}

void WriteExr(const std::filesystem::path& path,
              const ImageF& image,
              std::vector<std::string> channels,
              ExrType type,
              ExrPacking packing) {
  if (channels.empty()) {
    if (image.channels == 1) channels = {"Y"};
    if (image.channels == 3) channels = {"R", "G", "B"};
    if (image.channels == 4) channels = {"R", "G", "B", "A"};
  }
  const auto count = static_cast<std::size_t>(image.channels);
  Require(channels.size() == count && !image.empty(),
          Fault::kStage,
          "{}: {} names for the {} channels of a picture of {}x{} pixels.",
          path.string(),
          channels.size(),
          image.channels,
          image.width,
          image.height);
  const auto pixels =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  AtomicFile file(path);
  try {
    Imf::Header header(image.width, image.height);
    header.compression() = packing == ExrPacking::kNone   ? Imf::NO_COMPRESSION
                           : packing == ExrPacking::kLine ? Imf::ZIPS_COMPRESSION
                                                          : Imf::ZIP_COMPRESSION;
    header.zipCompressionLevel() = 2;  // twice as fast as 4 for 3 % more bytes
    const Imf::PixelType pixel_type = type == ExrType::kHalf ? Imf::HALF : Imf::FLOAT;
    for (const std::string& name : channels) header.channels().insert(name, pixel_type);

    std::vector<half> halves;
    if (type == ExrType::kHalf) {
      halves.resize(image.data.size());
      std::transform(image.data.begin(), image.data.end(), halves.begin(), HalfFromFloat);
    }
    Imf::FrameBuffer buffer;
    const std::size_t size = type == ExrType::kHalf ? sizeof(half) : sizeof(float);
    // The file is only written from: OpenEXR's slices know no const.
    char* base = type == ExrType::kHalf
                     ? reinterpret_cast<char*>(halves.data())
                     : const_cast<char*>(reinterpret_cast<const char*>(image.data.data()));
    for (std::size_t c = 0; c < count; ++c) {
      buffer.insert(channels[c],
                    Imf::Slice(pixel_type,
                               base + c * size,
                               count * size,
                               pixels / static_cast<std::size_t>(image.height) * count * size));
    }
    Imf::OutputFile output(file.temporary().c_str(), header, 0);
    output.setFrameBuffer(buffer);
    output.writePixels(image.height);
  } catch (const Iex::BaseExc& e) {
    throw Error(Fault::kStage,
                fmt::format("{}: can't be written ({}). Check the free space and the permissions.",
                            path.string(),
                            e.what()));
  }
  file.Commit();
}

}  // namespace dyxel
