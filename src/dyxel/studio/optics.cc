#include "dyxel/studio/optics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "dyxel/base/parallel.h"
#include "dyxel/studio/noise.h"

namespace dyxel::studio {

PinholeRays::PinholeRays(const Camera& camera) {
  const Mat3d world_from_cam = camera.cam_from_world.rotation.transpose();
  origin_ = (-(world_from_cam * camera.cam_from_world.translation)).cast<float>();
  const Vec3d right = world_from_cam.col(0) / camera.fx;
  const Vec3d down = world_from_cam.col(1) / camera.fy;
  axis_ = world_from_cam.col(2).cast<float>();
  corner_ = (world_from_cam.col(2) - right * camera.cx - down * camera.cy).cast<float>();
  right_ = right.cast<float>();
  down_ = down.cast<float>();
}

LampRay LampAt(const Light& light, const Vec3f& x) {
  if (light.type == LightType::kDirectional) {
    return {-light.direction.cast<float>(), 1e4F, light.irradiance};
  }
  const Vec3f d = light.position.cast<float>() - x;
  const float squared = d.squaredNorm();
  const float distance = std::sqrt(squared);
  LampRay ray{d / distance, distance, light.intensity / squared};
  if (light.type == LightType::kSpot) {
    const float cosine = -ray.to_light.dot(light.direction.cast<float>());
    ray.irradiance *= SmoothStep(static_cast<float>(std::cos(light.cone_outer)),
                                 static_cast<float>(std::cos(light.cone_inner)),
                                 cosine);
  }
  return ray;
}

Camera AimCamera(const std::string& name,
                 const Vec3d& position,
                 const Vec3d& target,
                 int size_px,
                 double focal_in_widths) {
  Camera camera;
  camera.name = name;
  camera.width = camera.height = size_px;
  camera.fx = camera.fy = focal_in_widths * size_px;
  camera.cx = camera.cy = 0.5 * size_px;
  const Vec3d forward = (target - position).normalized();
  const Vec3d right = forward.cross(Vec3d::UnitZ()).normalized();
  camera.cam_from_world.rotation.row(0) = right;
  camera.cam_from_world.rotation.row(1) = forward.cross(right);
  camera.cam_from_world.rotation.row(2) = forward;
  camera.cam_from_world.translation = -(camera.cam_from_world.rotation * position);
  return camera;
}

Light AimSpot(const std::string& name,
              const Vec3d& position,
              const Vec3d& target,
              const Rgb& intensity,
              double cone_inner,
              double cone_outer) {
  Light light;
  light.name = name;
  light.type = LightType::kSpot;
  light.position = position;
  light.direction = (target - position).normalized();
  light.intensity = intensity;
  light.cone_inner = cone_inner;
  light.cone_outer = cone_outer;
  return light;
}

StudioEnvironment::StudioEnvironment(ImageF radiance, double rotation)
    : radiance_(std::move(radiance)), rotation_(static_cast<float>(rotation)) {
  const int w = radiance_.width;
  const int h = radiance_.height;
  const auto luminance = [&](int x, int y) {
    const std::size_t at = radiance_.Index(((x % w) + w) % w, std::clamp(y, 0, h - 1));
    return 0.2126F * radiance_.data[at] + 0.7152F * radiance_.data[at + 1] +
           0.0722F * radiance_.data[at + 2];
  };
  row_cdf_.assign(static_cast<std::size_t>(h) + 1, 0.0F);
  column_cdf_.assign(static_cast<std::size_t>(h) * (static_cast<std::size_t>(w) + 1), 0.0F);
  for (int y = 0; y < h; ++y) {
    const auto row = static_cast<std::size_t>(y);
    float* column = &column_cdf_[row * (static_cast<std::size_t>(w) + 1)];
    const float area = std::sin(kPi * (static_cast<float>(y) + 0.5F) / static_cast<float>(h));
    for (int x = 0; x < w; ++x) {
      // The brightest neighbour bounds what the bilinear look-up can give in this pixel.
      float bound = 1e-6F;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) bound = std::max(bound, luminance(x + dx, y + dy));
      }
      column[x + 1] = column[x] + bound * area;
    }
    row_cdf_[row + 1] = row_cdf_[row] + column[w];
    for (int x = 1; x <= w; ++x) column[x] /= column[w];
  }
  const float total = row_cdf_.back();
  for (float& c : row_cdf_) c /= total;
}

