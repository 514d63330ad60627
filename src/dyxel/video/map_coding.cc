#include "dyxel/video/map_coding.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/image/png_file.h"

namespace dyxel::internal {
namespace {

std::size_t Size(int n) { return static_cast<std::size_t>(n); }

struct NormalCode {
  float half;  // steps on each side of zero
  int step;    // of the stored 16-bit value; 1 for 8-bit pictures
};
NormalCode CodeOf(int bits) {
  const int half = (1 << (bits - 1)) - 1;
  return {static_cast<float>(half), bits <= 8 ? 1 : 1 << (16 - bits)};
}

template <class T>
std::string EncodeNormalsAs(const ImageF& normals, int bits) {
  const NormalCode code = CodeOf(bits);
  Image<T> picture(normals.width, normals.height, 3, std::numeric_limits<T>::max());
  const std::size_t pixels = picture.data.size() / 3;
  for (std::size_t i = 0; i < pixels; ++i) {
    const float* n = &normals.data[i * Size(normals.channels)];
    for (std::size_t c = 0; c < 2; ++c) {
      const float value = std::isfinite(n[c]) ? std::clamp(n[c], -1.0F, 1.0F) : 0.0F;
      const auto stored = static_cast<int>(std::lround(value * code.half + code.half));
      picture.data[3 * i + c] = static_cast<T>(stored * code.step);
    }
  }
  return EncodePng(picture);
}

struct Decoded {
  PngImage png;
  std::vector<double> offset, scale;  // scale per stored unit
};
PngImage DecodeImage(const GlbFile& glb, const Json& coded, int size, int channels) {
  const int image = glb.Int(coded, "image", 0, std::numeric_limits<int>::max());
  PngImage png = DecodePng(glb.Image(image), glb.path(), size);
  if (png.image.width != size || png.image.height != size || png.image.channels < channels) {
    glb.Fail(fmt::format("has images[{}] of {}x{}x{}, must be {}x{}x{}",
                         image,
                         png.image.width,
                         png.image.height,
                         png.image.channels,
                         size,
                         size,
                         channels));
  }
  return png;
}

Decoded DecodeCoded(const GlbFile& glb, const Json& coded, int size, int channels) {
  Decoded decoded{DecodeImage(glb, coded, size, channels),
                  glb.Numbers(coded, "offset", channels),
                  glb.Numbers(coded, "scale", channels)};
  const double largest = decoded.png.bits == 16 ? 65535 : 255;
  for (double& s : decoded.scale) s /= largest;
  return decoded;
}

}  // namespace

Json AddMap16(GlbBuilder& glb, const ImageF& map, const std::string& name) {
  std::vector<double> offset(Size(map.channels), 0.0);
  std::vector<double> scale(Size(map.channels), 0.0);
  ImageU16 picture(map.width, map.height, map.channels);
  const std::size_t channels = Size(map.channels);
  for (std::size_t c = 0; c < channels; ++c) {
    float low = std::numeric_limits<float>::max();
    float high = std::numeric_limits<float>::lowest();
    for (std::size_t i = c; i < map.data.size(); i += channels) {
      if (!std::isfinite(map.data[i])) continue;
      low = std::min(low, map.data[i]);
      high = std::max(high, map.data[i]);
    }
    if (low > high) low = high = 0;
    offset[c] = static_cast<double>(low);
    scale[c] = static_cast<double>(high) - static_cast<double>(low);
    const double inverse = scale[c] > 0 ? 65535 / scale[c] : 0;
    for (std::size_t i = c; i < map.data.size(); i += channels) {
      const double value = static_cast<double>(map.data[i]) - offset[c];
      picture.data[i] =
          std::isfinite(value) ? static_cast<std::uint16_t>(std::lround(value * inverse)) : 0;
    }
  }
  return {{"image", glb.AddPng(EncodePng(picture), name)}, {"offset", offset}, {"scale", scale}};
}

Json AddMap8(GlbBuilder& glb, const ImageF& map, const std::string& name) {
  ImageU8 picture(map.width, map.height, 1);
  for (std::size_t i = 0; i < picture.data.size(); ++i) {
    const float value = map.data[i * Size(map.channels)];
    picture.data[i] = static_cast<std::uint8_t>(value > 0 ? std::lround(255 * std::min(1.0F, value))
                                                          : 0);  // NaN gives 0
  }
  return {{"image", glb.AddPng(EncodePng(picture), name)}, {"offset", {0.0}}, {"scale", {1.0}}};
}

Json AddLabels(GlbBuilder& glb, const ImageU8& map, const std::string& name) {
  return {{"image", glb.AddPng(EncodePng(map), name)}};
}

std::string EncodeNormals(const ImageF& normals, int bits) {
  return bits <= 8 ? EncodeNormalsAs<std::uint8_t>(normals, bits)
                   : EncodeNormalsAs<std::uint16_t>(normals, bits);
}

Json AddNormals(GlbBuilder& glb, const std::string& png, int bits, const std::string& name) {
  const NormalCode code = CodeOf(bits);
  const double largest = bits <= 8 ? 255 : 65535;
  const double scale = largest / (static_cast<double>(code.half) * code.step);
  return {{"image", glb.AddPng(png, name)}, {"offset", {-1.0, -1.0}}, {"scale", {scale, scale}}};
}

ImageF ReadMap(const GlbFile& glb, const Json& coded, int size, int channels) {
  const Decoded decoded = DecodeCoded(glb, coded, size, channels);
  ImageF map(size, size, channels);
  const std::size_t stored_channels = Size(decoded.png.image.channels);
  for (std::size_t i = 0; i < Size(size) * Size(size); ++i) {
    for (std::size_t c = 0; c < Size(channels); ++c) {
      map.data[i * Size(channels) + c] = static_cast<float>(
          decoded.offset[c] +
          decoded.scale[c] * static_cast<double>(decoded.png.image.data[i * stored_channels + c]));
    }
  }
  return map;
}

ImageU8 ReadLabels(const GlbFile& glb, const Json& coded, int size, int largest) {
  const PngImage png = DecodeImage(glb, coded, size, 1);
  ImageU8 map(size, size, 1);
  for (std::size_t i = 0; i < map.data.size(); ++i) {
    const std::uint16_t label = png.image.data[i * Size(png.image.channels)];
    if (label > std::min(largest, 255)) {
      glb.Fail(fmt::format("has the label {} in a picture, at most {} exist", label, largest));
    }
    map.data[i] = static_cast<std::uint8_t>(label);
  }
  return map;
}

ImageF ReadNormals(const GlbFile& glb, const Json& coded, int size) {
  const ImageF xy = ReadMap(glb, coded, size, 2);
  ImageF normals(size, size, 3);
  ParallelForBlocks(xy.data.size() / 2, 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float x = xy.data[2 * i];
      const float y = xy.data[2 * i + 1];
      const float z2 = 1 - x * x - y * y;
      const float z = std::sqrt(std::max(0.0F, z2));
      const float length = std::sqrt(x * x + y * y + z * z);
      normals.data[3 * i] = x / length;
      normals.data[3 * i + 1] = y / length;
      normals.data[3 * i + 2] = z / length;
    }
  });
  return normals;
}

}  // namespace dyxel::internal
