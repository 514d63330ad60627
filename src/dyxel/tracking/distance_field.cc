#include "dyxel/tracking/distance_field.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace dyxel::internal {

float DistanceField::At(const Vec2f& pixel) const {
  const float s = 1.0F / static_cast<float>(step);
  float x = (pixel.x() - static_cast<float>(left)) * s - 0.5F;
  float y = (pixel.y() - static_cast<float>(top)) * s - 0.5F;
  const float cx = std::clamp(x, 0.0F, static_cast<float>(value.width - 1) - 1e-3F);
  const float cy = std::clamp(y, 0.0F, static_cast<float>(value.height - 1) - 1e-3F);
  float beyond = 0;
  if (cx != x || cy != y) beyond = std::hypot(x - cx, y - cy) * static_cast<float>(step);
  const int i = static_cast<int>(cx);
  const int j = static_cast<int>(cy);
  const float u = cx - static_cast<float>(i);
  const float v = cy - static_cast<float>(j);
  const float* a = &value.data[static_cast<std::size_t>(j) * static_cast<std::size_t>(value.width) +
                               static_cast<std::size_t>(i)];
  const float* b = a + value.width;
  return (1 - v) * ((1 - u) * a[0] + u * a[1]) + v * ((1 - u) * b[0] + u * b[1]) - beyond;
}

Vec2f DistanceField::Gradient(const Vec2f& pixel) const {
  const auto h = static_cast<float>(step);
  return Vec2f(At(pixel + Vec2f(h, 0)) - At(pixel - Vec2f(h, 0)),
               At(pixel + Vec2f(0, h)) - At(pixel - Vec2f(0, h))) /
         (2 * h);
}

DistanceField MakeDistanceField(const ImageU8& mask, int step, int margin) {
  DistanceField field;
  field.step = step;
  field.width = mask.width;
  field.height = mask.height;
  const cv::Mat1b full(mask.height, mask.width, const_cast<std::uint8_t*>(mask.data.data()));
  const cv::Rect box = cv::boundingRect(full);
  const auto down = [&](int v) { return std::max(0, v) / step * step; };
  field.left = down(box.x - margin);
  field.top = down(box.y - margin);
  const int right = std::min(mask.width, box.x + box.width + margin);
  const int bottom = std::min(mask.height, box.y + box.height + margin);
  const int w = std::max(2, (right - field.left) / step);
  const int h = std::max(2, (bottom - field.top) / step);
  cv::Mat1b crop(h * step, w * step, static_cast<std::uint8_t>(0));
  const cv::Rect window(field.left,
                        field.top,
                        std::min(w * step, mask.width - field.left),
                        std::min(h * step, mask.height - field.top));
  cv::Mat1b inside = full(window) > 127;
  inside.copyTo(crop(cv::Rect(0, 0, window.width, window.height)));
  cv::Mat1f to_outside, to_inside;
  cv::distanceTransform(crop, to_outside, cv::DIST_L2, cv::DIST_MASK_5);
  cv::distanceTransform(~crop, to_inside, cv::DIST_L2, cv::DIST_MASK_5);
  // The contour runs half a pixel beyond the last inner centre.
  cv::Mat1f distance = to_outside - to_inside;
  const auto far = static_cast<float>(mask.width + mask.height);
  for (int y = 0; y < distance.rows; ++y) {
    float* row = distance.ptr<float>(y);
    for (int x = 0; x < distance.cols; ++x) {
      row[x] = std::clamp(row[x] + (row[x] > 0 ? -0.5F : 0.5F), -far, far);
    }
  }
  cv::GaussianBlur(distance, distance, {3, 3}, 0.8);
  field.value = ImageF(w, h, 1);
  const float scale = 1.0F / static_cast<float>(step * step);
  for (int j = 0; j < h; ++j) {
    for (int i = 0; i < w; ++i) {
      float sum = 0;
      for (int v = 0; v < step; ++v) {
        const float* row = distance.ptr<float>(j * step + v) + i * step;
        for (int u = 0; u < step; ++u) sum += row[u];
      }
      field.value.At(i, j) = sum * scale;
    }
  }
  return field;
}

Contour SampleContour(const DistanceField& field, float spacing) {
  Contour contour;
  // Crossings of the zero level on the grid's lines; one of several is kept, in scan order, by
  // carrying the length since the last one kept in each block of the grid.
  const int w = field.value.width;
  const int h = field.value.height;
  const auto step = static_cast<float>(field.step);
  const auto center = [&](float i, float j) {
    return Vec2f(static_cast<float>(field.left) + step * (i + 0.5F),
                 static_cast<float>(field.top) + step * (j + 0.5F));
  };
  const int block = std::max(1, static_cast<int>(std::lround(spacing / step)));
  const int bw = (w + block - 1) / block;
  std::vector<char> taken(
      static_cast<std::size_t>(bw) * static_cast<std::size_t>((h + block - 1) / block), 0);
  int crossings = 0;
  const auto border = 2 * step;
  for (int j = 0; j < h; ++j) {
    for (int i = 0; i < w; ++i) {
      const float a = field.value.At(i, j);
      for (int k = 0; k < 2; ++k) {
        const int u = i + (k == 0 ? 1 : 0);
        const int v = j + (k == 0 ? 0 : 1);
        if (u >= w || v >= h) continue;
        const float b = field.value.At(u, v);
        if ((a > 0) == (b > 0)) continue;
        ++crossings;
        const float t = a / (a - b);
        const Vec2f p = center(static_cast<float>(i) + (k == 0 ? t : 0),
                               static_cast<float>(j) + (k == 0 ? 0 : t));
        if (p.x() < border || p.y() < border || p.x() > static_cast<float>(field.width) - border ||
            p.y() > static_cast<float>(field.height) - border) {
          continue;
        }
        char& used = taken[static_cast<std::size_t>(j / block) * static_cast<std::size_t>(bw) +
                           static_cast<std::size_t>(i / block)];
        if (used != 0) continue;
        const Vec2f g = field.Gradient(p);
        if (g.squaredNorm() < 0.04F) continue;  // a ridge of something thinner than a cell
        used = 1;
        contour.samples.push_back({p, -g.normalized()});
      }
    }
  }
  // A contour of length L crosses about 4/π L / step grid lines.
  const float length = static_cast<float>(crossings) * step * kPi / 4;
  contour.spacing =
      contour.samples.empty() ? spacing : length / static_cast<float>(contour.samples.size());
  return contour;
}

}  // namespace dyxel::internal
