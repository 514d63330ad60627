// The atlas: the surface cut open, its two parameterizations, and the texel grid of I.
#pragma once

#include <span>
#include <vector>

#include "dyxel/image/image.h"
#include "dyxel/math/types.h"
#include "dyxel/mesh/triangle_mesh.h"

namespace dyxel {

// The cut surface. A cut vertex is one side of a seam: skin vertices on the seam have several.
struct Atlas {
  std::vector<int> skin_vertex;     // (C) the skin vertex that each cut vertex copies
  std::vector<Triangle> triangles;  // (F) of cut vertices; triangle f is triangle f of the skin
  std::vector<Vec2f> uv_i;   // (C) parameterization I in [0, 1]²; image x = u·size, y = v·size
  std::vector<Vec2f> uv_ii;  // (C) parameterization II; empty for a given open surface
  int size = 1024;           // texels a side
};

// The texels that lie on the surface, row by row. K texels.
struct TexelGrid {
  int size = 0;
  std::vector<int> pixel;     // (K) y * size + x, ascending
  std::vector<int> triangle;  // (K)
  std::vector<Vec3f> bary;    // (K) barycentrics in the triangle, all >= 0
  std::vector<int> texel_at;  // (size²) index into the K, or -1
  std::vector<int> nearest;   // (size²) pixel of the nearest one (NearestTexels)
  [[nodiscard]] std::size_t count() const { return pixel.size(); }
};

// Texels whose centre lies in a triangle of parameterization I. A texel that two triangles claim
// goes to the lower index.
[[nodiscard]] TexelGrid MakeTexelGrid(const Atlas& atlas);

// Where each of the K texels lies in parameterization II (uv), by the same barycentrics.
[[nodiscard]] std::vector<Vec2f> TexelsInSecond(const Atlas& atlas, const TexelGrid& grid);

// Fills the texels outside `grid` from the nearest ones within, so that bilinear look-ups at chart
// borders and smaller mip levels never bleed. `map` is [size][size][channels], in place.
void FillGutters(const TexelGrid& grid, ImageF& map);

// Figures of docs/method.md (A4), against rest positions of the skin.
struct AtlasQuality {
  int flips = 0;          // triangles of wrong orientation, or none
  int overlap = 0;        // texels that two triangles claim
  double stretch_l2 = 0;  // Sander et al. 2001
  double stretch_linf = 0;
  double fill = 0;  // used share of the texture
};
[[nodiscard]] AtlasQuality MeasureAtlas(std::span<const Vec3f> skin_positions,
                                        const Atlas& atlas,
                                        std::span<const Vec2f> uv);

}  // namespace dyxel
