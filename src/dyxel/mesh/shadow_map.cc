#include "dyxel/mesh/shadow_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dyxel {
namespace {

// A rotation whose third row is `forward`.
Mat3f Facing(const Vec3f& forward) {
  const Vec3f helper = std::abs(forward.z()) < 0.9F ? Vec3f::UnitZ() : Vec3f::UnitX();
  Mat3f rotation;
  rotation.row(0) = forward.cross(helper).normalized();
  rotation.row(2) = forward;
  rotation.row(1) = forward.cross(Vec3f(rotation.row(0)));
  return rotation;
}

constexpr float kWidest = 5.6F;    // tangent of 80°: the widest half-angle of a map
constexpr float kNearest = 1e-3F;  // metres; nearer surfaces throw no shadow

}  // namespace

// Rows of map_from_world_: column, row and depth value of the map times the denominator (fourth
// row). The depth value grows towards the eye: 1/z in perspective, 1 + metres before the far end
// otherwise.
ShadowMap ShadowMap::FromPoint(const Vec3f& eye,
                               std::span<const Vec3f> positions,
                               std::span<const Triangle> triangles,
                               int size) {
  ShadowMap map;
  map.perspective_ = true;
  map.eye_ = eye;
  map.size_ = size;
  if (positions.empty()) return map;
  Vec3f low = positions[0];
  Vec3f high = positions[0];
  for (const Vec3f& x : positions) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  Vec3f forward = 0.5F * (low + high) - eye;
  forward = forward.norm() > 0 ? Vec3f(forward.normalized()) : Vec3f(Vec3f::UnitX());
  const Mat3f eye_from_world = Facing(forward);
  Vec2f least = Vec2f::Constant(kWidest);
  Vec2f most = Vec2f::Constant(-kWidest);
  for (const Vec3f& x : positions) {
    const Vec3f in_eye = eye_from_world * (x - eye);
    if (in_eye.z() <= kNearest) continue;
    const Vec2f tangent = in_eye.head<2>() / in_eye.z();
    least = least.cwiseMin(tangent);
    most = most.cwiseMax(tangent);
  }
  least = least.cwiseMax(Vec2f::Constant(-kWidest));
  most = most.cwiseMin(Vec2f::Constant(kWidest));
  const Vec2f extent = (most - least).cwiseMax(Vec2f::Constant(1e-6F));
  const float margin = 2.0F;  // texels around the surface
  const Vec2f scale = (static_cast<float>(size) - 2 * margin) * extent.cwiseInverse();
  Mat4f& m = map.map_from_world_;
  m.setZero();
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::RowVector3f row = scale[axis] * eye_from_world.row(axis) +
                                   (margin - scale[axis] * least[axis]) * eye_from_world.row(2);
    m.block<1, 3>(axis, 0) = row;
    m(axis, 3) = -row.dot(eye);
  }
  m(2, 3) = 1;
  m.block<1, 3>(3, 0) = eye_from_world.row(2);
  m(3, 3) = -eye_from_world.row(2).dot(eye);
  map.texel_size_ = 1.0F / scale.minCoeff();
  map.Draw(positions, triangles);
  return map;
}

ShadowMap ShadowMap::FromDirection(const Vec3f& to_light,
                                   std::span<const Vec3f> positions,
                                   std::span<const Triangle> triangles,
                                   int size) {
  ShadowMap map;
  map.perspective_ = false;
  map.eye_ = to_light;
  map.size_ = size;
  if (positions.empty()) return map;
  const Mat3f eye_from_world = Facing(-to_light);
  Vec3f least = Vec3f::Constant(std::numeric_limits<float>::max());
  Vec3f most = -least;
  for (const Vec3f& x : positions) {
    const Vec3f in_eye = eye_from_world * x;
    least = least.cwiseMin(in_eye);
    most = most.cwiseMax(in_eye);
  }
  const Vec2f extent = (most - least).head<2>().cwiseMax(Vec2f::Constant(1e-6F));
  const float margin = 2.0F;
  const Vec2f scale = (static_cast<float>(size) - 2 * margin) * extent.cwiseInverse();
  Mat4f& m = map.map_from_world_;
  m.setZero();
  for (int axis = 0; axis < 2; ++axis) {
    m.block<1, 3>(axis, 0) = scale[axis] * eye_from_world.row(axis);
    m(axis, 3) = margin - scale[axis] * least[axis];
  }
  m.block<1, 3>(2, 0) = -eye_from_world.row(2);
  m(2, 3) = 1 + most.z();
  m(3, 3) = 1;
  map.texel_size_ = 1.0F / scale.minCoeff();
  map.Draw(positions, triangles);
  return map;
}

void ShadowMap::Draw(std::span<const Vec3f> positions, std::span<const Triangle> triangles) {
  std::vector<ScreenVertex> vertices(positions.size());
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const Vec4f p = map_from_world_ * positions[v].homogeneous();
    vertices[v] = p.w() > kNearest ? ScreenVertex{p.x() / p.w(), p.y() / p.w(), p.z() / p.w()}
                                   : ScreenVertex{0, 0, 0};
  }
  depth_ = RasterizeDepth(vertices, triangles, size_, size_);
}

float ShadowMap::Visible(const Vec3f& x, const Vec3f& normal) const {
  if (depth_.empty()) return 1;
  const Vec3f to_light = perspective_ ? Vec3f(eye_ - x) : eye_;
  // Off the axis too, what counts is the normal's angle to the axis, along which depth is measured.
  const Vec3f axis = perspective_ ? Vec3f(map_from_world_.block<1, 3>(3, 0)) : eye_;
  const float texel = perspective_ ? texel_size_ * std::abs(axis.dot(to_light)) : texel_size_;
  const float cosine = normal.dot(axis);
  const float sine = std::sqrt(std::max(1 - cosine * cosine, 0.0F));
  // The filter reaches 1.5 texels along each axis: on a plane that is up to 1.5 √2 texels times the
  // tangent nearer the light, which an offset of sine times as much along the normal makes up for.
  const float side = normal.dot(to_light) < 0 ? -1.0F : 1.0F;  // a sheet lit from behind
  const Vec3f moved =
      x + normal * (side * texel * (0.3F + 2.2F * sine)) + to_light.normalized() * (0.25F * texel);
  const Vec4f p = map_from_world_ * moved.homogeneous();
  if (p.w() <= kNearest) return 1;
  const float scale = 1.0F / p.w();
  const float value = p.z() * scale;
  const float column_f = p.x() * scale;
  const float row_f = p.y() * scale;
  const auto limit = static_cast<float>(size_ - 1);
  if (!(column_f >= 1 && row_f >= 1 && column_f < limit && row_f < limit)) return 1;
  const int column = static_cast<int>(column_f);
  const int row = static_cast<int>(row_f);
  const float* at = depth_.data() +
                    static_cast<std::size_t>(row - 1) * static_cast<std::size_t>(size_) +
                    static_cast<std::size_t>(column - 1);
  int lit = 0;
  for (int j = 0; j < 3; ++j, at += size_) {
    lit += static_cast<int>(at[0] <= value) + static_cast<int>(at[1] <= value) +
           static_cast<int>(at[2] <= value);
  }
  return static_cast<float>(lit) * (1.0F / 9.0F);
}

}  // namespace dyxel
