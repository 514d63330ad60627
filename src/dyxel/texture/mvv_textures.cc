#include "dyxel/texture/mvv_textures.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/parallel.h"
#include "dyxel/mesh/rasterizer.h"

namespace dyxel {
namespace {

constexpr std::size_t kBlock = 4096;       // texels a task
constexpr float kDepthTolerance = 0.004F;  // metres between a texel and the depth map
constexpr float kDepthStep = 0.004F;       // metres between neighbouring pixels: perhaps an edge
constexpr float kSlopeFactor = 3;          // … unless the slopes beside it are a third as steep
constexpr float kFullTrust = 0.3F;         // n·v above `grazing` by which the weight reaches 1
constexpr float kNearlyLit = 0.98F;        // λ or cone falloff from which a lamp counts as full
constexpr float kNearlyDark = 0.02F;       // … and below which as none

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

// A camera's projection in single precision, good to 1e-3 px: positions are taken relative to its
// centre first.
class Projector {
 public:
  explicit Projector(const Camera& camera)
      : camera_(camera),
        distorted_(camera.HasDistortion()),
        centre_(camera.Center().cast<float>()),
        cam_from_world_(camera.cam_from_world.rotation.cast<float>()),
        focal_(static_cast<float>(camera.fx), static_cast<float>(camera.fy)),
        principal_(static_cast<float>(camera.cx), static_cast<float>(camera.cy)) {
    if (!distorted_) return;
    for (const double x : {0.0, 0.5, 1.0}) {
      for (const double y : {0.0, 0.5, 1.0}) {
        const Vec3d ray =
            camera.cam_from_world.rotation * camera.Ray({x * camera.width, y * camera.height});
        widest_ = std::max(widest_, static_cast<float>((ray.head<2>() / ray.z()).squaredNorm()));
      }
    }
    widest_ *= 1.5F;
  }

  [[nodiscard]] const Vec3f& centre() const { return centre_; }
  // Pixel position and z of a point; z <= 0, with no position, behind the camera and far outside
  // its view.
  [[nodiscard]] Vec3f operator()(const Vec3f& x) const {
    const Vec3f in_cam = cam_from_world_ * (x - centre_);
    if (in_cam.z() <= 0) return {0, 0, in_cam.z()};
    if (distorted_) {
      // Far outside the picture the distortion's polynomial may fold back into it.
      if (in_cam.head<2>().squaredNorm() > widest_ * in_cam.z() * in_cam.z()) return {0, 0, -1};
      const Vec2d p = camera_.Project(x.cast<double>());
      return {static_cast<float>(p.x()), static_cast<float>(p.y()), in_cam.z()};
    }
    const Vec2f p = focal_.cwiseProduct(in_cam.head<2>()) / in_cam.z() + principal_;
    return {p.x(), p.y(), in_cam.z()};
  }

 private:
  const Camera& camera_;
  bool distorted_;
  Vec3f centre_;
  Mat3f cam_from_world_;
  Vec2f focal_;
  Vec2f principal_;
  float widest_ = 0;  // squared tangent off the axis up to which a distorted camera is used
};

// What one camera sees of the surface, in the part of its picture that the surface covers.
struct CameraView {
  Rect window;                          // pixels
  std::vector<float> inverse_depth;     // 1/m, 0 for none
  std::vector<std::uint8_t> near_edge;  // 1 within `rim` pixels of a depth edge or the outline

