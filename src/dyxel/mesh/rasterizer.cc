#include "dyxel/mesh/rasterizer.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/lanes.h"
#include "dyxel/base/parallel.h"

namespace dyxel {
namespace {

using IntLanes = xsimd::batch<std::int32_t>;
constexpr int kLanes = kLaneCount<Lanes>;
constexpr int kBandRows = 32;  // a band of the buffer stays in the second-level cache

// One side of a triangle; E(p) = dx (p.y - y) - dy (p.x - x) >= 0 inside or on it. The edge always
// runs from its lower end (in y, then x), so that the two triangles which share it compute the same
// number with opposite signs: every pixel centre between them belongs to one of them at least.
struct Side {
  float x, y, dx, dy;
};

Side MakeSide(const ScreenVertex& a, const ScreenVertex& b, float orientation) {
  const bool forward = a.y < b.y || (a.y == b.y && a.x < b.x);
  const ScreenVertex& from = forward ? a : b;
  const ScreenVertex& to = forward ? b : a;
  const float sign = forward ? orientation : -orientation;
  return {from.x, from.y, sign * (to.x - from.x), sign * (to.y - from.y)};
}

// Doubled signed area; the products of floats are exact in double.
double DoubledArea(const ScreenVertex& a, const ScreenVertex& b, const ScreenVertex& c) {
  return (double{b.x} - double{a.x}) * (double{c.y} - double{a.y}) -
         (double{b.y} - double{a.y}) * (double{c.x} - double{a.x});
}

// Pixels whose centres lie in [low, high], clipped to [0, size): first > last if there are none.
struct Range {
  int first, last;
};
Range PixelRange(float low, float high, int size) {
  const float limit = static_cast<float>(size - 1);
  return {static_cast<int>(std::ceil(std::max(low - 0.5F, 0.0F))),
          static_cast<int>(std::floor(std::clamp(high - 0.5F, -1.0F, limit)))};
}

Lanes Iota() {
  return FromLanes<Lanes>([](int i) { return static_cast<float>(i) + 0.5F; });
}

template <bool kWithIndex>
void DrawTriangle(const ScreenVertex& a,
                  const ScreenVertex& b,
                  const ScreenVertex& c,
                  int index,
                  int first_row,
                  int last_row,
                  int stride,
                  int width,
                  float* depth,
                  std::int32_t* triangle) {
  const Range columns = PixelRange(std::min({a.x, b.x, c.x}), std::max({a.x, b.x, c.x}), width);
  const Range rows = PixelRange(std::min({a.y, b.y, c.y}), std::max({a.y, b.y, c.y}), last_row + 1);
  const double area = DoubledArea(a, b, c);
  const float orientation = area > 0 ? 1.0F : -1.0F;
  const std::array<Side, 3> sides = {
      MakeSide(a, b, orientation), MakeSide(b, c, orientation), MakeSide(c, a, orientation)};
  const float scale = static_cast<float>(1.0 / area);
  const float wb = b.inverse_depth - a.inverse_depth;
  const float wc = c.inverse_depth - a.inverse_depth;
  const float slope_x = (wb * (c.y - a.y) - wc * (b.y - a.y)) * scale;
  const float slope_y = (wc * (b.x - a.x) - wb * (c.x - a.x)) * scale;
  const Lanes low(std::min({a.inverse_depth, b.inverse_depth, c.inverse_depth}));
  const Lanes high(std::max({a.inverse_depth, b.inverse_depth, c.inverse_depth}));
  const Lanes iota = Iota();
  const Lanes zero(0.0F);
  [[maybe_unused]] const Lanes index_bits = xsimd::bitwise_cast<Lanes>(IntLanes(index));
  const int left_end = stride - kLanes;  // rows are padded to a whole register at least

  for (int y = std::max(rows.first, first_row); y <= rows.last; ++y) {
    const float center_y = static_cast<float>(y) + 0.5F;
    const Lanes row0(sides[0].dx * (center_y - sides[0].y));
    const Lanes row1(sides[1].dx * (center_y - sides[1].y));
    const Lanes row2(sides[2].dx * (center_y - sides[2].y));
    const Lanes row_w(a.inverse_depth + slope_y * (center_y - a.y));
    const std::size_t row_at = static_cast<std::size_t>(y) * static_cast<std::size_t>(stride);
    for (int x = columns.first; x <= columns.last; x += kLanes) {
      const int left = std::min(x, left_end);
      const Lanes center_x = Lanes(static_cast<float>(left)) + iota;
      const Lanes e0 = xsimd::fnma(Lanes(sides[0].dy), center_x - Lanes(sides[0].x), row0);
      const Lanes e1 = xsimd::fnma(Lanes(sides[1].dy), center_x - Lanes(sides[1].x), row1);
      const Lanes e2 = xsimd::fnma(Lanes(sides[2].dy), center_x - Lanes(sides[2].x), row2);
      const Lanes w = xsimd::min(
          high, xsimd::max(low, xsimd::fma(Lanes(slope_x), center_x - Lanes(a.x), row_w)));
      float* const depth_at = depth + row_at + left;
      const Lanes old = Lanes::load_unaligned(depth_at);
      const auto mask = (xsimd::min(e0, xsimd::min(e1, e2)) >= zero) & (w > old);
      if (!xsimd::any(mask)) continue;
      Select(mask, w, old).store_unaligned(depth_at);
      if constexpr (kWithIndex) {
        std::int32_t* const triangle_at = triangle + row_at + left;
        const IntLanes old_index = IntLanes::load_unaligned(triangle_at);
        const Lanes chosen = Select(mask, index_bits, xsimd::bitwise_cast<Lanes>(old_index));
        xsimd::bitwise_cast<IntLanes>(chosen).store_unaligned(triangle_at);
      }
    }
  }
}

template <bool kWithIndex>
VisibilityBuffer Draw(std::span<const ScreenVertex> vertices,
                      std::span<const Triangle> triangles,
                      int width,
                      int height) {
  VisibilityBuffer buffer;
  buffer.width = width;
  buffer.height = height;
  const int stride = std::max(width, kLanes);
  const auto pixels = static_cast<std::size_t>(stride) * static_cast<std::size_t>(height);
  if constexpr (kWithIndex) buffer.triangle.assign(pixels, -1);
  buffer.inverse_depth.assign(pixels, 0.0F);
  if (width <= 0 || height <= 0) return buffer;

  // The bands that each triangle touches; those that cover no pixel centre's row or column, or that
  // reach behind the eye, touch none.
  struct Bands {
    std::int16_t first = 1, last = 0;
  };
  std::vector<Bands> bands_of(triangles.size());
  ParallelForBlocks(triangles.size(), 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      const ScreenVertex& a = vertices[static_cast<std::size_t>(triangles[f][0])];
      const ScreenVertex& b = vertices[static_cast<std::size_t>(triangles[f][1])];
      const ScreenVertex& c = vertices[static_cast<std::size_t>(triangles[f][2])];
      if (!(a.inverse_depth > 0 && b.inverse_depth > 0 && c.inverse_depth > 0)) continue;
      const double area = DoubledArea(a, b, c);
      if (!(std::abs(area) > 0) || !std::isfinite(static_cast<float>(1.0 / area))) continue;
      const Range columns = PixelRange(std::min({a.x, b.x, c.x}), std::max({a.x, b.x, c.x}), width);
      const Range rows = PixelRange(std::min({a.y, b.y, c.y}), std::max({a.y, b.y, c.y}), height);
      if (columns.first > columns.last || rows.first > rows.last) continue;
      bands_of[f] = {static_cast<std::int16_t>(rows.first / kBandRows),
                     static_cast<std::int16_t>(rows.last / kBandRows)};
    }
  });
  const int num_bands = (height + kBandRows - 1) / kBandRows;
  std::vector<int> begin(static_cast<std::size_t>(num_bands) + 1, 0);
  for (const Bands& bands : bands_of) {
    for (int b = bands.first; b <= bands.last; ++b) ++begin[static_cast<std::size_t>(b) + 1];
  }
  for (std::size_t b = 1; b < begin.size(); ++b) begin[b] += begin[b - 1];
  std::vector<int> list(static_cast<std::size_t>(begin.back()));
  std::vector<int> next(begin.begin(), begin.end() - 1);
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    for (int b = bands_of[f].first; b <= bands_of[f].last; ++b) {
      list[static_cast<std::size_t>(next[static_cast<std::size_t>(b)]++)] = static_cast<int>(f);
    }
  }

  // Each band draws its triangles by ascending index, and only a nearer one replaces.
  ParallelFor(static_cast<std::size_t>(num_bands), [&](std::size_t band) {
    const int first_row = static_cast<int>(band) * kBandRows;
    const int last_row = std::min(first_row + kBandRows, height) - 1;
    for (int i = begin[band]; i < begin[band + 1]; ++i) {
      const int f = list[static_cast<std::size_t>(i)];
      const Triangle& t = triangles[static_cast<std::size_t>(f)];
      DrawTriangle<kWithIndex>(vertices[static_cast<std::size_t>(t[0])],
                               vertices[static_cast<std::size_t>(t[1])],
                               vertices[static_cast<std::size_t>(t[2])],
                               f,
                               first_row,
                               last_row,
                               stride,
                               width,
                               buffer.inverse_depth.data(),
                               buffer.triangle.data());
    }
  });

  if (stride != width) {  // a picture narrower than a register: drop the padding
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const auto to = static_cast<std::size_t>(y * width + x);
        const auto from = static_cast<std::size_t>(y * stride + x);
        if constexpr (kWithIndex) buffer.triangle[to] = buffer.triangle[from];
        buffer.inverse_depth[to] = buffer.inverse_depth[from];
      }
    }
    if constexpr (kWithIndex) buffer.triangle.resize(static_cast<std::size_t>(width * height));
    buffer.inverse_depth.resize(static_cast<std::size_t>(width * height));
  }
  return buffer;
}

}  // namespace

