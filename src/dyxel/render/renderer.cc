// The renderer: project the vertices, rasterize the visibility of s × s samples a pixel within the
// surface's window, then tile by tile gather the attributes of the covered samples, look up the
// maps, shade in blocks and average.
#include "dyxel/render/renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "dyxel/base/error.h"
#include "dyxel/base/lanes.h"
#include "dyxel/base/parallel.h"
#include "dyxel/mesh/rasterizer.h"
#include "dyxel/mesh/shadow_map.h"
#include "dyxel/render/prepared_lighting.h"
#include "dyxel/render/shade.h"
#include "dyxel/render/surface_samples.h"

namespace dyxel {
namespace {

using internal::kShadeBlock;
using internal::PackedSurface;
using internal::ScreenSurface;
using internal::ShadeBlock;

constexpr int kTile = 32;  // pixels a side
constexpr std::array<const char*, 8> kPassNames = {
    "beauty", "normal", "diffuse", "specular", "depth", "material", "uv", "confidence"};

std::size_t Size(int n) { return static_cast<std::size_t>(n); }

// How a pass's samples become a pixel.
enum class Average { kPremultiplied, kCovered, kFirst };
Average AverageOf(Pass pass) {
  switch (pass) {
    case Pass::kNormal:
    case Pass::kDepth:
      return Average::kCovered;
    case Pass::kMaterial:
    case Pass::kUv:
      return Average::kFirst;
    default:
      return Average::kPremultiplied;
  }
}

void CheckSurface(const RenderSurface& s) {
  Require(s.atlas != nullptr && s.surface != nullptr && s.maps != nullptr,
          Fault::kUsage,
          "RenderSurface: atlas, surface and maps must be given");
  const auto check = [&](const auto& image, int channels, const char* name) {
    Require(image.width == s.atlas->size && image.height == s.atlas->size &&
                (channels == 0 ? image.channels >= 1 : image.channels == channels),
            Fault::kUsage,
            "RenderSurface: the {} map is {}x{}x{}, the atlas has {} texels a side",
            name,
            image.width,
            image.height,
            image.channels,
            s.atlas->size);
  };
  check(s.maps->diffuse, 3, "diffuse");
  check(s.maps->specular, 0, "specular");
  Require(s.maps->specular.channels <= internal::kMaxSpecular,
          Fault::kUsage,
          "RenderSurface: {} specular parameters, at most {} are known",
          s.maps->specular.channels,
          internal::kMaxSpecular);
  if (s.normal_map != nullptr) check(*s.normal_map, 3, "normal");
  if (!s.maps->material.empty()) check(s.maps->material, 1, "material");
  if (!s.maps->confidence.empty()) check(s.maps->confidence, 1, "confidence");
  const std::size_t n = s.surface->positions.size();
  Require(s.atlas->uv_i.size() == n && s.surface->normals.size() == n &&
              s.surface->tangents.size() == n && s.surface->handedness.size() == n,
          Fault::kUsage,
          "RenderSurface: the atlas has {} vertices, the surface {}",
          s.atlas->uv_i.size(),
          n);
}

// Renders the tiles of one picture. All that is shared between tiles is constant.
class TileRenderer {
 public:
  TileRenderer(const RenderSurface& surface,
               const PackedSurface& packed,
               const ScreenSurface& screen,
               const PreparedLighting::Data& lighting,
               std::span<const Pass> passes,
               std::vector<ImageF>& pictures)
      : surface_(surface),
        packed_(packed),
        screen_(screen),
        lighting_(lighting),
        passes_(passes),
        pictures_(pictures) {}

  // The pixels [x0, x1) × [y0, y1) of the screen's window.
  void Render(int x0, int y0, int x1, int y1) const {
    Tile tile;
    tile.x0 = x0;
    tile.y0 = y0;
    tile.width = x1 - x0;
    tile.sums.assign(passes_.size() * Size(kTile * kTile), {});
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) AddPixel(x, y, tile);
    }
    Flush(tile);
    Write(tile, x1, y1);
  }

 private:
  struct Tile {
    int x0 = 0, y0 = 0, width = 0;
    std::array<int, kTile* kTile> covered = {};
    std::vector<std::array<float, 3>> sums;  // [pass][pixel]
    internal::SampleBlock samples;
    ShadeBlock shade = {};
  };