  [[nodiscard]] std::size_t At(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(window.width) +
           static_cast<std::size_t>(x);
  }
};

// Marks pixels next to a depth edge: on a smooth surface inverse depth is nearly linear over a few
// pixels, so an edge is a step from one pixel to the next that is longer than kDepthStep and than
// what the slopes on both sides explain.
void MarkEdges(const CameraView& view, std::vector<std::uint8_t>& edge) {
  const int width = view.window.width;
  const int height = view.window.height;
  const auto along = [&](std::size_t first, std::size_t step, int count) {
    const float* const w = view.inverse_depth.data() + first;
    const auto at = [&](int i) { return w[static_cast<std::size_t>(i) * step]; };
    for (int i = 0; i + 1 < count; ++i) {
      const float a = at(i);
      const float b = at(i + 1);
      if (a == 0 && b == 0) continue;
      bool is_edge = a == 0 || b == 0;
      if (!is_edge) {
        const float before = i > 0 && at(i - 1) > 0 ? a - at(i - 1) : 0;
        const float after = i + 2 < count && at(i + 2) > 0 ? at(i + 2) - b : 0;
        const float slope = std::max(std::abs(before), std::abs(after));
        is_edge = std::abs(b - a) > std::max(kDepthStep * a * b, kSlopeFactor * slope);
      }
      if (is_edge) {
        edge[first + static_cast<std::size_t>(i) * step] = 1;
        edge[first + static_cast<std::size_t>(i + 1) * step] = 1;
      }
    }
  };
  for (int y = 0; y < height; ++y) along(view.At(0, y), 1, width);
  for (int x = 0; x < width; ++x) along(view.At(x, 0), static_cast<std::size_t>(width), height);
}

CameraView ViewOf(const Camera& camera,
                  const Projector& project,
                  const PosedSurface& surface,
                  std::span<const Triangle> triangles,
                  int rim) {
  std::vector<ScreenVertex> screen(surface.positions.size());
  ParallelForBlocks(screen.size(), kBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3f p = project(surface.positions[i]);
      screen[i] = {p.x(), p.y(), p.z() > 0 ? 1 / p.z() : 0};
    }
  });
  // The surface's part of the picture, a pixel and the rim more on every side.
  Vec2f low(static_cast<float>(camera.width), static_cast<float>(camera.height));
  Vec2f high = Vec2f::Zero();
  for (const ScreenVertex& v : screen) {
    if (v.inverse_depth <= 0) continue;
    low = low.cwiseMin(Vec2f(v.x, v.y));
    high = high.cwiseMax(Vec2f(v.x, v.y));
  }
  CameraView view;
  const auto margin = static_cast<float>(rim + 2);
  view.window.x = static_cast<int>(std::clamp(low.x() - margin, 0.0F, 1e6F));
  view.window.y = static_cast<int>(std::clamp(low.y() - margin, 0.0F, 1e6F));
  view.window.width =
      std::max(0,
               static_cast<int>(std::min(high.x() + margin, static_cast<float>(camera.width))) -
                   view.window.x);
  view.window.height =
      std::max(0,
               static_cast<int>(std::min(high.y() + margin, static_cast<float>(camera.height))) -
                   view.window.y);
  if (view.window.width == 0 || view.window.height == 0) return view;
  for (ScreenVertex& v : screen) {
    v.x -= static_cast<float>(view.window.x);
    v.y -= static_cast<float>(view.window.y);
  }
  view.inverse_depth = RasterizeDepth(screen, triangles, view.window.width, view.window.height);

  // Edges dilated by a square, along rows and then along columns; rim 0 drops nothing.
  const int width = view.window.width;
  const int height = view.window.height;
  view.near_edge.assign(view.inverse_depth.size(), 0);
  if (rim == 0) return view;
  std::vector<std::uint8_t> edge(view.inverse_depth.size(), 0);
  MarkEdges(view, edge);
  std::vector<std::uint8_t> rows(edge.size(), 0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (edge[view.At(x, y)] == 0) continue;
      const int first = std::max(0, x - rim + 1);
      const int last = std::min(width - 1, x + rim - 1);
      std::fill(&rows[view.At(first, y)], &rows[view.At(last, y)] + 1, std::uint8_t{1});
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int j = std::max(0, y - rim + 1); j <= std::min(height - 1, y + rim - 1); ++j) {
      for (int x = 0; x < width; ++x) view.near_edge[view.At(x, y)] |= rows[view.At(x, j)];
    }
  }
  return view;
}

// Whether the depth map agrees that a point at depth z is the nearest at its pixel position.
bool Sees(const CameraView& view, const Vec3f& p) {
  const int x0 = static_cast<int>(std::floor(p.x() - 0.5F)) - view.window.x;
  const int y0 = static_cast<int>(std::floor(p.y() - 0.5F)) - view.window.y;
  if (x0 < 0 || y0 < 0 || x0 + 1 >= view.window.width || y0 + 1 >= view.window.height) return false;
  float farthest = 1e9F;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const std::size_t at = view.At(x0 + i, y0 + j);
      if (view.near_edge[at] != 0) return false;
      if (view.inverse_depth[at] > 0) farthest = std::min(farthest, view.inverse_depth[at]);
    }
  }
  return farthest < 1e9F && (p.z() - kDepthTolerance) * farthest < 1;
}

