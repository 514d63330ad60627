// The format as Ward describes it in "Real Pixels", Graphics Gems II, 1991.
#include "dyxel/image/rgbe.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/image/picture_limits.h"

namespace dyxel {
namespace {

using Rgbe = std::array<unsigned char, 4>;

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path), bytes_(ReadFile(path)) {}

  [[nodiscard]] Error Damaged(const std::string& what) const {
    return FileError(
        path_, "is no readable Radiance picture: " + what, "Copy it again, or convert it to EXR");
  }
  unsigned char Byte() {
    if (position_ >= bytes_.size()) throw Damaged("it ends too early");
    return static_cast<unsigned char>(bytes_[position_++]);
  }
  std::string Line() {
    const std::size_t end = bytes_.find('\n', position_);
    if (end == std::string::npos) throw Damaged("its header has no end");
    std::string line = bytes_.substr(position_, end - position_);
    position_ = end + 1;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    return line;
  }

  // One line of pixels, whichever way it is packed.
  void Scanline(std::vector<Rgbe>& line) {
    const std::size_t width = line.size();
    Rgbe first;
    for (unsigned char& byte : first) byte = Byte();
    const bool packed = first[0] == 2 && first[1] == 2 && first[2] < 128 && width >= 8;
    if (!packed) {
      Flat(first, line);
      return;
    }
    if (static_cast<std::size_t>(first[2] << 8U | first[3]) != width) {
      throw Damaged("a line has another length than the picture");
    }
    for (std::size_t c = 0; c < 4; ++c) {
      std::size_t x = 0;
      while (x < width) {
        std::size_t count = Byte();
        const bool run = count > 128;
        if (run) count -= 128;
        if (count == 0 || count > width - x) throw Damaged("a run is longer than its line");
        unsigned char value = run ? Byte() : std::uint8_t{0};
        for (; count > 0; --count) line[x++][c] = run ? value : Byte();
      }
    }
  }

 private:
  // Pixels one by one; (1, 1, 1, n) repeats the last one n times, shifted by 8 bits each time that
  // two follow each other.
  void Flat(Rgbe pixel, std::vector<Rgbe>& line) {
    std::size_t x = 0;
    unsigned shift = 0;
    while (true) {
      if (pixel[0] == 1 && pixel[1] == 1 && pixel[2] == 1) {
        const std::size_t count = std::size_t{pixel[3]} << shift;
        if (x == 0 || count > line.size() - x) throw Damaged("a run is longer than its line");
        const Rgbe last = line[x - 1];
        std::fill_n(line.begin() + static_cast<std::ptrdiff_t>(x), count, last);
        x += count;
        shift = std::min(shift + 8U, 24U);
      } else {
        line[x++] = pixel;
        shift = 0;
      }
      if (x >= line.size()) return;
      for (unsigned char& byte : pixel) byte = Byte();
    }
  }

  std::filesystem::path path_;
  std::string bytes_;
  std::size_t position_ = 0;
};

}  // namespace

ImageF ReadRgbe(const std::filesystem::path& path) {
  Reader reader(path);
  if (reader.Line().rfind("#?", 0) != 0) throw reader.Damaged("its first line is not #?RADIANCE");
  float exposure = 1;
  for (std::string line = reader.Line(); !line.empty(); line = reader.Line()) {
    if (line.rfind("FORMAT=", 0) == 0 && line.find("32-bit_rle_rgbe") == std::string::npos) {
      throw reader.Damaged("its " + line + " is not supported");
    }
    float value = 1;
    if (std::sscanf(line.c_str(), "EXPOSURE=%f", &value) == 1 && value > 0) exposure *= value;
  }
  const std::string size = reader.Line();
  char y_sign = 0;
  char x_sign = 0;
  int width = 0;
  int height = 0;
  if (std::sscanf(size.c_str(), "%cY %d %cX %d", &y_sign, &height, &x_sign, &width) != 4) {
    throw reader.Damaged("its size line, \"" + size + "\", is not supported");
  }
  if (width < 1 || height < 1 || std::int64_t{width} * height > internal::kMaxPixels) {
    throw reader.Damaged("its size, \"" + size + "\", is impossible");
  }
  ImageF image(width, height, 3);
  std::vector<Rgbe> line(static_cast<std::size_t>(width));
  for (int row = 0; row < height; ++row) {
    reader.Scanline(line);
    const int y = y_sign == '+' ? height - 1 - row : row;
    for (int column = 0; column < width; ++column) {
      const Rgbe& pixel = line[static_cast<std::size_t>(column)];
      const int x = x_sign == '-' ? width - 1 - column : column;
      if (pixel[3] == 0) continue;
      const float scale = std::ldexp(1.0F, static_cast<int>(pixel[3]) - 136) / exposure;
      for (int c = 0; c < 3; ++c) {
        image.At(x, y, c) = static_cast<float>(pixel[static_cast<std::size_t>(c)]) * scale;
      }
    }
  }
  return image;
}

}  // namespace dyxel