Rgb StudioEnvironment::Lookup(const Vec3f& d) const {
  const int w = radiance_.width;
  const int h = radiance_.height;
  // Turned by `rotation`: what the file shows at azimuth a stands at a + rotation in the world.
  const float azimuth = std::atan2(d.y(), d.x()) - rotation_;
  float u = 0.5F - azimuth / (2 * kPi);
  u -= std::floor(u);
  const float v = 0.5F - std::asin(std::clamp(d.z(), -1.0F, 1.0F)) / kPi;
  const float x = u * static_cast<float>(w) - 0.5F;
  const float y = std::clamp(v * static_cast<float>(h) - 0.5F, 0.0F, static_cast<float>(h - 1));
  const float x_floor = std::floor(x);
  const float ax = x - x_floor;
  const int x0 = (static_cast<int>(x_floor) + w) % w;
  const int x1 = (x0 + 1) % w;
  const int y0 = static_cast<int>(y);
  const int y1 = std::min(y0 + 1, h - 1);
  const float ay = y - static_cast<float>(y0);
  const auto at = [&](int px, int py) {
    const float* p = &radiance_.data[radiance_.Index(px, py)];
    return Rgb(p[0], p[1], p[2]);
  };
  const Rgb top = at(x0, y0) + ax * (at(x1, y0) - at(x0, y0));
  const Rgb bottom = at(x0, y1) + ax * (at(x1, y1) - at(x0, y1));
  return top + ay * (bottom - top);
}

StudioEnvironment::Sample StudioEnvironment::Draw(float u, float v) const {
  const auto w = static_cast<std::size_t>(radiance_.width);
  const auto h = static_cast<std::size_t>(radiance_.height);
  // The cell of a cumulative table and the place within it.
  const auto invert = [](const float* cdf, std::size_t n, float t, float& within) {
    const float* upper = std::upper_bound(cdf + 1, cdf + n, t);
    const auto cell = static_cast<std::size_t>(upper - cdf) - 1;
    const float width = cdf[cell + 1] - cdf[cell];
    within = width > 0 ? std::clamp((t - cdf[cell]) / width, 0.0F, 1.0F) : 0.5F;
    return cell;
  };
  float in_row = 0;
  float in_column = 0;
  const std::size_t y = invert(row_cdf_.data(), h, v, in_row);
  const float* column = &column_cdf_[y * (w + 1)];
  const std::size_t x = invert(column, w, u, in_column);
  const float polar = kPi * (static_cast<float>(y) + in_row) / static_cast<float>(h);
  const float azimuth =
      (0.5F - (static_cast<float>(x) + in_column) / static_cast<float>(w)) * 2 * kPi + rotation_;
  const float share = (row_cdf_[y + 1] - row_cdf_[y]) * (column[x + 1] - column[x]);
  const float sine = std::max(std::sin(polar), 1e-6F);
  const float solid_angle = 2 * kPi * kPi * sine / (static_cast<float>(w) * static_cast<float>(h));
  return {Vec3f(sine * std::cos(azimuth), sine * std::sin(azimuth), std::cos(polar)),
          share / solid_angle};
}

