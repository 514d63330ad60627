#include "dyxel/image/png_file.h"

#include <bit>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <png.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/image/picture_limits.h"

namespace dyxel {
namespace {

// Everything that a libpng call may touch lives here, outside the frames that longjmp unwinds.
struct Codec {
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::string message;
  // Reading.
  const char* bytes = nullptr;
  std::size_t size = 0;
  std::size_t position = 0;
  png_uint_32 max_side = 65536;
  // Writing.
  std::string out;
  // The picture.
  png_uint_32 width = 0;
  png_uint_32 height = 0;
  int bits = 8;
  int channels = 0;
  std::vector<unsigned char> data;  // rows
  std::vector<png_bytep> rows;
};

void OnError(png_structp png, png_const_charp message) {
  static_cast<Codec*>(png_get_error_ptr(png))->message = message;
  png_longjmp(png, 1);
}

void OnWarning(png_structp, png_const_charp) {}

void OnRead(png_structp png, png_bytep target, std::size_t count) {
  auto& codec = *static_cast<Codec*>(png_get_io_ptr(png));
  if (count > codec.size - codec.position) png_error(png, "the file ends too early");
  std::memcpy(target, codec.bytes + codec.position, count);
  codec.position += count;
}

void OnWrite(png_structp png, png_bytep source, std::size_t count) {
  auto& codec = *static_cast<Codec*>(png_get_io_ptr(png));
  codec.out.append(reinterpret_cast<const char*>(source), count);
}

void AllocateRows(Codec& codec) {
  const std::size_t stride = png_get_rowbytes(codec.png, codec.info);
  codec.data.assign(stride * codec.height, 0);
  codec.rows.resize(codec.height);
  for (std::size_t y = 0; y < codec.rows.size(); ++y) codec.rows[y] = &codec.data[y * stride];
}

bool Decode(Codec& codec) {
  codec.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &codec, OnError, OnWarning);
  codec.info = png_create_info_struct(codec.png);
  if (setjmp(png_jmpbuf(codec.png)) != 0) return false;
  png_set_read_fn(codec.png, &codec, OnRead);
  png_set_user_limits(codec.png, codec.max_side, codec.max_side);
  png_read_info(codec.png, codec.info);
  png_set_expand(codec.png);  // palettes, and grey of fewer than 8 bits
  if constexpr (std::endian::native == std::endian::little) png_set_swap(codec.png);
  png_set_interlace_handling(codec.png);
  png_read_update_info(codec.png, codec.info);
  codec.width = png_get_image_width(codec.png, codec.info);
  codec.height = png_get_image_height(codec.png, codec.info);
  if (std::int64_t{codec.width} * codec.height > internal::kMaxPixels) {
    png_error(codec.png, "its size is impossible");
  }
  codec.bits = png_get_bit_depth(codec.png, codec.info);
  codec.channels = png_get_channels(codec.png, codec.info);
  AllocateRows(codec);
  png_read_image(codec.png, codec.rows.data());
  png_read_end(codec.png, nullptr);
  return true;
}

bool Encode(Codec& codec) {
  codec.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &codec, OnError, OnWarning);
  codec.info = png_create_info_struct(codec.png);
  if (setjmp(png_jmpbuf(codec.png)) != 0) return false;
  png_set_write_fn(codec.png, &codec, OnWrite, nullptr);
  constexpr int kColourTypes[] = {
      PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB, PNG_COLOR_TYPE_RGB_ALPHA};
  png_set_IHDR(codec.png,
               codec.info,
               codec.width,
               codec.height,
               codec.bits,
               kColourTypes[codec.channels - 1],
               PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(codec.png, 4);
  png_write_info(codec.png, codec.info);
  if constexpr (std::endian::native == std::endian::little) png_set_swap(codec.png);
  png_write_image(codec.png, codec.rows.data());
  png_write_end(codec.png, nullptr);
  return true;
}

Codec DecodeCodec(std::string_view bytes, const std::filesystem::path& path, int max_side) {
  Codec codec;
  codec.bytes = bytes.data();
  codec.size = bytes.size();
  codec.max_side = static_cast<png_uint_32>(max_side);
  const bool good = Decode(codec);
  png_destroy_read_struct(&codec.png, &codec.info, nullptr);
  if (!good) {
    throw FileError(path,
                    fmt::format("is no readable PNG picture ({})", codec.message),
                    "Copy the file again from where it was made");
  }
  return codec;
}

Codec ReadCodec(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw FileError(path, "there is no such file", "Check the name and the folder");
  }
  return DecodeCodec(ReadFile(path), path, 65536);
}

PngImage ToImage(const Codec& codec) {
  PngImage result;
  result.bits = codec.bits;
  result.image =
      ImageU16(static_cast<int>(codec.width), static_cast<int>(codec.height), codec.channels);
  if (codec.bits == 16) {
    std::memcpy(result.image.data.data(), codec.data.data(), codec.data.size());
  } else {
    std::copy(codec.data.begin(), codec.data.end(), result.image.data.begin());
  }
  return result;
}

template <class T>
std::string Encode(const std::filesystem::path& path, const Image<T>& image) {
  Require(image.channels >= 1 && image.channels <= 4 && !image.empty(),
          Fault::kStage,
          "{}: a PNG picture can't have {} channels of {}x{} pixels.",
          path.string(),
          image.channels,
          image.width,
          image.height);
  Codec codec;
  codec.width = static_cast<png_uint_32>(image.width);
  codec.height = static_cast<png_uint_32>(image.height);
  codec.bits = static_cast<int>(8 * sizeof(T));
  codec.channels = image.channels;
  codec.rows.resize(codec.height);
  for (int y = 0; y < image.height; ++y) {
    // libpng's rows know no const; writing does not change them.
    codec.rows[static_cast<std::size_t>(y)] =
        const_cast<png_bytep>(reinterpret_cast<const unsigned char*>(&image.At(0, y)));
  }
  const bool good = Encode(codec);
  png_destroy_write_struct(&codec.png, &codec.info);
  Require(good, Fault::kStage, "{}: can't be packed as PNG ({}).", path.string(), codec.message);
  return codec.out;
}

}  // namespace

PngImage ReadPng(const std::filesystem::path& path) { return ToImage(ReadCodec(path)); }

PngImage DecodePng(std::string_view bytes, const std::filesystem::path& name, int max_side) {
  return ToImage(DecodeCodec(bytes, name, max_side));
}

ImageU8 ReadPngMask(const std::filesystem::path& path) {
  const Codec codec = ReadCodec(path);
  ImageU8 mask(static_cast<int>(codec.width), static_cast<int>(codec.height), 1);
  const auto channels = static_cast<std::size_t>(codec.channels);
  for (std::size_t i = 0; i < mask.data.size(); ++i) {
    if (codec.bits == 16) {
      std::uint16_t value = 0;
      std::memcpy(&value, &codec.data[2 * i * channels], sizeof(value));
      mask.data[i] = static_cast<std::uint8_t>((value + 128U) / 257U);
    } else {
      mask.data[i] = codec.data[i * channels];
    }
  }
  return mask;
}

void WritePng(const std::filesystem::path& path, const ImageU8& image) {
  WriteFile(path, Encode(path, image));
}
void WritePng(const std::filesystem::path& path, const ImageU16& image) {
  WriteFile(path, Encode(path, image));
}

std::string EncodePng(const ImageU8& image) { return Encode("a PNG in memory", image); }
std::string EncodePng(const ImageU16& image) { return Encode("a PNG in memory", image); }

}  // namespace dyxel
