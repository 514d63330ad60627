// Picture files of any kind that Dyxel knows, by their extension.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "dyxel/image/exr.h"
#include "dyxel/image/image.h"
#include "dyxel/image/png_file.h"
#include "dyxel/image/rgbe.h"
#include "dyxel/image/tiff_file.h"

namespace dyxel {

// A picture's colours as the file holds them: no white level, transfer or matrix applied.
struct StoredPicture {
  ImageF image;            // [h][w][3] of `window`; grey is repeated, alpha left out
  Rect window;             // in the file's pixels
  int width = 0;           // of the whole file
  int height = 0;          // of the whole file
  double white_level = 1;  // 255 or 65535 for integers, 1 for floats
  bool is_float = false;
};

// True for .exr, .png, .tif, .tiff and .hdr in any case.
[[nodiscard]] bool IsPictureName(const std::filesystem::path& path);

// Reads a picture or the part of it in `window` (clipped to it). Throws Error(kInput) with the file
// where it is missing, damaged or of an unknown kind.
[[nodiscard]] StoredPicture ReadPicture(const std::filesystem::path& path,
                                        const std::optional<Rect>& window = std::nullopt);

// The same, where the window depends on the file's size: `window(width, height)` is asked before
// the pixels are unpacked, and may throw.
[[nodiscard]] StoredPicture ReadPicture(const std::filesystem::path& path,
                                        const std::function<Rect(int width, int height)>& window);

}  // namespace dyxel
