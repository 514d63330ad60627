#include "dyxel/capture/picture_check.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include <xxhash.h>

#include "dyxel/base/error.h"
#include "dyxel/image/sampling.h"

namespace dyxel::internal {
namespace {

// The 99.5th percentile by a histogram over the upper bits of the floats: to 0.8 %.
class Percentile {
 public:
  void Add(float value) {
    ++count_;
    if (value > 0) ++bins_[std::bit_cast<std::uint32_t>(value) >> kShift];
  }
  [[nodiscard]] double At(double share) const {
    auto above = static_cast<double>(count_) * (1 - share);
    for (std::size_t i = bins_.size(); i-- > 0;) {
      above -= bins_[i];
      if (above < 0) {
        const auto bits = static_cast<std::uint32_t>(i) << kShift | (1U << (kShift - 1));
        return static_cast<double>(std::bit_cast<float>(bits));
      }
    }
    return 0;
  }

 private:
  static constexpr unsigned kShift = 16;
  std::vector<std::uint32_t> bins_ = std::vector<std::uint32_t>(1U << (31 - kShift));
  std::size_t count_ = 0;
};

// check(), or what it threw as a fault.
template <class Check>
PictureCheck Guarded(const std::filesystem::path& path, Check&& check) {
  PictureCheck fault;
  try {
    return check();
  } catch (const Error& error) {
    // "FILE: WHAT. MEND." without the file and the last stop: the item has them.
    std::string text = error.what();
    const std::string prefix = path.string() + ": ";
    if (text.rfind(prefix, 0) == 0) text.erase(0, prefix.size());
    const std::size_t stop = text.rfind(". ");
    fault.what = text.substr(0, stop);
    if (stop != std::string::npos) fault.mend = text.substr(stop + 2);
    if (!fault.mend.empty() && fault.mend.back() == '.') fault.mend.pop_back();
  } catch (const std::exception& error) {
    fault.what = fmt::format("can't be read ({})", error.what());
    fault.mend = "Copy the file again from where it was made";
  }
  return fault;
}

}  // namespace

PictureCheck CheckStored(const StoredPicture& picture,
                         const Camera& camera,
                         const Sequence& sequence) {
  PictureCheck check;
  if (camera.width > 0 && camera.height > 0 &&
      (picture.width != camera.width || picture.height != camera.height)) {
    check.what = fmt::format("is {}x{} pixels, the camera {} {}x{}",
                             picture.width,
                             picture.height,
                             camera.name,
                             camera.width,
                             camera.height);
    check.mend = "Mend the size in capture.json, or the picture";
    return check;
  }
  // Clipped: the type's largest code, or a smaller white level of 16 bits; half-float's largest.
  double white = picture.white_level;
  double clipped = picture.is_float ? 65504 : picture.white_level;
  if (!picture.is_float && sequence.white_level > 0) {
    white = sequence.white_level;
    if (picture.white_level > 255 && white <= 255) {
      white *= 257;  // a video's, see ReadFrame
    } else if (picture.white_level > 255) {
      clipped = std::min(clipped, white);
    }
  }
  const auto limit = static_cast<float>(clipped);
  const auto scale = static_cast<float>(1 / white);
  Percentile percentile;
  std::size_t saturated = 0;
  std::size_t not_finite = 0;
  const std::vector<float>& data = picture.image.data;
  const std::size_t pixels = data.size() / 3;
  const std::size_t step = pixels > 200'000 ? 7 : 1;  // a percentile needs no more
  for (std::size_t i = 0; i < pixels; ++i) {
    bool finite = true;
    bool full = false;
    for (std::size_t c = 0; c < 3; ++c) {
      const float value = data[3 * i + c];
      finite = finite && std::isfinite(value);
      full = full || value >= limit;
    }
    saturated += full && finite ? 1 : 0;
    not_finite += finite ? 0 : 1;
    if (!finite || i % step != 0) continue;
    for (std::size_t c = 0; c < 3; ++c) percentile.Add(data[3 * i + c]);
  }
  check.read = true;
  const auto count = static_cast<double>(std::max<std::size_t>(1, pixels));
  check.saturated = static_cast<double>(saturated) / count;
  check.not_finite = static_cast<double>(not_finite) / count;
  const float exposure = static_cast<float>(percentile.At(0.995)) * scale;
  check.exposure = static_cast<double>(sequence.srgb ? LinearFromSrgb(exposure) : exposure);
  check.hash = XXH3_64bits(data.data(), data.size() * sizeof(float));
  return check;
}

PictureCheck CheckPicture(const std::filesystem::path& path,
                          const Camera& camera,
                          const Sequence& sequence) {
  return Guarded(path, [&] { return CheckStored(ReadPicture(path), camera, sequence); });
}

PictureCheck CheckMask(const std::filesystem::path& path, const Camera& camera) {
  return Guarded(path, [&] {
    const ImageU8 mask = ReadPngMask(path);
    PictureCheck check;
    if (camera.width > 0 && camera.height > 0 &&
        (mask.width != camera.width || mask.height != camera.height)) {
      check.what = fmt::format("is {}x{} pixels, the camera {} {}x{}",
                               mask.width,
                               mask.height,
                               camera.name,
                               camera.width,
                               camera.height);
      check.mend = "A mask must have the size of its picture";
      return check;
    }
    check.read = true;
    const auto inside = std::count_if(
        mask.data.begin(), mask.data.end(), [](std::uint8_t value) { return value >= 128; });
    if (inside == 0 || inside == static_cast<std::ptrdiff_t>(mask.data.size())) {
      check.what = inside == 0 ? "no pixel of the mask is inside" : "all pixels are inside";
      check.mend = "Check it: 255 is the person, 0 the rest";
    }
    return check;
  });
}

}  // namespace dyxel::internal
