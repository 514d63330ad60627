#include "dyxel/texture/texture_files.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <mutex>

#include <half.h>
#include <tbb/task_arena.h>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/image/exr.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

constexpr int kTileTexels = 16384;
constexpr std::size_t kTileBytes = std::size_t{192}
                                   << 20U;  // of a tile's samples: RES of 40 frames
constexpr std::size_t kKeptBytes = std::size_t{384} << 20U;  // of unpacked tiles, for later passes
const std::vector<std::string> kTextureChannels = {"R", "G", "B", "A"};

std::vector<std::string> LightChannels(std::size_t count) {
  std::vector<std::string> names;
  for (std::size_t l = 0; l < count; ++l) names.push_back(fmt::format("light{:03}", l));
  return names;
}

ImageF ReadRows(
    const fs::path& file, int size, int y0, int y1, const std::vector<std::string>& channels) {
  const ExrImage rows = ReadExrRows(file, y0, y1, channels);
  if (rows.image.width != size || rows.image.height != y1 - y0) {
    throw FileError(file, "is not of the atlas' size", "Delete the folder textures/ and run again");
  }
  return rows.image;
}

// One time step's textures over a tile, without the texels that a camera has no sample of: fits go
// over all samples several times, and unpacking the files is what costs most.
class KeptTextures {
 public:
  explicit KeptTextures(const MvvTextures& textures) : samples_(textures.weight.size()) {
    for (std::size_t c = 0; c < samples_.size(); ++c) {
      for (std::size_t k = 0; k < textures.weight[c].size(); ++k) {
        if (textures.weight[c][k] <= 0) continue;
        const float* const colour = &textures.radiance[c][3 * k];
        samples_[c].push_back(
            {static_cast<std::uint16_t>(k),
             {half(colour[0]), half(colour[1]), half(colour[2]), half(textures.weight[c][k])}});
      }
      samples_[c].shrink_to_fit();
    }
    for (const std::vector<float>& visible : textures.light_visibility) {
      light_visibility_.emplace_back(visible.begin(), visible.end());
    }
  }

  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = 0;
    for (const auto& samples : samples_) sum += samples.size() * sizeof(Sample);
    for (const auto& visible : light_visibility_) sum += visible.size() * sizeof(half);
    return sum;
  }

  // As read from the files, but for the colours of texels without weight.
  [[nodiscard]] MvvTextures Unpack(std::size_t count) const {
    MvvTextures textures;
    textures.radiance.assign(samples_.size(), std::vector<float>(3 * count));
    textures.weight.assign(samples_.size(), std::vector<float>(count));
    for (std::size_t c = 0; c < samples_.size(); ++c) {
      for (const Sample& sample : samples_[c]) {
        for (std::size_t i = 0; i < 3; ++i) {
          textures.radiance[c][3 * std::size_t{sample.texel} + i] = sample.values[i];
        }
        textures.weight[c][sample.texel] = sample.values[3];
      }
    }
    for (const auto& visible : light_visibility_) {
      textures.light_visibility.emplace_back(visible.begin(), visible.end());
    }
    return textures;
  }

 private:
  struct Sample {
    std::uint16_t texel;
    std::array<half, 4> values;
  };
  std::vector<std::vector<Sample>> samples_;         // [camera]
  std::vector<std::vector<half>> light_visibility_;  // [light][texel]
};

}  // namespace

std::vector<fs::path> MvvTextureFiles(const fs::path& folder,
                                      std::span<const std::string> camera_names) {
  std::vector<fs::path> files;
  for (const std::string& name : camera_names) files.push_back(folder / (name + ".exr"));
  files.push_back(folder / "lights.exr");
  return files;
}

void WriteMvvTextures(const fs::path& folder,
                      std::span<const std::string> camera_names,
                      const TexelGrid& grid,
                      const MvvTextures& textures) {
  const std::vector<fs::path> files = MvvTextureFiles(folder, camera_names);
  const std::size_t num_lights = textures.light_visibility.size();
  ParallelFor(files.size(), [&](std::size_t i) {
    const bool is_camera = i < camera_names.size();
    const int channels = is_camera ? 4 : std::max(1, static_cast<int>(num_lights));
    ImageF map(grid.size, grid.size, channels);
    for (std::size_t k = 0; k < grid.count(); ++k) {
      float* to =
          &map.data[static_cast<std::size_t>(grid.pixel[k]) * static_cast<std::size_t>(channels)];
      if (is_camera) {
        std::copy_n(&textures.radiance[i][3 * k], 3, to);
        to[3] = textures.weight[i][k];
      } else {
        for (std::size_t l = 0; l < num_lights; ++l) to[l] = textures.light_visibility[l][k];
      }
    }
    WriteExr(files[i],
             map,
             is_camera ? kTextureChannels : LightChannels(static_cast<std::size_t>(channels)),
             ExrType::kHalf,
             ExrPacking::kLine);
  });
}

