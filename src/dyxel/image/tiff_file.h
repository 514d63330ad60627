// TIFF files of 8- and 16-bit integers and floats.
#pragma once

#include <filesystem>
#include <functional>

#include "dyxel/image/image.h"

namespace dyxel {

// The stored values of the first page or of a part of it, [h][w][channels]: integers as they are,
// half and float as they are.
struct TiffImage {
  ImageF image;    // of `window`
  Rect window;     // in the page's pixels
  int width = 0;   // of the whole page
  int height = 0;  //
  int bits = 8;    // 8, 16 or 32
  bool is_float = false;
};

// Reads strips and tiles, interleaved or plane by plane, any compression of libtiff's. With
// `window`, which is given the page's size and may throw, only the strips and tiles that meet that
// part (clipped to the page) are decoded. Throws Error(kInput) with the file where it is missing,
// damaged or of another kind (palette, 1 bit, …).
[[nodiscard]] TiffImage ReadTiff(const std::filesystem::path& path,
                                 const std::function<Rect(int width, int height)>& window = {});

}  // namespace dyxel
