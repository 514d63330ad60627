// The signed distance to a mask's contour, on a reduced grid, and samples of the contour.
#pragma once

#include <vector>

#include "dyxel/image/image.h"
#include "dyxel/math/types.h"

namespace dyxel::internal {

// Distances are in full pixels, positive inside. Grid cell (i, j) has its centre at full-picture
// pixel position (step · (i + 1/2) + left, step · (j + 1/2) + top).
struct DistanceField {
  int step = 1;
  int left = 0, top = 0;      // full pixels, multiples of step
  ImageF value;               // [h][w]
  int width = 0, height = 0;  // of the full picture

  // Bilinear; beyond the grid the distance to the grid is subtracted.
  [[nodiscard]] float At(const Vec2f& pixel) const;
  // d(distance)/d(pixel) by central differences; points inwards.
  [[nodiscard]] Vec2f Gradient(const Vec2f& pixel) const;
};

struct ContourSample {
  Vec2f pixel;
  Vec2f normal;  // unit, outwards
};

struct Contour {
  std::vector<ContourSample> samples;
  float spacing = 1;  // pixels of contour that a sample stands for
};

// The field around a mask (255 inside), with `margin` full pixels around its bounding box. The
// picture's own border is no contour: a person cut off by it goes on beyond.
[[nodiscard]] DistanceField MakeDistanceField(const ImageU8& mask, int step, int margin);

// Points of the zero level, roughly `spacing` full pixels apart, none within two cells of the
// picture's border.
[[nodiscard]] Contour SampleContour(const DistanceField& field, float spacing);

}  // namespace dyxel::internal