// Bilinear colour at pixel position p; false outside the window and where a pixel is not finite.
bool SampleColour(const Picture& picture, const Vec3f& p, Rgb& colour) {
  const float px = p.x() - 0.5F - static_cast<float>(picture.window.x);
  const float py = p.y() - 0.5F - static_cast<float>(picture.window.y);
  const int x0 = static_cast<int>(std::floor(px));
  const int y0 = static_cast<int>(std::floor(py));
  if (x0 < 0 || y0 < 0 || x0 + 1 >= picture.image.width || y0 + 1 >= picture.image.height)
    return false;
  const float fx = px - static_cast<float>(x0);
  const float fy = py - static_cast<float>(y0);
  colour = Rgb::Zero();
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const float w = (i == 1 ? fx : 1 - fx) * (j == 1 ? fy : 1 - fy);
      const float* c = &picture.image.At(x0 + i, y0 + j);
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
    const Projector project(cameras[c]);
    const CameraView view = ViewOf(cameras[c], project, surface, atlas.triangles, options.rim);
    ParallelForBlocks(num_texels, kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const Vec3f& x = points.position[k];
        const Vec3f to_camera = project.centre() - x;
        const float facing = points.normal[k].dot(to_camera) / std::sqrt(to_camera.squaredNorm());
        if (facing <= grazing) continue;
        const Vec3f p = project(x);
        if (p.z() <= 0 || !Sees(view, p)) continue;
        Rgb colour;
        if (!SampleColour(pictures[c], p, colour)) continue;
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
  // The tangent frames once, then light by light and camera by camera along the tile's arrays.
  const auto count = static_cast<std::size_t>(tile.texels);
  const auto first = static_cast<std::size_t>(tile.first_texel);
  const auto offset = static_cast<std::size_t>(tile.first_texel - first_texture_texel);
  std::vector<Vec3f> position(count);
  std::vector<Mat3f> tangent_from_world(count);
  for (std::size_t t = 0; t < count; ++t) {
    const Triangle& triangle = atlas.triangles[static_cast<std::size_t>(grid.triangle[first + t])];
    const Vec3f& bary = grid.bary[first + t];
    position[t] = Blend(surface.positions, triangle, bary);
    tangent_from_world[t] = TangentFrame(surface, triangle, bary).transpose();
  }
  for (std::size_t l = 0; l < lights.size(); ++l) {
    std::array<float*, 3> direction;
    std::array<float*, 3> irradiance;
    for (std::size_t i = 0; i < 3; ++i) {
      direction[i] = tile.LightDir(frame, static_cast<int>(l), static_cast<int>(i));
      irradiance[i] = tile.Irradiance(frame, static_cast<int>(l), static_cast<int>(i));
    }
    const float* const visible = textures.light_visibility[l].data() + offset;
    for (std::size_t t = 0; t < count; ++t) {
      const Illumination light = Illuminate(lights[l], position[t]);
      const Vec3f d = tangent_from_world[t] * light.to_light;
      for (std::size_t i = 0; i < 3; ++i) {
        direction[i][t] = d[static_cast<int>(i)];
        irradiance[i][t] = light.irradiance[static_cast<int>(i)] * visible[t];
      }
    }
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    std::array<float*, 3> direction;
    std::array<float*, 3> radiance;
    for (std::size_t i = 0; i < 3; ++i) {
      direction[i] = tile.ViewDir(frame, static_cast<int>(c), static_cast<int>(i));
      radiance[i] = tile.Radiance(frame, static_cast<int>(c), static_cast<int>(i));
    }
    const Vec3f centre = cameras[c].Center().cast<float>();
    const float* const colour = textures.radiance[c].data() + 3 * offset;
    const float* const weight = textures.weight[c].data() + offset;
    for (std::size_t t = 0; t < count; ++t) {
      if (weight[t] <= 0) {  // most: a camera sees a quarter of the texels
        direction[2][t] = 1;
        continue;
      }
      const Vec3f d = tangent_from_world[t] * (centre - position[t]).normalized();
      for (std::size_t i = 0; i < 3; ++i) {
        direction[i][t] = d[static_cast<int>(i)];
        radiance[i][t] = colour[3 * t + i];
      }
    }
    std::copy_n(weight, count, tile.Weight(frame, static_cast<int>(c)));
  }
}

}  // namespace dyxel