MvvTextures ReadMvvTextures(const fs::path& folder,
                            std::span<const std::string> camera_names,
                            int num_lights,
                            const TexelGrid& grid,
                            int begin,
                            int end) {
  const auto count = static_cast<std::size_t>(end - begin);
  MvvTextures textures;
  textures.radiance.assign(camera_names.size(), std::vector<float>(3 * count));
  textures.weight.assign(camera_names.size(), std::vector<float>(count));
  textures.light_visibility.assign(static_cast<std::size_t>(num_lights), std::vector<float>(count));
  if (count == 0) return textures;
  const int y0 = grid.pixel[static_cast<std::size_t>(begin)] / grid.size;
  const int y1 = grid.pixel[static_cast<std::size_t>(end - 1)] / grid.size + 1;
  const auto offset = static_cast<std::size_t>(y0) * static_cast<std::size_t>(grid.size);
  const auto at = [&](std::size_t i) {
    return static_cast<std::size_t>(grid.pixel[static_cast<std::size_t>(begin) + i]) - offset;
  };
  const std::vector<fs::path> files = MvvTextureFiles(folder, camera_names);
  const auto read = [&](std::size_t c) {
    const ImageF rows = ReadRows(files[c], grid.size, y0, y1, kTextureChannels);
    for (std::size_t i = 0; i < count; ++i) {
      const float* from = &rows.data[4 * at(i)];
      std::copy_n(from, 3, &textures.radiance[c][3 * i]);
      textures.weight[c][i] = from[3];
    }
  };
  // Isolated: a thread that waits here must not begin another tile, each of which is large.
  tbb::this_task_arena::isolate([&] { ParallelFor(camera_names.size(), read); });
  if (num_lights == 0) return textures;
  const ImageF rows = ReadRows(
      files.back(), grid.size, y0, y1, LightChannels(static_cast<std::size_t>(num_lights)));
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t l = 0; l < static_cast<std::size_t>(num_lights); ++l) {
      textures.light_visibility[l][i] = rows.data[at(i) * static_cast<std::size_t>(num_lights) + l];
    }
  }
  return textures;
}

DyxelSource MakeDyxelSource(const Atlas& atlas,
                            const TexelGrid& grid,
                            std::vector<Camera> cameras,
                            std::vector<DyxelStep> steps) {
  // Long sequences get smaller tiles: every thread holds one.
  std::size_t num_lights = 0;
  for (const DyxelStep& step : steps) num_lights = std::max(num_lights, step.lights.size());
  const std::size_t texel_bytes = std::max<std::size_t>(1, steps.size()) *
                                  (6 * num_lights + 7 * cameras.size()) * sizeof(float);
  const int tile_texels = static_cast<int>(std::min<std::size_t>(
      kTileTexels, std::max<std::size_t>(1, kTileBytes / std::max<std::size_t>(1, texel_bytes))));
  DyxelSource source;
  source.num_texels = static_cast<int>(grid.count());
  source.tile_begin = {0};
  for (int k = 1; k <= source.num_texels; ++k) {
    const bool row_ends =
        k == source.num_texels || grid.pixel[static_cast<std::size_t>(k)] / grid.size !=
                                      grid.pixel[static_cast<std::size_t>(k - 1)] / grid.size;
    if (row_ends && (k - source.tile_begin.back() >= tile_texels || k == source.num_texels)) {
      source.tile_begin.push_back(k);
    }
  }
  struct Shared {
    std::vector<Camera> cameras;
    std::vector<std::string> camera_names;
    std::vector<DyxelStep> steps;
    std::size_t num_lights = 0;
    // Tiles that were read before, [tile][step], as long as they are not too many.
    std::mutex mutex;
    std::vector<std::shared_ptr<const std::vector<KeptTextures>>> kept;
    std::size_t kept_bytes = 0;
  };
  const auto shared = std::make_shared<Shared>();
  for (const Camera& camera : cameras) shared->camera_names.push_back(camera.name);
  shared->cameras = std::move(cameras);
  shared->num_lights = num_lights;
  shared->steps = std::move(steps);
  shared->kept.resize(static_cast<std::size_t>(source.num_tiles()));
  source.load = [shared, &atlas, &grid, begins = source.tile_begin](int index) {
    DyxelTile tile;
    tile.first_texel = begins[static_cast<std::size_t>(index)];
    const int end = begins[static_cast<std::size_t>(index) + 1];
    tile.Resize(end - tile.first_texel,
                static_cast<int>(shared->steps.size()),
                static_cast<int>(shared->cameras.size()),
                static_cast<int>(shared->num_lights));
    std::shared_ptr<const std::vector<KeptTextures>> kept;
    bool keep = false;
    {
      const std::scoped_lock lock(shared->mutex);
      kept = shared->kept[static_cast<std::size_t>(index)];
      keep = !kept && shared->kept_bytes < kKeptBytes;
    }
    std::vector<KeptTextures> read;
    for (std::size_t f = 0; f < shared->steps.size(); ++f) {
      const DyxelStep& step = shared->steps[f];
      const MvvTextures textures = kept ? (*kept)[f].Unpack(static_cast<std::size_t>(tile.texels))
                                        : ReadMvvTextures(step.folder,
                                                          shared->camera_names,
                                                          static_cast<int>(step.lights.size()),
                                                          grid,
                                                          tile.first_texel,
                                                          end);
      if (keep) read.emplace_back(textures);
      FillDyxelFrame(atlas,
                     grid,
                     step.surface,
                     shared->cameras,
                     step.lights,
                     textures,
                     tile.first_texel,
                     static_cast<int>(f),
                     tile);
    }
    if (keep) {
      std::size_t bytes = 0;
      for (const KeptTextures& textures : read) bytes += textures.bytes();
      const std::scoped_lock lock(shared->mutex);
      auto& slot = shared->kept[static_cast<std::size_t>(index)];
      if (!slot && shared->kept_bytes + bytes <= kKeptBytes) {
        shared->kept_bytes += bytes;
        slot = std::make_shared<const std::vector<KeptTextures>>(std::move(read));
      }
    }
    return tile;
  };
  return source;
}

}  // namespace dyxel
