#include "dyxel/texture/mvv_textures.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/parallel.h"
#include "dyxel/mesh/rasterizer.h"

namespace dyxel {
namespace {

constexpr std::size_t kBlock = 4096;       // texels a task
constexpr float kDepthTolerance = 0.004F;  // metres between a texel and the depth map
constexpr float kDepthJump = 0.03F;        // metres between neighbouring pixels: a depth edge
constexpr float kFullTrust = 0.3F;         // n·v above `grazing` by which the weight reaches 1
constexpr float kNearlyLit = 0.98F;        // λ or cone falloff from which a lamp counts as full
constexpr float kNearlyDark = 0.02F;       // … and below which as none
constexpr float kSaturationMargin = 0.99F;

struct TexelPoints {
  std::vector<Vec3f> position;  // (K) world
  std::vector<Vec3f> normal;    // (K) unit
};

Vec3f Blend(const std::vector<Vec3f>& values, const Triangle& t, const Vec3f& bary) {
  return bary[0] * values[static_cast<std::size_t>(t[0])] +
         bary[1] * values[static_cast<std::size_t>(t[1])] +
         bary[2] * values[static_cast<std::size_t>(t[2])];
}

TexelPoints PointsOf(const Atlas& atlas, const TexelGrid& grid, const PosedSurface& surface) {
  TexelPoints points;
  points.position.resize(grid.count());
  points.normal.resize(grid.count());
  ParallelForBlocks(grid.count(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Triangle& t = atlas.triangles[static_cast<std::size_t>(grid.triangle[k])];
      points.position[k] = Blend(surface.positions, t, grid.bary[k]);
      points.normal[k] = Blend(surface.normals, t, grid.bary[k]).normalized();
    }
  });
  return points;
}

// What one camera sees of the surface: depth, and how far the next depth edge is.
struct CameraView {
  int width = 0;
  int height = 0;
  std::vector<float> depth;             // metres; 0 for none
  std::vector<std::uint8_t> near_edge;  // 1 within `rim` pixels of a depth edge or the outline

  [[nodiscard]] std::size_t At(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
};

CameraView ViewOf(const Camera& camera,
                  const PosedSurface& surface,
                  std::span<const Triangle> triangles,
                  int rim) {
  std::vector<ScreenVertex> screen(surface.positions.size());
  ParallelForBlocks(screen.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3d x = surface.positions[i].cast<double>();
      const double z = camera.Depth(x);
      screen[i] = {0, 0, 0};
      if (z <= 0) continue;
      const Vec2d p = camera.Project(x);
      screen[i] = {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(1 / z)};
    }
  });
  const VisibilityBuffer buffer = Rasterize(screen, triangles, camera.width, camera.height);
  CameraView view;
  view.width = camera.width;
  view.height = camera.height;
  view.depth.resize(buffer.triangle.size());
  for (std::size_t i = 0; i < view.depth.size(); ++i) {
    view.depth[i] = buffer.triangle[i] < 0 ? 0 : 1 / buffer.inverse_depth[i];
  }
  std::vector<std::uint8_t> edge(view.depth.size(), 0);
  const auto mark = [&](std::size_t a, std::size_t b) {
    const float da = view.depth[a];
    const float db = view.depth[b];
    if ((da > 0) != (db > 0) || std::abs(da - db) > kDepthJump) edge[a] = edge[b] = 1;
  };
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      if (x + 1 < view.width) mark(view.At(x, y), view.At(x + 1, y));
      if (y + 1 < view.height) mark(view.At(x, y), view.At(x, y + 1));
    }
  }
  // Dilation by a square, along rows and then along columns; rim 0 drops nothing.
  view.near_edge.assign(edge.size(), 0);
  if (rim == 0) return view;
  std::vector<std::uint8_t> rows(edge.size(), 0);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      if (edge[view.At(x, y)] == 0) continue;
      for (int i = std::max(0, x - rim + 1); i <= std::min(view.width - 1, x + rim - 1); ++i) {
        rows[view.At(i, y)] = 1;
      }
    }
  }
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      if (rows[view.At(x, y)] == 0) continue;
      for (int j = std::max(0, y - rim + 1); j <= std::min(view.height - 1, y + rim - 1); ++j) {
        view.near_edge[view.At(x, j)] = 1;
      }
    }
  }
  return view;
}

// Whether the depth map agrees that a point at `depth` is the nearest at pixel position p.
bool Sees(const CameraView& view, const Vec2d& p, float depth) {
  const int x0 = static_cast<int>(std::floor(p.x() - 0.5));
  const int y0 = static_cast<int>(std::floor(p.y() - 0.5));
  if (x0 < 0 || y0 < 0 || x0 + 1 >= view.width || y0 + 1 >= view.height) return false;
  float farthest = 0;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const std::size_t at = view.At(x0 + i, y0 + j);
      if (view.near_edge[at] != 0) return false;
      farthest = std::max(farthest, view.depth[at]);
    }
  }
  return farthest > 0 && depth < farthest + kDepthTolerance;
}

// Bilinear colour at pixel position p; false outside the window, at NaN and where a pixel is
// clipped.
bool SampleColour(const Picture& picture, const Vec2d& p, float saturation, Rgb& colour) {
  const double px = p.x() - 0.5 - picture.window.x;
  const double py = p.y() - 0.5 - picture.window.y;
  const int x0 = static_cast<int>(std::floor(px));
  const int y0 = static_cast<int>(std::floor(py));
  if (x0 < 0 || y0 < 0 || x0 + 1 >= picture.image.width || y0 + 1 >= picture.image.height)
    return false;
  const auto fx = static_cast<float>(px - x0);
  const auto fy = static_cast<float>(py - y0);
  colour = Rgb::Zero();
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const float w = (i == 1 ? fx : 1 - fx) * (j == 1 ? fy : 1 - fy);
      const float* c = &picture.image.At(x0 + i, y0 + j);
      if (std::max({c[0], c[1], c[2]}) >= saturation * kSaturationMargin) return false;
      colour += w * Rgb(c[0], c[1], c[2]);
    }
  }
  return std::isfinite(colour[0]) && std::isfinite(colour[1]) && std::isfinite(colour[2]);
}

}  // namespace

