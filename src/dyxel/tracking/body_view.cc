#include "dyxel/tracking/body_view.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/parallel.h"
#include "dyxel/mesh/adjacency.h"
#include "dyxel/tracking/silhouettes.h"

namespace dyxel::internal {

Projector::Projector(const Camera& camera)
    : camera_(&camera),
      distorted_(camera.HasDistortion()),
      rotation_(camera.cam_from_world.rotation.cast<float>()),
      translation_(camera.cam_from_world.translation.cast<float>()),
      fx_(static_cast<float>(camera.fx)),
      fy_(static_cast<float>(camera.fy)),
      cx_(static_cast<float>(camera.cx)),
      cy_(static_cast<float>(camera.cy)) {}

Vec3f Projector::operator()(const Vec3f& x_in_world) const {
  const Vec3f x = rotation_ * x_in_world + translation_;
  if (distorted_) {
    if (x.z() <= 0) return {0, 0, x.z()};
    const Vec2f p = camera_->Project(x_in_world.cast<double>()).cast<float>();
    return {p.x(), p.y(), x.z()};
  }
  const float w = 1.0F / x.z();
  return {fx_ * x.x() * w + cx_, fy_ * x.y() * w + cy_, x.z()};
}

Eigen::Matrix<float, 2, 3> Projector::Jacobian(const Vec3f& x_in_world) const {
  if (distorted_) return camera_->ProjectJacobian(x_in_world.cast<double>()).cast<float>();
  const Vec3f x = rotation_ * x_in_world + translation_;
  const float w = 1.0F / x.z();
  Eigen::Matrix<float, 2, 3> d;
  d << fx_ * w, 0, -fx_ * x.x() * w * w, 0, fy_ * w, -fy_ * x.y() * w * w;
  return d * rotation_;
}

Vec2f Projector::Direction(const Vec3f& x_in_world, const Vec3f& direction) const {
  const Vec3f x = rotation_ * x_in_world + translation_;
  const Vec3f d = rotation_ * direction;
  const Vec2f v(fx_ * (d.x() * x.z() - x.x() * d.z()), fy_ * (d.y() * x.z() - x.y() * d.z()));
  const float n = v.norm();
  if (!(n > 1e-12F)) return Vec2f::Zero();
  return v / n;
}

Observation Observe(std::span<const Camera> cameras,
                    std::span<const ImageU8> masks,
                    const Vec3d& center,
                    int max_cells,
                    std::span<const char> partial) {
  std::vector<View> views(cameras.size());
  ParallelFor(cameras.size(), [&](std::size_t c) {
    const ImageU8& mask = masks[c];
    if (mask.empty() ||
        std::none_of(mask.data.begin(), mask.data.end(), [](std::uint8_t v) { return v > 127; })) {
      return;
    }
    const Camera& camera = cameras[c];
    const double depth = camera.Depth(center);
    if (depth <= 0) return;
    View& view = views[c];
    const int size = std::max(mask.width, mask.height);
    const int step = std::max(1, (size + max_cells - 1) / max_cells);
    view.field = MakeDistanceField(mask, step, std::max(2 * step, size / 12));
    view.metres_per_pixel = static_cast<float>(depth / camera.fx);
    view.contour = SampleContour(view.field, std::max(1.5F, 0.015F / view.metres_per_pixel));
    view.area = static_cast<float>(std::count_if(
        view.field.value.data.begin(), view.field.value.data.end(), [](float v) { return v > 0; }));
    if (view.area > 0) view.camera = &camera;
    if (partial.empty() || partial[c] == 0) return;
    ImageU8 possible = mask;
    for (std::uint8_t& v : possible.data) v = v >= kMaskUnknown ? 255 : 0;
    view.outer = MakeDistanceField(possible, step, std::max(2 * step, size / 12));
    // A contour is one only where it is the plate that begins there.
    std::erase_if(view.contour.samples, [&](const ContourSample& s) {
      return std::abs(view.outer.At(s.pixel)) > 1.5F * static_cast<float>(step);
    });
  });
  // A person is about as large in all views; those that see little of him must not count more.
  std::vector<float> areas;
  const auto cell = [](const View& view) {
    const float size = view.metres_per_pixel * static_cast<float>(view.field.step);
    return size * size;
  };
  for (const View& view : views) {
    if (view.camera != nullptr && !view.partial()) areas.push_back(view.area * cell(view));
  }
  if (areas.empty()) {
    for (const View& view : views) {
      if (view.camera != nullptr) areas.push_back(view.area * cell(view));
    }
  }
  std::sort(areas.begin(), areas.end());
  for (View& view : views) {
    if (view.camera == nullptr) continue;
    view.norm = view.area;
    if (view.partial()) view.norm = std::max(view.area, areas[areas.size() / 2] / cell(view));
  }
  Observation observation;
  for (View& view : views) {
    if (view.camera != nullptr) observation.views.push_back(std::move(view));
  }
  return observation;
}

OutlineTopology MakeOutlineTopology(std::span<const Triangle> triangles, int num_vertices) {
  OutlineTopology topology;
  const auto opposite = OppositeHalfEdges(triangles, num_vertices);
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    for (std::size_t e = 0; e < 3; ++e) {
      const int other = opposite[f][e] < 0 ? -1 : opposite[f][e] / 3;
      if (other < static_cast<int>(f)) continue;  // each edge once; borders are no outlines
      topology.edges.push_back(
          {triangles[f][e], triangles[f][(e + 1) % 3], static_cast<int>(f), other});
    }
  }
  return topology;
}