  void AddPixel(int x, int y, Tile& tile) const {
    const int s = screen_.samples;
    for (int sy = y * s; sy < (y + 1) * s; ++sy) {
      for (int sx = x * s; sx < (x + 1) * s; ++sx) {
        const std::int32_t triangle =
            screen_.visibility.triangle[Size(sy) * Size(screen_.visibility.width) + Size(sx)];
        if (triangle < 0) continue;
        internal::SampleBlock& block = tile.samples;
        const std::size_t i = Size(block.count++);
        block.pixel[i] = (y - tile.y0) * kTile + (x - tile.x0);
        block.triangle[i] = triangle;
        block.x[i] = sx;
        block.y[i] = sy;
        if (block.count == kShadeBlock) Flush(tile);
      }
    }
  }

  void Flush(Tile& tile) const {
    if (tile.samples.count == 0) return;
    internal::GatherSamples<Lanes>(surface_, packed_, screen_, tile.samples, tile.shade);
    for (std::size_t p = 0; p < passes_.size(); ++p) {
      if (passes_[p] == Pass::kBeauty) {
        internal::Shade<Lanes>(
            surface_.maps->model, lighting_.shade_lights, lighting_.shadows, tile.shade);
      }
    }
    for (std::size_t i = 0; i < Size(tile.samples.count); ++i) {
      const std::size_t pixel = Size(tile.samples.pixel[i]);
      const bool first = tile.covered[pixel]++ == 0;
      for (std::size_t p = 0; p < passes_.size(); ++p) {
        if (AverageOf(passes_[p]) == Average::kFirst && !first) continue;
        const std::array<float, 3> value = Value(passes_[p], tile, i);
        std::array<float, 3>& sum = tile.sums[p * Size(kTile * kTile) + pixel];
        for (std::size_t c = 0; c < 3; ++c) sum[c] += value[c];
      }
    }
    tile.samples.count = 0;
  }

  [[nodiscard]] std::array<float, 3> Value(Pass pass, const Tile& tile, std::size_t i) const {
    const ShadeBlock& s = tile.shade;
    const internal::SampleBlock& b = tile.samples;
    switch (pass) {
      case Pass::kBeauty:
        return {s.radiance[0][i], s.radiance[1][i], s.radiance[2][i]};
      case Pass::kNormal:
        return {s.normal[0][i], s.normal[1][i], s.normal[2][i]};
      case Pass::kDiffuse:
        return {s.diffuse[0][i], s.diffuse[1][i], s.diffuse[2][i]};
      case Pass::kSpecular: {
        std::array<float, 3> value = {};
        const int n = std::min(3, surface_.maps->specular.channels);
        for (std::size_t c = 0; c < Size(n); ++c) value[c] = s.specular[c][i];
        return value;
      }
      case Pass::kDepth:
        return {b.depth[i], b.depth[i], b.depth[i]};
      case Pass::kUv:
        return {b.u[i], b.v[i], 0};
      case Pass::kMaterial: {
        const auto m =
            static_cast<float>(internal::NearestTexel(surface_.maps->material, b.u[i], b.v[i]));
        return {m, m, m};
      }
      case Pass::kConfidence: {
        float c = 0;
        if (!surface_.maps->confidence.empty()) {
          internal::Bilinear(surface_.maps->confidence, b.u[i], b.v[i], &c);
        }
        return {c, c, c};
      }
    }
    return {};
  }

  void Write(const Tile& tile, int x1, int y1) const {
    const float samples = static_cast<float>(screen_.samples * screen_.samples);
    for (int y = tile.y0; y < y1; ++y) {
      for (int x = tile.x0; x < x1; ++x) {
        const std::size_t pixel = Size((y - tile.y0) * kTile + (x - tile.x0));
        if (tile.covered[pixel] == 0) continue;
        const auto covered = static_cast<float>(tile.covered[pixel]);
        for (std::size_t p = 0; p < passes_.size(); ++p) {
          const Average average = AverageOf(passes_[p]);
          float scale = 1 / samples;
          if (average == Average::kCovered) scale = 1 / covered;
          if (average == Average::kFirst) scale = 1;
          const std::array<float, 3>& sum = tile.sums[p * Size(kTile * kTile) + pixel];
          if (passes_[p] == Pass::kNormal) {
            const float length = std::hypot(sum[0], sum[1], sum[2]);
            scale = length > 0 ? 1 / length : 0;
          }
          float* out = &pictures_[p].At(x + screen_.window.x, y + screen_.window.y);
          for (std::size_t c = 0; c < 3; ++c) out[c] = sum[c] * scale;
          out[3] = covered / samples;
        }
      }
    }
  }

