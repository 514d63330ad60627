#include "dyxel/render/surface_samples.h"

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>

#include "dyxel/base/lanes.h"
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

namespace {

using Row = ShadeBlock::Row;

template <Real T>
T Load(const Row& row, int i) {
  if constexpr (std::floating_point<T>) {
    return row[Size(i)];
  } else {
    return T::load_aligned(row.data() + i);
  }
}
template <Real T>
void Store(const T& x, Row& row, int i) {
  if constexpr (std::floating_point<T>) {
    row[Size(i)] = x;
  } else {
    x.store_aligned(row.data() + i);
  }
}

template <Real T>
using Vec = std::array<T, 3>;
template <Real T>
Vec<T> Load3(const Row* rows, int i) {
  return {Load<T>(rows[0], i), Load<T>(rows[1], i), Load<T>(rows[2], i)};
}
template <Real T>
void Store3(const Vec<T>& x, Row* rows, int i) {
  for (std::size_t a = 0; a < 3; ++a) Store(x[a], rows[a], i);
}
template <Real T>
T Dot(const Vec<T>& a, const Vec<T>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <Real T>
Vec<T> Unit(const Vec<T>& x) {
  const T squared = Dot(x, x);
  const T inverse = T(1) / Sqrt(Select(squared < T(1e-30F), T(1e-30F), squared));
  return {x[0] * inverse, x[1] * inverse, x[2] * inverse};
}

// What GatherSamples needs between its passes, a row a number.
struct Scratch {
  alignas(64) std::array<Row, 9> corner;  // x, y, 1/z of the three corners
  alignas(64) std::array<Row, 3> bary;
  alignas(64) Row facing;  // 1 seen from outside, -1 from inside
  alignas(64) Row x, y;    // sample centres
  // Interpolated PackedVertex: 0-2 position, 3-5 normal, 6-8 tangent, 9 handedness, 10 u, 11 v.
  alignas(64) std::array<Row, 12> at;
  alignas(64) std::array<Row, 3> map_normal;  // tangent frame
};

template <Real T>
void ComputeBarycentrics(int count, Scratch& s, Row& depth) {
  for (int i = 0; i < count; i += kLaneCount<T>) {
    const T px = Load<T>(s.x, i);
    const T py = Load<T>(s.y, i);
    Vec<T> x;
    Vec<T> y;
    Vec<T> w;
    for (std::size_t k = 0; k < 3; ++k) {
      x[k] = Load<T>(s.corner[3 * k], i) - px;
      y[k] = Load<T>(s.corner[3 * k + 1], i) - py;
      w[k] = Load<T>(s.corner[3 * k + 2], i);
    }
    const Vec<T> area = {
        x[1] * y[2] - y[1] * x[2], x[2] * y[0] - y[2] * x[0], x[0] * y[1] - y[0] * x[1]};
    Vec<T> bary = {area[0] * w[0], area[1] * w[1], area[2] * w[2]};
    const T sum = bary[0] + bary[1] + bary[2];
    const auto flat = sum == T(0);
    const T inverse = T(1) / Select(flat, T(1), sum);
    T z(0);
    for (std::size_t k = 0; k < 3; ++k) {
      bary[k] = Select(flat, T(1.0F / 3), bary[k] * inverse);
      Store(bary[k], s.bary[k], i);
      z += bary[k] / w[k];
    }
    Store(z, depth, i);
    // Counter-clockwise seen from outside is clockwise in a picture whose y points down.
    Store(Select(T(0) < area[0] + area[1] + area[2], T(-1), T(1)), s.facing, i);
  }
}

template <Real T>
void ComputeFrames(const Vec3f& eye, bool mapped, const Scratch& s, ShadeBlock& shade) {
  for (int i = 0; i < shade.count; i += kLaneCount<T>) {
    const Vec<T> position = Load3<T>(&s.at[0], i);
    const Vec<T> n = Unit(Load3<T>(&s.at[3], i));
    Vec<T> normal = n;
    if (mapped) {
      Vec<T> t = Load3<T>(&s.at[6], i);
      const T along = Dot(t, n);
      for (std::size_t a = 0; a < 3; ++a) t[a] -= along * n[a];
      t = Unit(t);
      const T hand = Select(Load<T>(s.at[9], i) < T(0), T(-1), T(1));
      const Vec<T> b = {hand * (n[1] * t[2] - n[2] * t[1]),
                        hand * (n[2] * t[0] - n[0] * t[2]),
                        hand * (n[0] * t[1] - n[1] * t[0])};
      const Vec<T> m = Load3<T>(s.map_normal.data(), i);
      for (std::size_t a = 0; a < 3; ++a) normal[a] = m[0] * t[a] + m[1] * b[a] + m[2] * n[a];
      normal = Unit(normal);
    }
    const T facing = Load<T>(s.facing, i);
    Vec<T> side;
    Vec<T> view;
    for (std::size_t a = 0; a < 3; ++a) {
      side[a] = facing * n[a];
      normal[a] = facing * normal[a];
      view[a] = T(eye[static_cast<int>(a)]) - position[a];
    }
    Store3(position, shade.position.data(), i);
    Store3(side, shade.side.data(), i);
    Store3(normal, shade.normal.data(), i);
    Store3(Unit(view), shade.view.data(), i);
  }
}

}  // namespace

template <class T>
void GatherSamples(const RenderSurface& surface,
                   const PackedSurface& packed,
                   const ScreenSurface& screen,
                   SampleBlock& samples,
                   ShadeBlock& shade) {
  shade.count = samples.count;
  Scratch s;
  const std::size_t count = Size(samples.count);
  // Lanes past the last sample repeat it: what they compute is never read, but finite.
  const std::size_t end =
      (count + Size(kLaneCount<Lanes>) - 1) / Size(kLaneCount<Lanes>) * Size(kLaneCount<Lanes>);
  const auto source = [&](std::size_t i) { return std::min(i, count - 1); };
  for (std::size_t i = 0; i < end; ++i) {
    const Triangle& t = surface.atlas->triangles[Size(samples.triangle[source(i)])];
    for (std::size_t k = 0; k < 3; ++k) {
      const ScreenVertex& v = screen.vertices[Size(t[k])];
      s.corner[3 * k][i] = v.x;
      s.corner[3 * k + 1][i] = v.y;
      s.corner[3 * k + 2][i] = v.inverse_depth;
    }
    s.x[i] = static_cast<float>(samples.x[source(i)]) + 0.5F;
    s.y[i] = static_cast<float>(samples.y[source(i)]) + 0.5F;
  }
  ComputeBarycentrics<T>(samples.count, s, samples.depth);

  const MaterialMaps& maps = *surface.maps;
  const bool mapped = surface.normal_map != nullptr;
  std::array<float, kMaxSpecular> texel = {};
  alignas(64) std::array<float, 16> at;
  for (std::size_t i = 0; i < end; ++i) {
    const std::size_t from = source(i);
    const Triangle& t = surface.atlas->triangles[Size(samples.triangle[from])];
    const std::array<float, 16>& a = packed.vertices[Size(t[0])].v;
    const std::array<float, 16>& b = packed.vertices[Size(t[1])].v;
    const std::array<float, 16>& c = packed.vertices[Size(t[2])].v;
    const float wa = s.bary[0][from];
    const float wb = s.bary[1][from];
    const float wc = s.bary[2][from];
    for (std::size_t k = 0; k < 16; ++k) at[k] = wa * a[k] + wb * b[k] + wc * c[k];
    for (std::size_t k = 0; k < s.at.size(); ++k) s.at[k][i] = at[k];
    const float u = at[10];
    const float v = at[11];
    samples.u[i] = u;
    samples.v[i] = v;
    if (mapped) {
      Bilinear(*surface.normal_map, u, v, texel.data());
      for (std::size_t k = 0; k < 3; ++k) s.map_normal[k][i] = texel[k];
    }
    Bilinear(maps.diffuse, u, v, texel.data());
    for (std::size_t k = 0; k < 3; ++k) shade.diffuse[k][i] = texel[k];
    Bilinear(maps.specular, u, v, texel.data());
    for (std::size_t k = 0; k < Size(maps.specular.channels); ++k) {
      shade.specular[k][i] = texel[k];
    }
  }
  ComputeFrames<T>(screen.eye, mapped, s, shade);
}

template void GatherSamples<float>(
    const RenderSurface&, const PackedSurface&, const ScreenSurface&, SampleBlock&, ShadeBlock&);
template void GatherSamples<Lanes>(
    const RenderSurface&, const PackedSurface&, const ScreenSurface&, SampleBlock&, ShadeBlock&);

}  // namespace dyxel::internal