void BodyView::Prepare(const View& view) {
  const int step = view.field.step;
  const int w = view.field.width / step;
  const int h = view.field.height / step;
  if (w == width_ && h == height_) return;
  width_ = w;
  height_ = h;
  drawn_.assign(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), 0);
  x0_ = y0_ = 0;
  x1_ = y1_ = -1;
}

void BodyView::Clear(const View& view) {
  Prepare(view);
  for (int y = y0_; y <= y1_; ++y) {
    std::fill_n(drawn_.begin() + static_cast<std::ptrdiff_t>(y) * width_ + x0_, x1_ - x0_ + 1, 0);
  }
  x0_ = width_;
  y0_ = height_;
  x1_ = y1_ = -1;
}

void BodyView::Draw(const View& view,
                    std::span<const Vec3f> positions,
                    std::span<const Triangle> triangles,
                    std::span<const int> subset) {
  const Projector project(*view.camera);
  const float scale = 1.0F / static_cast<float>(view.field.step);
  pixels_.resize(positions.size());
  if (subset.empty()) {
    for (std::size_t v = 0; v < positions.size(); ++v) pixels_[v] = project(positions[v]);
  } else {
    for (const int f : subset) {
      for (const int v : triangles[static_cast<std::size_t>(f)]) {
        pixels_[static_cast<std::size_t>(v)] = project(positions[static_cast<std::size_t>(v)]);
      }
    }
  }
  front_.assign(triangles.size(), 0);
  const auto draw = [&](std::size_t f) {
    const Vec3f& a = pixels_[static_cast<std::size_t>(triangles[f][0])];
    const Vec3f& b = pixels_[static_cast<std::size_t>(triangles[f][1])];
    const Vec3f& c = pixels_[static_cast<std::size_t>(triangles[f][2])];
    if (!(a.z() > 0 && b.z() > 0 && c.z() > 0)) return;
    const float area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
    // y points down: what is counter-clockwise from outside turns the other way.
    if (!(area < 0)) return;
    front_[f] = 1;
    const float ax = a.x() * scale - 0.5F, ay = a.y() * scale - 0.5F;
    const float bx = b.x() * scale - 0.5F, by = b.y() * scale - 0.5F;
    const float cx = c.x() * scale - 0.5F, cy = c.y() * scale - 0.5F;
    const int top = std::max(0, static_cast<int>(std::ceil(std::min({ay, by, cy}))));
    const int bottom = std::min(height_ - 1, static_cast<int>(std::floor(std::max({ay, by, cy}))));
    for (int y = top; y <= bottom; ++y) {
      const auto yy = static_cast<float>(y);
      float low = 1e30F, high = -1e30F;
      const auto cross = [&](float px, float py, float qx, float qy) {
        if (std::min(py, qy) > yy || std::max(py, qy) < yy) return;
        if (py == qy) {
          low = std::min({low, px, qx});
          high = std::max({high, px, qx});
          return;
        }
        const float t = (yy - py) / (qy - py);
        const float x = px + t * (qx - px);
        low = std::min(low, x);
        high = std::max(high, x);
      };
      cross(ax, ay, bx, by);
      cross(bx, by, cx, cy);
      cross(cx, cy, ax, ay);
      const int left = std::max(0, static_cast<int>(std::ceil(std::max(low, -1.0F))));
      const int right = std::min(width_ - 1, static_cast<int>(std::floor(std::min(high, 1e6F))));
      if (left > right) continue;
      std::fill_n(drawn_.begin() + static_cast<std::ptrdiff_t>(y) * width_ + left,
                  right - left + 1,
                  std::uint8_t{1});
      x0_ = std::min(x0_, left);
      x1_ = std::max(x1_, right);
      y0_ = std::min(y0_, y);
      y1_ = std::max(y1_, y);
    }
  };
  if (subset.empty()) {
    for (std::size_t f = 0; f < triangles.size(); ++f) draw(f);
  } else {
    for (const int f : subset) draw(static_cast<std::size_t>(f));
  }
}