  const RenderSurface& surface_;
  const PackedSurface& packed_;
  const ScreenSurface& screen_;
  const PreparedLighting::Data& lighting_;
  std::span<const Pass> passes_;
  std::vector<ImageF>& pictures_;
};

}  // namespace

Pass ParsePass(const std::string& name) {
  for (std::size_t i = 0; i < kPassNames.size(); ++i) {
    if (name == kPassNames[i]) return static_cast<Pass>(i);
  }
  throw Error(Fault::kUsage,
              fmt::format("unknown pass '{}': one of {}", name, fmt::join(kPassNames, ", ")));
}

const char* PassName(Pass pass) { return kPassNames.at(static_cast<std::size_t>(pass)); }

PreparedLighting::PreparedLighting(const RenderSurface& surface,
                                   const Lighting& lighting,
                                   const RenderOptions& options)
    : data_(std::make_unique<Data>()) {
  CheckOptions("render", options);
  CheckSurface(surface);
  std::vector<Light> lights = lighting.lights;
  if (lighting.environment) {
    for (const Light& l : SampleEnvironment(*lighting.environment, options.environment_lights)) {
      lights.push_back(l);
    }
  }
  for (const Light& light : lights) data_->shade_lights.push_back(internal::MakeShadeLight(light));
  data_->shadows.resize(lights.size());
  const std::vector<Vec3f>& positions = surface.surface->positions;
  const std::vector<Triangle>& triangles = surface.atlas->triangles;
  ParallelFor(lights.size(), [&](std::size_t j) {
    const bool sampled = j >= lighting.lights.size();
    const int size = sampled ? options.environment_shadow_size : options.shadow_size;
    data_->shadows[j] =
        lights[j].type == LightType::kDirectional
            ? ShadowMap::FromDirection(
                  -lights[j].direction.normalized().cast<float>(), positions, triangles, size)
            : ShadowMap::FromPoint(lights[j].position.cast<float>(), positions, triangles, size);
  });
}
PreparedLighting::~PreparedLighting() = default;
PreparedLighting::PreparedLighting(PreparedLighting&&) noexcept = default;
PreparedLighting& PreparedLighting::operator=(PreparedLighting&&) noexcept = default;

std::vector<ImageF> RenderPasses(const RenderSurface& surface,
                                 const Camera& camera,
                                 const PreparedLighting& lighting,
                                 std::span<const Pass> passes,
                                 const RenderOptions& options) {
  CheckOptions("render", options);
  CheckSurface(surface);
  std::vector<ImageF> pictures;
  for (std::size_t p = 0; p < passes.size(); ++p) {
    Require(passes[p] != Pass::kMaterial || !surface.maps->material.empty(),
            Fault::kUsage,
            "the pass 'material' asks for a material map, and the maps have none");
    pictures.emplace_back(camera.width, camera.height, 4);
  }
  const PackedSurface packed = internal::PackSurface(surface);
  const ScreenSurface screen = internal::ProjectSurface(surface, camera, options.samples);
  const int across = (screen.window.width + kTile - 1) / kTile;
  const int down = (screen.window.height + kTile - 1) / kTile;
  const TileRenderer renderer(surface, packed, screen, lighting.data(), passes, pictures);
  ParallelFor(Size(across) * Size(down), [&](std::size_t t) {
    const int x = static_cast<int>(t) % across * kTile;
    const int y = static_cast<int>(t) / across * kTile;
    renderer.Render(
        x, y, std::min(x + kTile, screen.window.width), std::min(y + kTile, screen.window.height));
  });
  return pictures;
}

ImageF Render(const RenderSurface& surface,
              const Camera& camera,
              const Lighting& lighting,
              Pass pass,
              const RenderOptions& options) {
  // Only the beauty pass needs light.
  const PreparedLighting prepared(surface, pass == Pass::kBeauty ? lighting : Lighting{}, options);
  return std::move(RenderPasses(surface, camera, prepared, std::span(&pass, 1), options).front());
}

}  // namespace dyxel
