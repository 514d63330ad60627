#include "dyxel/render/surface_samples.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dyxel/base/parallel.h"

namespace dyxel::internal {
namespace {

std::size_t Size(int n) { return static_cast<std::size_t>(n); }

// The largest radius (in z = 1) up to which r (1 + k1 r² + k2 r⁴ + k3 r⁶) grows, squared. Beyond it
// the polynomial folds back, and would show what is far outside the picture within it.
double MonotonicRadiusSquared(const Camera& camera) {
  const double k1 = camera.distortion[0];
  const double k2 = camera.distortion[1];
  const double k3 = camera.distortion[4];
  for (double r2 = 0; r2 < 16; r2 += 0.01) {
    if (1 + r2 * (3 * k1 + r2 * (5 * k2 + r2 * 7 * k3)) <= 0) return r2;
  }
  return std::numeric_limits<double>::infinity();
}

struct Bounds {
  float x0 = std::numeric_limits<float>::max();
  float y0 = std::numeric_limits<float>::max();
  float x1 = std::numeric_limits<float>::lowest();
  float y1 = std::numeric_limits<float>::lowest();
};

// Pixel range that [low, high] touches, within [0, size].
std::pair<int, int> PixelRange(float low, float high, int size) {
  const auto limit = static_cast<float>(size);
  const int first = static_cast<int>(std::floor(std::clamp(low, 0.0F, limit)));
  const int last = static_cast<int>(std::ceil(std::clamp(high, 0.0F, limit)));
  return {first, std::max(first, last)};
}

Vec3f Normalized(const Vec3f& x) {
  const float length = x.norm();
  return length > 0 ? Vec3f(x / length) : Vec3f(0, 0, 1);
}

}  // namespace

PackedSurface PackSurface(const RenderSurface& surface) {
  const PosedSurface& s = *surface.surface;
  PackedSurface packed;
  packed.vertices.resize(s.positions.size());
  ParallelForBlocks(packed.vertices.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::array<float, 16>& v = packed.vertices[i].v;
      for (int a = 0; a < 3; ++a) {
        v[Size(a)] = s.positions[i][a];
        v[Size(3 + a)] = s.normals[i][a];
        v[Size(6 + a)] = s.tangents[i][a];
      }
      v[9] = s.handedness[i];
      v[10] = surface.atlas->uv_i[i].x();
      v[11] = surface.atlas->uv_i[i].y();
    }
  });
  return packed;
}

ScreenSurface ProjectSurface(const RenderSurface& surface, const Camera& camera, int samples) {
  const std::vector<Vec3f>& positions = surface.surface->positions;
  ScreenSurface screen;
  screen.samples = samples;
  screen.eye = camera.Center().cast<float>();
  screen.vertices.resize(positions.size());
  const bool distorted = camera.HasDistortion();
  const double max_radius2 =
      distorted ? MonotonicRadiusSquared(camera) : std::numeric_limits<double>::infinity();
  constexpr std::size_t kBlock = 4096;
  const Bounds bounds = ParallelReduce(
      positions.size(),
      kBlock,
      Bounds{},
      [&](std::size_t begin, std::size_t end) {
        Bounds part;
        for (std::size_t i = begin; i < end; ++i) {
          const Vec3d x_in_world = positions[i].cast<double>();
          const Vec3d x = camera.cam_from_world * x_in_world;
          ScreenVertex& v = screen.vertices[i];
          v = {0, 0, 0};
          const double x2 = x.head<2>().squaredNorm();
          if (!(x.z() > 1e-6) || !(x2 < max_radius2 * x.z() * x.z())) continue;
          const Vec2d pixel = distorted ? camera.Project(x_in_world)
                                        : Vec2d(camera.fx * x.x() / x.z() + camera.cx,
                                                camera.fy * x.y() / x.z() + camera.cy);
          v = {static_cast<float>(pixel.x()),
               static_cast<float>(pixel.y()),
               static_cast<float>(1 / x.z())};
          part.x0 = std::min(part.x0, v.x);
          part.y0 = std::min(part.y0, v.y);
          part.x1 = std::max(part.x1, v.x);
          part.y1 = std::max(part.y1, v.y);
        }
        return part;
      },
      [](Bounds& total, const Bounds& part) {
        total.x0 = std::min(total.x0, part.x0);
        total.y0 = std::min(total.y0, part.y0);
        total.x1 = std::max(total.x1, part.x1);
        total.y1 = std::max(total.y1, part.y1);
      });
  const auto [x0, x1] = PixelRange(bounds.x0, bounds.x1, camera.width);
  const auto [y0, y1] = PixelRange(bounds.y0, bounds.y1, camera.height);
  screen.window = {x0, y0, x1 - x0, y1 - y0};
  if (screen.window.width <= 0 || screen.window.height <= 0) {
    screen.window = {};
    return screen;
  }
  const auto scale = static_cast<float>(samples);
  for (ScreenVertex& v : screen.vertices) {
    v.x = (v.x - static_cast<float>(x0)) * scale;
    v.y = (v.y - static_cast<float>(y0)) * scale;
  }
  screen.visibility = Rasterize(screen.vertices,
                                surface.atlas->triangles,
                                screen.window.width * samples,
                                screen.window.height * samples);
  return screen;
}

