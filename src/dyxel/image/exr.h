// OpenEXR files: pictures and maps of any named channels, whole or in part.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "dyxel/image/image.h"

namespace dyxel {

enum class ExrType { kHalf, kFloat };

// How the lines are packed; all lossless. kLine packs every line by itself: part of a file is read
// at the cost of that part. kBlock packs 16 lines at once: smaller.
enum class ExrPacking { kNone, kLine, kBlock };

// A map with its channels' names, in the order of the image's channels.
struct ExrImage {
  ImageF image;  // [h][w][channels]
  std::vector<std::string> channels;
};

struct ExrInfo {
  int width = 0;
  int height = 0;
  std::vector<std::string> channels;  // as the file has them: in alphabetical order
};

// All readers span the display window, whose corner is pixel (0, 0); where the file holds no data
// there, values are 0. A `window` is clipped to the picture, and only the lines or tiles that it
// needs are unpacked. OpenEXR's own threads are not used: read several files at once instead.
// All throw Error(kInput) with the file where it is missing, damaged or has other channels.

[[nodiscard]] ExrInfo ReadExrInfo(const std::filesystem::path& path);

// The named channels in that order; all of the file's without names.
[[nodiscard]] ExrImage ReadExr(const std::filesystem::path& path,
                               const std::vector<std::string>& channels = {},
                               const std::optional<Rect>& window = std::nullopt);

// Rows [y0, y1) of the named channels, full width.
[[nodiscard]] ExrImage ReadExrRows(const std::filesystem::path& path,
                                   int y0,
                                   int y1,
                                   const std::vector<std::string>& channels = {});

// A part of a picture and where it lies.
struct ExrPicture {
  ImageF image;  // [h][w][3] of `window`
  Rect window;
  int width = 0;   // of the whole picture
  int height = 0;  // of the whole picture
};

// The colours: R, G and B, or those of the first layer that has them ("Combined.R"), or X,
// Y and Z, or a single channel thrice.
[[nodiscard]] ExrPicture ReadExrRgb(const std::filesystem::path& path,
                                    const std::optional<Rect>& window = std::nullopt);

// Writes image channel i under the name channels[i]; atomic, and the same input gives the same
// bytes. kHalf clamps to ±65504. Without names: Y, RGB or RGBA by the number of channels. Throws
// Error(kStage) where it can't be written.
void WriteExr(const std::filesystem::path& path,
              const ImageF& image,
              std::vector<std::string> channels = {},
              ExrType type = ExrType::kHalf,
              ExrPacking packing = ExrPacking::kBlock);

}  // namespace dyxel