ShadowMap MakeShadowMap(const Light& light,
                        std::span<const Vec3f> positions,
                        std::span<const Triangle> triangles,
                        int size) {
  if (light.type == LightType::kDirectional) {
    return ShadowMap::FromDirection((-light.direction).cast<float>(), positions, triangles, size);
  }
  return ShadowMap::FromPoint(light.position.cast<float>(), positions, triangles, size);
}

MvvTextures MakeMvvTextures(const Atlas& atlas,
                            const TexelGrid& grid,
                            const PosedSurface& surface,
                            std::span<const Camera> cameras,
                            std::span<const Picture> pictures,
                            std::span<const Light> lights,
                            std::span<const float> saturation,
                            const TextureOptions& options) {
  CheckOptions("textures", options);
  const TexelPoints points = PointsOf(atlas, grid, surface);
  const std::size_t num_texels = grid.count();
  MvvTextures textures;
  textures.light_visibility.assign(lights.size(), std::vector<float>(num_texels, 0.0F));
  // A texel in a penumbra or in a cone's falloff is lit by who knows how much: no sample counts.
  std::vector<std::uint8_t> doubtful(num_texels, 0);
  for (std::size_t l = 0; l < lights.size(); ++l) {
    const ShadowMap shadow =
        MakeShadowMap(lights[l], surface.positions, atlas.triangles, options.shadow_size);
    ParallelForBlocks(num_texels, kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const Illumination light = Illuminate(lights[l], points.position[k]);
        if (light.cone <= kNearlyDark || points.normal[k].dot(light.to_light) <= 0) continue;
        const float visible = shadow.Visible(points.position[k], points.normal[k]);
        if (visible <= kNearlyDark) continue;
        if (visible < kNearlyLit || light.cone < kNearlyLit) doubtful[k] = 1;
        textures.light_visibility[l][k] = visible < kNearlyLit ? visible : 1.0F;
      }
    });
  }

  const auto grazing = static_cast<float>(options.grazing);
  textures.radiance.resize(cameras.size());
  textures.weight.resize(cameras.size());
  ParallelFor(cameras.size(), [&](std::size_t c) {
    std::vector<float>& radiance = textures.radiance[c];
    std::vector<float>& weight = textures.weight[c];
    radiance.assign(3 * num_texels, 0.0F);
    weight.assign(num_texels, 0.0F);
    if (pictures[c].image.empty()) return;
    const Camera& camera = cameras[c];
    const CameraView view = ViewOf(camera, surface, atlas.triangles, options.rim);
    const Vec3f centre = camera.Center().cast<float>();
    ParallelForBlocks(num_texels, kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const Vec3f& x = points.position[k];
        const float facing = points.normal[k].dot((centre - x).normalized());
        if (facing <= grazing) continue;
        const Vec3d world = x.cast<double>();
        const double depth = camera.Depth(world);
        if (depth <= 0) continue;
        const Vec2d p = camera.Project(world);
        if (!Sees(view, p, static_cast<float>(depth))) continue;
        Rgb colour;
        if (!SampleColour(pictures[c], p, saturation[c], colour)) continue;
        for (std::size_t i = 0; i < 3; ++i) radiance[3 * k + i] = colour[static_cast<int>(i)];
        if (doubtful[k] == 0) weight[k] = std::min(1.0F, (facing - grazing) / kFullTrust);
      }
    });
  });
  return textures;
}

void FillDyxelFrame(const Atlas& atlas,
                    const TexelGrid& grid,
                    const PosedSurface& surface,
                    std::span<const Camera> cameras,
                    std::span<const Light> lights,
                    const MvvTextures& textures,
                    int first_texture_texel,
                    int frame,
                    DyxelTile& tile) {
  std::vector<Vec3f> centres;
  for (const Camera& camera : cameras) centres.push_back(camera.Center().cast<float>());
  for (int t = 0; t < tile.texels; ++t) {
    const auto k = static_cast<std::size_t>(tile.first_texel + t);
    const auto s = static_cast<std::size_t>(tile.first_texel + t - first_texture_texel);
    const Triangle& triangle = atlas.triangles[static_cast<std::size_t>(grid.triangle[k])];
    const Vec3f x = Blend(surface.positions, triangle, grid.bary[k]);
    const Mat3f tangent_from_world = TangentFrame(surface, triangle, grid.bary[k]).transpose();
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const Illumination light = Illuminate(lights[l], x);
      const Vec3f direction = tangent_from_world * light.to_light;
      for (int i = 0; i < 3; ++i) {
        tile.LightDir(frame, static_cast<int>(l), i)[t] = direction[i];
        tile.Irradiance(frame, static_cast<int>(l), i)[t] =
            light.irradiance[i] * textures.light_visibility[l][s];
      }
    }
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      const Vec3f direction = tangent_from_world * (centres[c] - x).normalized();
      for (int i = 0; i < 3; ++i) {
        tile.ViewDir(frame, static_cast<int>(c), i)[t] = direction[i];
        tile.Radiance(frame, static_cast<int>(c), i)[t] =
            textures.radiance[c][3 * s + static_cast<std::size_t>(i)];
      }
      tile.Weight(frame, static_cast<int>(c))[t] = textures.weight[c][s];
    }
  }
}

}  // namespace dyxel