VisibilityBuffer Rasterize(std::span<const ScreenVertex> vertices,
                           std::span<const Triangle> triangles,
                           int width,
                           int height) {
  return Draw<true>(vertices, triangles, width, height);
}

std::vector<float> RasterizeDepth(std::span<const ScreenVertex> vertices,
                                  std::span<const Triangle> triangles,
                                  int width,
                                  int height) {
  return Draw<false>(vertices, triangles, width, height).inverse_depth;
}

Vec3f PerspectiveBarycentrics(
    const ScreenVertex& a, const ScreenVertex& b, const ScreenVertex& c, float x, float y) {
  const float px = x + 0.5F;
  const float py = y + 0.5F;
  // Areas opposite each corner, relative to the point, times the inverse depth.
  const Vec2f pa(a.x - px, a.y - py);
  const Vec2f pb(b.x - px, b.y - py);
  const Vec2f pc(c.x - px, c.y - py);
  Vec3f bary((pb.x() * pc.y() - pb.y() * pc.x()) * a.inverse_depth,
             (pc.x() * pa.y() - pc.y() * pa.x()) * b.inverse_depth,
             (pa.x() * pb.y() - pa.y() * pb.x()) * c.inverse_depth);
  const float sum = bary.sum();
  if (sum == 0) return Vec3f::Constant(1.0F / 3.0F);
  return bary / sum;
}

}  // namespace dyxel