Overlap BodyView::Compare(const View& view) const {
  const DistanceField& field = view.field;
  const int left = field.left / field.step;
  const int top = field.top / field.step;
  int both = 0, model = 0;
  for (int y = y0_; y <= y1_; ++y) {
    const std::uint8_t* row =
        &drawn_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_)];
    int count = 0;
    for (int x = x0_; x <= x1_; ++x) count += row[x];
    model += count;
    if (y < top || y >= top + field.value.height) continue;
    const float* inside = &field.value.data[field.value.Index(0, y - top)] - left;
    const int begin = std::max(x0_, left);
    const int end = std::min(x1_ + 1, left + field.value.width);
    count = 0;
    for (int x = begin; x < end; ++x) count += inside[x] > 0 ? row[x] : 0;
    both += count;
  }
  if (view.partial()) {
    const DistanceField& outer = view.outer;
    for (int y = y0_; y <= y1_; ++y) {
      const int v = y - outer.top / outer.step;
      if (v < 0 || v >= outer.value.height) continue;
      for (int x = x0_; x <= x1_; ++x) {
        const int u = x - outer.left / outer.step;
        if (u < 0 || u >= outer.value.width || outer.value.At(u, v) <= 0) continue;
        const bool person = x >= left && x < left + field.value.width && y >= top &&
                            y < top + field.value.height && field.value.At(x - left, y - top) > 0;
        if (!person)
          model -= drawn_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                          static_cast<std::size_t>(x)];
      }
    }
  }
  Overlap overlap;
  overlap.both = static_cast<float>(both);
  overlap.model = static_cast<float>(model);
  overlap.either = view.area + overlap.model - overlap.both;
  return overlap;
}

bool BodyView::Covered(const View& view, const Vec2f& pixel) const {
  const float scale = 1.0F / static_cast<float>(view.field.step);
  const int x = static_cast<int>(std::floor(pixel.x() * scale));
  const int y = static_cast<int>(std::floor(pixel.y() * scale));
  if (x < 0 || y < 0 || x >= width_ || y >= height_) return false;
  return drawn_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                static_cast<std::size_t>(x)] != 0;
}

void BodyView::FindRims(const View& view,
                        std::span<const Vec3f> positions,
                        std::span<const Vec3f> normals,
                        const OutlineTopology& topology,
                        std::vector<Rim>& rims) {
  const Projector project(*view.camera);
  rims.clear();
  lengths_.assign(positions.size(), 0.0F);
  for (const OutlineTopology::Edge& edge : topology.edges) {
    if (front_[static_cast<std::size_t>(edge.f)] == front_[static_cast<std::size_t>(edge.g)]) {
      continue;
    }
    const auto a = static_cast<std::size_t>(edge.a);
    const auto b = static_cast<std::size_t>(edge.b);
    if (!(pixels_[a].z() > 0 && pixels_[b].z() > 0)) continue;
    const float half = 0.5F * (pixels_[a] - pixels_[b]).head<2>().norm();
    lengths_[a] += half;
    lengths_[b] += half;
  }
  const auto step = static_cast<float>(view.field.step);
  const auto border = 2 * step;
  for (std::size_t v = 0; v < positions.size(); ++v) {
    if (lengths_[v] == 0) continue;
    const Vec2f pixel = pixels_[v].head<2>();
    if (pixel.x() < border || pixel.y() < border ||
        pixel.x() > static_cast<float>(view.field.width) - border ||
        pixel.y() > static_cast<float>(view.field.height) - border) {
      continue;  // the picture ends there
    }
    const Vec2f normal = project.Direction(positions[v], normals[v]);
    if (normal.squaredNorm() < 0.5F) continue;
    // Only the true outline: nothing of the body just beyond it.
    if (Covered(view, pixel + 1.5F * step * normal) || Covered(view, pixel + 3 * step * normal)) {
      continue;
    }
    rims.push_back({static_cast<int>(v), pixel, normal, lengths_[v]});
  }
}

}  // namespace dyxel::internal
