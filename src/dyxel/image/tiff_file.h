// TIFF files of 8- and 16-bit integers and floats.
#pragma once

#include <filesystem>

#include "dyxel/image/image.h"

namespace dyxel {

// The stored values of the first page, [h][w][channels]: integers as they are, half and float as
// they are.
struct TiffImage {
  ImageF image;
  int bits = 8;  // 8, 16 or 32
  bool is_float = false;
};

// Reads strips and tiles, interleaved or plane by plane, any compression of libtiff's. Throws
// Error(kInput) with the file where it is missing, damaged or of another kind (palette, 1 bit, …).
[[nodiscard]] TiffImage ReadTiff(const std::filesystem::path& path);

}  // namespace dyxel
