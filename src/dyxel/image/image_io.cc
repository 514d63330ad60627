#include "dyxel/image/image_io.h"

#include <cctype>
#include <string>

#include "dyxel/base/error.h"

namespace dyxel {
namespace {

std::string Extension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

// The colours of a window of an image of 1 to 4 channels.
template <class T>
ImageF Colours(const Image<T>& image, const Rect& window) {
  ImageF result(window.width, window.height, 3);
  const auto channels = static_cast<std::size_t>(image.channels);
  for (int y = 0; y < window.height; ++y) {
    if (window.width == 0) break;
    const T* source = &image.At(window.x, window.y + y);
    float* target = &result.At(0, y);
    const auto width = static_cast<std::size_t>(window.width);
    for (std::size_t x = 0; x < width; ++x) {
      for (std::size_t c = 0; c < 3; ++c) {
        target[3 * x + c] = static_cast<float>(source[x * channels + (channels >= 3 ? c : 0)]);
      }
    }
  }
  return result;
}

}  // namespace

bool IsPictureName(const std::filesystem::path& path) {
  const std::string extension = Extension(path);
  return extension == ".exr" || extension == ".png" || extension == ".tif" ||
         extension == ".tiff" || extension == ".hdr";
}

StoredPicture ReadPicture(const std::filesystem::path& path, const std::optional<Rect>& window) {
  return ReadPicture(path, [&](int width, int height) {
    return window ? *window : Rect{0, 0, width, height};
  });
}

StoredPicture ReadPicture(const std::filesystem::path& path,
                          const std::function<Rect(int width, int height)>& window) {
  const std::string extension = Extension(path);
  StoredPicture picture;
  const auto take = [&](const auto& image) {
    picture.width = image.width;
    picture.height = image.height;
    const Rect all{0, 0, image.width, image.height};
    picture.window = Intersect(window(image.width, image.height), all);
    picture.image = Colours(image, picture.window);
  };
  if (extension == ".exr") {
    const ExrInfo info = ReadExrInfo(path);
    ExrPicture exr = ReadExrRgb(path, window(info.width, info.height));
    picture.image = std::move(exr.image);
    picture.window = exr.window;
    picture.width = exr.width;
    picture.height = exr.height;
    picture.is_float = true;
  } else if (extension == ".png") {
    const PngImage png = ReadPng(path);
    picture.white_level = png.bits == 16 ? 65535 : 255;
    take(png.image);
  } else if (extension == ".tif" || extension == ".tiff") {
    const TiffImage tiff = ReadTiff(path, window);
    picture.is_float = tiff.is_float;
    picture.white_level = tiff.is_float ? 1 : tiff.bits == 16 ? 65535 : 255;
    picture.window = tiff.window;
    picture.width = tiff.width;
    picture.height = tiff.height;
    picture.image = Colours(tiff.image, {0, 0, tiff.window.width, tiff.window.height});
  } else if (extension == ".hdr") {
    picture.is_float = true;
    take(ReadRgbe(path));
  } else {
    throw FileError(path, "is of no kind of picture that is known", "Use .exr, .png, .tif or .hdr");
  }
  return picture;
}

}  // namespace dyxel