namespace {

// A box of a room seen from 1.2 m above its floor: half sizes and planes in metres.
Rgb RoomRadiance(const Vec3f& d) {
  constexpr float kHalfX = 5.0F;
  constexpr float kHalfY = 4.0F;
  constexpr float kCeiling = 2.6F;
  constexpr float kFloor = -1.2F;
  const float to_x = kHalfX / std::max(std::abs(d.x()), 1e-6F);
  const float to_y = kHalfY / std::max(std::abs(d.y()), 1e-6F);
  const float to_z = d.z() > 0 ? kCeiling / d.z() : kFloor / std::min(d.z(), -1e-6F);
  const float t = std::min({to_x, to_y, to_z});
  const Vec3f p = t * d;
  const auto box = [](float value, float center, float half, float soft) {
    return SmoothStep(half + soft, half - soft, std::abs(value - center));
  };
  Rgb c;
  if (t == to_z && d.z() < 0) {  // planks
    const float plank = std::floor(p.y() / 0.22F);
    const float tone = 0.8F + 0.35F * HashUnit(static_cast<int>(plank), 3, 9) +
                       0.10F * Noise(Vec3f(p.x() * 2.0F, p.y() * 25, plank));
    const float gap = 1 - 0.4F * box(p.y() / 0.22F - plank, 0.0F, 0.03F, 0.02F);
    c = Rgb(0.26F, 0.15F, 0.08F) * tone * gap;
    // The window's light on the floor.
    c += Rgb(0.55F, 0.52F, 0.48F) * box(p.x(), 1.6F, 1.1F, 0.25F) * box(p.y(), 0.3F, 1.3F, 0.3F);
  } else if (t == to_z) {
    c = Rgb(0.42F, 0.41F, 0.39F);
    for (const float lamp : {-2.4F, 0.0F, 2.4F}) {
      c += Rgb(9.0F, 7.8F, 6.0F) * box(p.x(), lamp, 0.35F, 0.06F) * box(p.y(), -0.8F, 1.0F, 0.06F);
    }
  } else if (t == to_x && d.x() > 0) {  // a window front
    c = Rgb(0.30F, 0.31F, 0.33F);
    for (const float pane : {-2.1F, 0.0F, 2.1F}) {
      const float open = box(p.y(), pane, 0.85F, 0.04F) * box(p.z(), 0.65F, 1.25F, 0.05F);
      const float sky = SmoothStep(-0.6F, 1.4F, p.z());
      c += open * (Rgb(2.2F, 3.0F, 4.3F) * sky + Rgb(1.3F, 1.5F, 1.0F) * (1 - sky));
    }
  } else if (t == to_x) {
    const float brick = 0.85F + 0.18F * Noise(Vec3f(p.y() * 5, p.z() * 14, 2));
    c = Rgb(0.30F, 0.13F, 0.09F) * brick;
  } else {
    const bool left = d.y() > 0;
    c = left ? Rgb(0.46F, 0.40F, 0.30F) : Rgb(0.22F, 0.32F, 0.34F);
    c *= 0.92F + 0.08F * Noise(Vec3f(p.x() * 2, p.z() * 2, left ? 5 : 8));
    // A picture, a door, a shelf.
    if (left) {
      c = c + (Rgb(0.55F, 0.16F, 0.10F) - c) * box(p.x(), -1.5F, 0.8F, 0.02F) *
                  box(p.z(), 0.6F, 0.5F, 0.02F);
    } else {
      c = c + (Rgb(0.12F, 0.08F, 0.05F) - c) * box(p.x(), 2.2F, 0.5F, 0.02F) *
                  box(p.z(), -0.15F, 1.05F, 0.02F);
    }
  }
  if (t != to_z) {  // skirting board, and darker towards the corners
    c *= 1 - 0.5F * box(p.z(), kFloor, 0.10F, 0.01F);
  }
  return c;
}

}  // namespace

ImageF MakeEnvironmentMap(int height) {
  constexpr int kSamples = 3;  // a pixel along each side: edges are no stairs
  const int width = 2 * height;
  ImageF map(width, height, 3);
  ParallelFor(static_cast<std::size_t>(height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    for (int x = 0; x < width; ++x) {
      Rgb sum = Rgb::Zero();
      for (int i = 0; i < kSamples * kSamples; ++i) {
        const float u =
            static_cast<float>(x) + (static_cast<float>(i % kSamples) + 0.5F) / kSamples;
        const float v =
            static_cast<float>(y) + (static_cast<float>(i / kSamples) + 0.5F) / kSamples;
        const float azimuth = (0.5F - u / static_cast<float>(width)) * 2 * kPi;
        const float elevation = (0.5F - v / static_cast<float>(height)) * kPi;
        sum += RoomRadiance({std::cos(elevation) * std::cos(azimuth),
                             std::cos(elevation) * std::sin(azimuth),
                             std::sin(elevation)});
      }
      for (int c = 0; c < 3; ++c) map.At(x, y, c) = sum[c] / (kSamples * kSamples);
    }
  });
  return map;
}

}  // namespace dyxel::studio