void Bilinear(const ImageF& map, float u, float v, float* out) {
  const float x =
      std::clamp(u * static_cast<float>(map.width) - 0.5F, 0.0F, static_cast<float>(map.width - 1));
  const float y = std::clamp(
      v * static_cast<float>(map.height) - 0.5F, 0.0F, static_cast<float>(map.height - 1));
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const int right = x0 + 1 < map.width ? map.channels : 0;
  const int down = y0 + 1 < map.height ? map.width * map.channels : 0;
  const float fx = x - static_cast<float>(x0);
  const float fy = y - static_cast<float>(y0);
  const float* a = &map.data[map.Index(x0, y0)];
  for (int c = 0; c < map.channels; ++c) {
    const float top = a[c] + fx * (a[c + right] - a[c]);
    const float bottom = a[c + down] + fx * (a[c + down + right] - a[c + down]);
    out[c] = top + fy * (bottom - top);
  }
}

std::uint8_t NearestTexel(const ImageU8& map, float u, float v) {
  const auto nearest = [](float at, int size) {
    return static_cast<int>(
        std::clamp(at * static_cast<float>(size), 0.0F, static_cast<float>(size - 1)));
  };
  return map.At(nearest(u, map.width), nearest(v, map.height));
}

void GatherSamples(const RenderSurface& surface,
                   const PackedSurface& packed,
                   const ScreenSurface& screen,
                   SampleBlock& samples,
                   ShadeBlock& shade) {
  shade.count = samples.count;
  const MaterialMaps& maps = *surface.maps;
  const int num_specular = maps.specular.channels;
  std::array<float, kMaxSpecular> specular = {};
  alignas(64) std::array<float, 16> at;
  for (std::size_t i = 0; i < Size(samples.count); ++i) {
    const Triangle& t = surface.atlas->triangles[Size(samples.triangle[i])];
    const ScreenVertex& sa = screen.vertices[Size(t[0])];
    const ScreenVertex& sb = screen.vertices[Size(t[1])];
    const ScreenVertex& sc = screen.vertices[Size(t[2])];
    const Vec3f bary = PerspectiveBarycentrics(sa, sb, sc, samples.x[i], samples.y[i]);
    const std::array<float, 16>& a = packed.vertices[Size(t[0])].v;
    const std::array<float, 16>& b = packed.vertices[Size(t[1])].v;
    const std::array<float, 16>& c = packed.vertices[Size(t[2])].v;
    for (std::size_t k = 0; k < 16; ++k) at[k] = bary[0] * a[k] + bary[1] * b[k] + bary[2] * c[k];
    samples.u[i] = at[10];
    samples.v[i] = at[11];
    samples.depth[i] =
        bary[0] / sa.inverse_depth + bary[1] / sb.inverse_depth + bary[2] / sc.inverse_depth;

    const Vec3f position(at[0], at[1], at[2]);
    Vec3f side = Normalized({at[3], at[4], at[5]});
    Vec3f normal = side;
    if (surface.normal_map != nullptr) {
      const Vec3f raw(at[6], at[7], at[8]);
      const Vec3f tangent = Normalized(raw - raw.dot(side) * side);
      const Vec3f bitangent = (at[9] < 0 ? -1.0F : 1.0F) * side.cross(tangent);
      Vec3f m;
      Bilinear(*surface.normal_map, at[10], at[11], m.data());
      normal = Normalized(m[0] * tangent + m[1] * bitangent + m[2] * side);
    }
    // Counter-clockwise seen from outside is clockwise in a picture whose y points down.
    const float area = (sb.x - sa.x) * (sc.y - sa.y) - (sc.x - sa.x) * (sb.y - sa.y);
    if (area > 0) {
      side = -side;
      normal = -normal;
    }
    const Vec3f view = Normalized(screen.eye - position);
    for (int k = 0; k < 3; ++k) {
      shade.position[Size(k)][i] = position[k];
      shade.side[Size(k)][i] = side[k];
      shade.normal[Size(k)][i] = normal[k];
      shade.view[Size(k)][i] = view[k];
    }
    std::array<float, 3> diffuse;
    Bilinear(maps.diffuse, at[10], at[11], diffuse.data());
    for (std::size_t k = 0; k < 3; ++k) shade.diffuse[k][i] = diffuse[k];
    Bilinear(maps.specular, at[10], at[11], specular.data());
    for (std::size_t k = 0; k < Size(num_specular); ++k) shade.specular[k][i] = specular[k];
  }
}

}  // namespace dyxel::internal
