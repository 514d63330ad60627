// PNG files of 8 and 16 bits.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "dyxel/image/image.h"

namespace dyxel {

using ImageU16 = Image<std::uint16_t>;

// The stored values, [h][w][1 to 4] (grey, grey and alpha, RGB, RGBA; palettes are resolved), and
// their bits: 8 or 16. Throws Error(kInput) with the file where it is missing or damaged.
struct PngImage {
  ImageU16 image;
  int bits = 8;
};
[[nodiscard]] PngImage ReadPng(const std::filesystem::path& path);

// The same from a file's bytes in memory (a picture within another file); `name` is what an error
// calls it. A picture of more than `max_side` pixels a side is refused.
[[nodiscard]] PngImage DecodePng(std::string_view bytes,
                                 const std::filesystem::path& name,
                                 int max_side = 65536);

// The first channel as 8 bits [h][w][1], 16 bits rounded: a mask or a label map.
[[nodiscard]] ImageU8 ReadPngMask(const std::filesystem::path& path);

// 1 to 4 channels; atomic, and the same input gives the same bytes. Throws Error(kStage).
void WritePng(const std::filesystem::path& path, const ImageU8& image);
void WritePng(const std::filesystem::path& path, const ImageU16& image);

// The bytes that WritePng would write.
[[nodiscard]] std::string EncodePng(const ImageU8& image);
[[nodiscard]] std::string EncodePng(const ImageU16& image);

}  // namespace dyxel
