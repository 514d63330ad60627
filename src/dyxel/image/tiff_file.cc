#include "dyxel/image/tiff_file.h"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include <half.h>
#include <tiffio.h>

#include "dyxel/base/error.h"
#include "dyxel/image/picture_limits.h"

namespace dyxel {
namespace {

int OnError(TIFF*, void* user, const char*, const char* format, va_list arguments) {
  char text[512];
  std::vsnprintf(text, sizeof(text), format, arguments);
  auto& message = *static_cast<std::string*>(user);
  if (message.empty()) message = text;
  return 1;  // handled: nothing is printed
}

int OnWarning(TIFF*, void*, const char*, const char*, va_list) { return 1; }

float Value(const unsigned char* source, int bits, bool is_float) {
  if (bits == 8) return static_cast<float>(*source);
  if (bits == 16) {
    std::uint16_t value = 0;
    std::memcpy(&value, source, sizeof(value));
    if (!is_float) return static_cast<float>(value);
    half number;
    number.setBits(value);
    return static_cast<float>(number);
  }
  float value = 0;
  std::memcpy(&value, source, sizeof(value));
  return value;
}

}  // namespace

TiffImage ReadTiff(const std::filesystem::path& path,
                   const std::function<Rect(int width, int height)>& window) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw FileError(path, "there is no such file", "Check the name and the folder");
  }
  std::string message;
  const auto fail = [&](const std::string& what) {
    return FileError(path,
                     what + (message.empty() ? "" : " (" + message + ")"),
                     "Write it as 8- or 16-bit or float TIFF, RGB or grey, or copy it again");
  };
  std::unique_ptr<TIFFOpenOptions, void (*)(TIFFOpenOptions*)> options(TIFFOpenOptionsAlloc(),
                                                                       TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), OnError, &message);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), OnWarning, nullptr);
  const std::unique_ptr<TIFF, void (*)(TIFF*)> tiff(TIFFOpenExt(path.c_str(), "r", options.get()),
                                                    TIFFClose);
  if (!tiff) throw fail("is no readable TIFF picture");

  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint16_t channels = 1;
  std::uint16_t bits = 1;
  std::uint16_t format = SAMPLEFORMAT_UINT;
  std::uint16_t planar = PLANARCONFIG_CONTIG;
  std::uint16_t photometric = PHOTOMETRIC_MINISBLACK;
  TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &height);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, &channels);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_SAMPLEFORMAT, &format);
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_PLANARCONFIG, &planar);
  TIFFGetField(tiff.get(), TIFFTAG_PHOTOMETRIC, &photometric);
  const bool is_float = format == SAMPLEFORMAT_IEEEFP;
  const bool known_bits = is_float ? bits == 16 || bits == 32 : bits == 8 || bits == 16;
  if (width == 0 || height == 0 || std::int64_t{width} * height > internal::kMaxPixels ||
      channels == 0 || channels > 16) {
    throw fail(
        fmt::format("its size, {}x{} with {} channels, is impossible", width, height, channels));
  }
  if (!known_bits || (!is_float && format != SAMPLEFORMAT_UINT) ||
      (photometric != PHOTOMETRIC_MINISBLACK && photometric != PHOTOMETRIC_RGB)) {
    throw fail(
        fmt::format("its pixels ({} bits, sample format {}, colour model {}) are not supported",
                    bits,
                    format,
                    photometric));
  }

  TiffImage result;
  result.bits = bits;
  result.is_float = is_float;
  result.width = static_cast<int>(width);
  result.height = static_cast<int>(height);
  const Rect all{0, 0, result.width, result.height};
  result.window = window ? Intersect(window(result.width, result.height), all) : all;
  result.image = ImageF(result.window.width, result.window.height, channels);
  if (result.image.empty()) return result;
  const auto left = static_cast<std::uint32_t>(result.window.x);
  const auto top = static_cast<std::uint32_t>(result.window.y);
  const auto right = left + static_cast<std::uint32_t>(result.window.width);
  const auto bottom = top + static_cast<std::uint32_t>(result.window.height);
  const bool planes = planar == PLANARCONFIG_SEPARATE && channels > 1;
  const std::size_t sample_bytes = bits / 8U;
  const std::size_t step = planes ? 1 : channels;  // samples a pixel in a block
  // Copies what lies in the window of a row of `count` pixels at (x, y), of one plane or
  // interleaved.
  const auto copy_row = [&](const unsigned char* source,
                            std::uint32_t x,
                            std::uint32_t y,
                            std::uint32_t count,
                            std::uint16_t plane) {
    const std::uint32_t begin = std::max(x, left);
    const std::uint32_t end = std::min(x + count, right);
    if (begin >= end) return;
    source += (begin - x) * step * sample_bytes;
    float* target =
        &result.image.At(static_cast<int>(begin - left), static_cast<int>(y - top), plane);
    for (std::size_t i = 0; i < end - begin; ++i) {
      for (std::size_t c = 0; c < step; ++c) {
        target[i * channels + c] = Value(source + (i * step + c) * sample_bytes, bits, is_float);
      }
    }
  };

  const auto num_planes = static_cast<std::uint16_t>(planes ? channels : 1);
  if (TIFFIsTiled(tiff.get()) != 0) {
    std::uint32_t tile_width = 0;
    std::uint32_t tile_height = 0;
    TIFFGetField(tiff.get(), TIFFTAG_TILEWIDTH, &tile_width);
    TIFFGetField(tiff.get(), TIFFTAG_TILELENGTH, &tile_height);
    const auto row_bytes = static_cast<std::size_t>(TIFFTileRowSize(tiff.get()));
    const auto tile_bytes = static_cast<std::size_t>(TIFFTileSize(tiff.get()));
    if (tile_width == 0 || tile_height == 0 || row_bytes < tile_width * step * sample_bytes ||
        tile_bytes < row_bytes * tile_height || tile_bytes > (std::size_t{1} << 30U)) {
      throw fail("its tiles have an impossible size");
    }
    std::vector<unsigned char> tile(tile_bytes);
    for (std::uint16_t plane = 0; plane < num_planes; ++plane) {
      for (std::uint32_t y = top - top % tile_height; y < bottom; y += tile_height) {
        for (std::uint32_t x = left - left % tile_width; x < right; x += tile_width) {
          if (TIFFReadTile(tiff.get(), tile.data(), x, y, 0, plane) < 0) {
            throw fail("is damaged or incomplete");
          }
          const std::uint32_t last = std::min(y + tile_height, bottom);
          for (std::uint32_t row = std::max(y, top); row < last; ++row) {
            copy_row(&tile[(row - y) * row_bytes], x, row, tile_width, plane);
          }
        }
      }
    }
    return result;
  }
  const auto row_bytes = static_cast<std::size_t>(TIFFScanlineSize(tiff.get()));
  if (row_bytes < width * step * sample_bytes) throw fail("its lines have an impossible size");
  // A strip can be entered at its first row only: packed rows build on those before.
  std::uint32_t strip_height = height;
  TIFFGetFieldDefaulted(tiff.get(), TIFFTAG_ROWSPERSTRIP, &strip_height);
  if (strip_height == 0) throw fail("its strips have an impossible size");
  std::vector<unsigned char> row(row_bytes);
  for (std::uint16_t plane = 0; plane < num_planes; ++plane) {
    for (std::uint32_t y = top - top % strip_height; y < bottom; ++y) {
      if (TIFFReadScanline(tiff.get(), row.data(), y, plane) < 0) {
        throw fail("is damaged or incomplete");
      }
      if (y >= top) copy_row(row.data(), 0, y, width, plane);
    }
  }
  return result;
}

}  // namespace dyxel
