#include "dyxel/studio/picture.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/parallel.h"
#include "dyxel/base/random.h"
#include "dyxel/studio/lit_points.h"
#include "dyxel/studio/noise.h"

namespace dyxel::studio {
namespace {

// The additive recurrence of Roberts 2018 ("R2"), turned by a hash of the pixel.
Vec2f PixelJitter(int x, int y, int sample) {
  const std::uint32_t h =
      HashBits(static_cast<std::uint32_t>(x) + HashBits(static_cast<std::uint32_t>(y) + 0x9e37U));
  const auto n = static_cast<float>(sample);
  const float u = static_cast<float>(h & 0xffffU) * 0x1p-16F + 0.7548776662F * n;
  const float v = static_cast<float>(h >> 16U) * 0x1p-16F + 0.5698402910F * n;
  return {u - std::floor(u), v - std::floor(v)};
}

// A pixel's state after a look through its centre: what the subject covers, which lamps it hides.
constexpr std::uint8_t kCovered = 128;  // bits 0 to 6: lamps in shadow
constexpr std::uint8_t kMaxLamps = 7;

class Picture {
 public:
  Picture(const Subject& subject,
          const Lighting& lighting,
          const Camera& camera,
          const Plate& plate,
          const PictureOptions& options)
      : subject_(subject),
        lighting_(lighting),
        rays_(camera),
        camera_(camera),
        plate_(plate),
        options_(options),
        bounds_(subject.tracer->bounds()),
        window_(ProjectBounds()) {
    // Shadows are looked for a little around the person: rays are aimed from pixel centres.
    bounds_.min() -= Vec3f::Constant(0.04F);
    bounds_.max() += Vec3f::Constant(0.04F);
    shot_.radiance = plate.radiance;
    shot_.mask = ImageU8(camera.width, camera.height, 1, 0);
    if (options.passes) {
      shot_.normal = ImageF(camera.width, camera.height, 3);
      shot_.albedo = ImageF(camera.width, camera.height, 3);
      shot_.depth = ImageF(camera.width, camera.height, 1);
    }
  }

  Shot Run() {
    // Through the centres first: only where neighbours differ, and on the subject, all samples.
    const ImageU8 centers = LookThroughCenters();
    std::vector<int> columns;
    for (int y = 0; y < camera_.height; ++y) {
      columns.clear();
      for (int x = 0; x < camera_.width; ++x) {
        const std::uint8_t state = centers.At(x, y);
        if (state >= kCovered || !UniformAround(centers, x, y)) {
          columns.push_back(x);
        } else if (state != 0) {
          const Rgb radiance = RoomRadiance(x, y, state);
          for (int k = 0; k < 3; ++k) shot_.radiance.At(x, y, k) = radiance[k];
        }
      }
      if (!columns.empty()) ShootRow(y, columns);
    }
    return std::move(shot_);
  }

 private:
  struct Sum {
    Rgb radiance = Rgb::Zero();
    int covered = 0;
    Vec3f normal = Vec3f::Zero();
    Rgb albedo = Rgb::Zero();
    float depth = 0;
  };

  // The subject's box in the picture.
  [[nodiscard]] Rect ProjectBounds() const {
    Vec2d low(1e9, 1e9);
    Vec2d high(-1e9, -1e9);
    for (int c = 0; c < 8; ++c) {
      const auto corner = static_cast<Eigen::AlignedBox3f::CornerType>(c);
      const Vec3d in_cam = camera_.cam_from_world * bounds_.corner(corner).cast<double>();
      if (in_cam.z() < 0.05) return {0, 0, camera_.width, camera_.height};
      const Vec2d pixel(camera_.fx * in_cam.x() / in_cam.z() + camera_.cx,
                        camera_.fy * in_cam.y() / in_cam.z() + camera_.cy);
      low = low.cwiseMin(pixel);
      high = high.cwiseMax(pixel);
    }
    const int x0 = std::clamp(static_cast<int>(std::floor(low.x())) - 1, 0, camera_.width);
    const int y0 = std::clamp(static_cast<int>(std::floor(low.y())) - 1, 0, camera_.height);
    const int x1 = std::clamp(static_cast<int>(std::ceil(high.x())) + 1, 0, camera_.width);
    const int y1 = std::clamp(static_cast<int>(std::ceil(high.y())) + 1, 0, camera_.height);
    return {x0, y0, x1 - x0, y1 - y0};
  }

  [[nodiscard]] bool InWindow(int x, int y) const {
    return x >= window_.x && x < window_.x + window_.width && y >= window_.y &&
           y < window_.y + window_.height;
  }

  [[nodiscard]] bool MeetsBounds(const Vec3f& from, const Vec3f& to_light) const {
    float near = 0;
    float far = 1e9F;
    for (int axis = 0; axis < 3; ++axis) {
      const float inverse = 1 / to_light[axis];
      const float a = (bounds_.min()[axis] - from[axis]) * inverse;
      const float b = (bounds_.max()[axis] - from[axis]) * inverse;
      near = std::max(near, std::min(a, b));
      far = std::min(far, std::max(a, b));
    }
    return near <= far;
  }

  // Which lamps the subject hides from places of the room on eight rays.
  [[nodiscard]] Packet<std::uint8_t> RoomShadows(const Packet<bool>& active,
                                                 const Packet<Vec3f>& direction) const {
    Packet<std::uint8_t> hidden{};
    if (lighting_.environment != nullptr) return hidden;
    Packet<RoomPoint> point;
    for (std::size_t i = 0; i < kRays; ++i) {
      if (active[i]) point[i] = MeetRoom(lighting_.room, rays_.origin(), direction[i]);
    }
    for (std::size_t lamp = 0; lamp < lighting_.lamps.size() && lamp < kMaxLamps; ++lamp) {
      RayPacket shadow;
      bool any = false;
      for (std::size_t i = 0; i < kRays; ++i) {
        if (!active[i] || point[i].distance <= 0) continue;
        const LampRay at = LampAt(lighting_.lamps[lamp], point[i].position);
        if (at.irradiance.maxCoeff() <= 0 || point[i].normal.dot(at.to_light) <= 0 ||
            !MeetsBounds(point[i].position, at.to_light)) {
          continue;
        }
        shadow.active[i] = any = true;
        shadow.origin[i] = point[i].position;
        shadow.direction[i] = at.to_light;
        shadow.near[i] = 1e-3F;
        shadow.far[i] = at.distance;
      }
      if (!any) continue;
      const Packet<bool> occluded = subject_.tracer->Occluded(shadow, true);
      for (std::size_t i = 0; i < kRays; ++i) {
        if (occluded[i]) hidden[i] = static_cast<std::uint8_t>(hidden[i] | (1U << lamp));
      }
    }
    return hidden;
  }

  [[nodiscard]] ImageU8 LookThroughCenters() const {
    ImageU8 state(camera_.width, camera_.height, 1, 0);
    for (int y = 0; y < camera_.height; ++y) {
      for (int first = 0; first < camera_.width; first += kRays) {
        Packet<Vec3f> direction;
        Packet<bool> open{};
        RayPacket rays;
        bool any = false;
        for (int i = 0; i < kRays && first + i < camera_.width; ++i) {
          const auto lane = static_cast<std::size_t>(i);
          direction[lane] =
              rays_.Direction(static_cast<float>(first + i) + 0.5F, static_cast<float>(y) + 0.5F);
          open[lane] = true;
          if (!InWindow(first + i, y)) continue;
          any = rays.active[lane] = true;
          rays.origin[lane] = rays_.origin();
          rays.direction[lane] = direction[lane];
          rays.far[lane] = 1e4F;
        }
        Packet<bool> covered{};
        if (any) covered = subject_.tracer->Occluded(rays, true);
        for (int i = 0; i < kRays && first + i < camera_.width; ++i) {
          const auto lane = static_cast<std::size_t>(i);
          open[lane] = open[lane] && !covered[lane] && IsLit(first + i, y);
        }
        const Packet<std::uint8_t> hidden = RoomShadows(open, direction);
        for (int i = 0; i < kRays && first + i < camera_.width; ++i) {
          const auto lane = static_cast<std::size_t>(i);
          state.At(first + i, y) = covered[lane] ? kCovered : hidden[lane];
        }
      }
    }
    return state;
  }

  // Where the plate is dark no shadow can fall.
  [[nodiscard]] bool IsLit(int x, int y) const {
    const float* pixel = &plate_.radiance.data[plate_.radiance.Index(x, y)];
    return pixel[0] > 0 || pixel[1] > 0 || pixel[2] > 0;
  }

  [[nodiscard]] bool UniformAround(const ImageU8& centers, int x, int y) const {
    const std::uint8_t own = centers.At(x, y);
    for (int v = std::max(y - 1, 0); v <= std::min(y + 1, camera_.height - 1); ++v) {
      for (int u = std::max(x - 1, 0); u <= std::min(x + 1, camera_.width - 1); ++u) {
        if (centers.At(u, v) != own) return false;
      }
    }
    return true;
  }

  // The plate's pixel without the hidden lamps.
  [[nodiscard]] Rgb RoomRadiance(int x, int y, std::uint8_t hidden) const {
    const std::size_t at = plate_.radiance.Index(x, y);
    const auto pixel = [&](const ImageF& image) {
      return Rgb(image.data[at], image.data[at + 1], image.data[at + 2]);
    };
    if (hidden == 0) return pixel(plate_.radiance);
    Rgb sum = Rgb::Zero();
    for (std::size_t lamp = 0; lamp < plate_.of_lamp.size(); ++lamp) {
      if ((hidden & (1U << lamp)) == 0) sum += pixel(plate_.of_lamp[lamp]);
    }
    return sum;
  }

  void ShootRow(int y, const std::vector<int>& columns) {
    std::vector<Sum> sums(columns.size());
    const std::size_t total = columns.size() * static_cast<std::size_t>(options_.samples);
    for (std::size_t first = 0; first < total; first += kRays) {
      ShootPacket(y, columns, first, std::min<std::size_t>(kRays, total - first), sums);
    }
    const float inverse = 1 / static_cast<float>(options_.samples);
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const int x = columns[c];
      const Sum& sum = sums[c];
      for (int k = 0; k < 3; ++k) shot_.radiance.At(x, y, k) = sum.radiance[k] * inverse;
      if (2 * sum.covered < options_.samples) continue;
      shot_.mask.At(x, y) = 255;
      if (!options_.passes) continue;
      const float share = 1 / static_cast<float>(sum.covered);
      const Vec3f n = sum.normal.normalized();
      for (int k = 0; k < 3; ++k) {
        shot_.normal.At(x, y, k) = n[k];
        shot_.albedo.At(x, y, k) = sum.albedo[k] * share;
      }
      shot_.depth.At(x, y) = CenterDepth(x, y, sum.depth * share);
    }
  }

  [[nodiscard]] float CenterDepth(int x, int y, float otherwise) const {
    RayPacket ray;
    ray.active[0] = true;
    ray.origin[0] = rays_.origin();
    ray.direction[0] = rays_.Direction(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
    ray.far[0] = 1e4F;
    const PacketHits hits = subject_.tracer->Trace(ray, true);
    return hits.triangle[0] < 0 ? otherwise : hits.distance[0] * ray.direction[0].dot(rays_.axis());
  }

  // The normal that shading uses: at rims turned until the eye sees its upper side.
  static Vec3f FacingNormal(const Vec3f& n, const Vec3f& view) {
    constexpr float kLeast = 0.03F;
    const float nv = n.dot(view);
    return nv >= kLeast ? n : Vec3f((n + (kLeast - nv) * view).normalized());
  }

  void ShootPacket(int y,
                   const std::vector<int>& columns,
                   std::size_t first,
                   std::size_t count,
                   std::vector<Sum>& sums) const {
    const auto spp = static_cast<std::size_t>(options_.samples);
    RayPacket rays;
    Packet<Vec3f> direction;
    Packet<bool> open{};
    for (std::size_t i = 0; i < count; ++i) {
      const int x = columns[(first + i) / spp];
      const Vec2f jitter = PixelJitter(x, y, static_cast<int>((first + i) % spp));
      direction[i] =
          rays_.Direction(static_cast<float>(x) + jitter.x(), static_cast<float>(y) + jitter.y());
      rays.active[i] = InWindow(x, y);
      rays.origin[i] = rays_.origin();
      rays.direction[i] = direction[i];
      rays.far[i] = 1e4F;
    }
    const PacketHits hits = subject_.tracer->Trace(rays, true);
    Points points;
    for (std::size_t i = 0; i < count; ++i) {
      open[i] = hits.triangle[i] < 0;
      if (open[i]) continue;
      PlaceOnSubject(subject_, hits.triangle[i], hits.bary[i], direction[i], i, points);
      points.sample[i] = static_cast<int>((first + i) % spp);
      Sum& sum = sums[(first + i) / spp];
      sum.covered += 1;
      sum.normal += points.normal[i];
      sum.albedo += points.material[i].albedo;
      sum.depth += hits.distance[i] * direction[i].dot(rays_.axis());
      points.normal[i] = FacingNormal(points.normal[i], points.view[i]);
      if (!subject_.bounce.empty()) {
        sum.radiance += points.material[i].albedo / kPi * BounceAt(hits, i);
      }
    }
    Packet<Random> random = MakeRandom(y, columns, first, count);
    const Packet<Rgb> direct = DirectLight(subject_, lighting_, points, false, random);
    const Packet<std::uint8_t> hidden = RoomShadows(open, direction);
    for (std::size_t i = 0; i < count; ++i) {
      const int x = columns[(first + i) / spp];
      sums[(first + i) / spp].radiance += open[i] ? RoomRadiance(x, y, hidden[i]) : direct[i];
    }
  }

  [[nodiscard]] Rgb BounceAt(const PacketHits& hits, std::size_t i) const {
    const Triangle& t = subject_.triangles[static_cast<std::size_t>(hits.triangle[i])];
    Rgb irradiance = Rgb::Zero();
    for (int c = 0; c < 3; ++c) {
      const auto v = static_cast<std::size_t>(t[static_cast<std::size_t>(c)]);
      irradiance += hits.bary[i][c] * subject_.bounce[v];
    }
    return irradiance;
  }

  // A stream a pixel, so that nothing depends on how samples are packed.
  [[nodiscard]] Packet<Random> MakeRandom(int y,
                                          const std::vector<int>& columns,
                                          std::size_t first,
                                          std::size_t count) const {
    const auto spp = static_cast<std::size_t>(options_.samples);
    const auto stream = [&](std::size_t i) {
      if (i >= count) return Random(options_.seed);
      const auto pixel = static_cast<std::uint64_t>(y) * static_cast<std::uint64_t>(camera_.width) +
                         static_cast<std::uint64_t>(columns[(first + i) / spp]);
      return Random(options_.seed, pixel);
    };
    return {stream(0), stream(1), stream(2), stream(3), stream(4), stream(5), stream(6), stream(7)};
  }

  const Subject& subject_;
  const Lighting& lighting_;
  PinholeRays rays_;
  const Camera& camera_;
  const Plate& plate_;
  PictureOptions options_;
  Eigen::AlignedBox3f bounds_;
  Rect window_;
  Shot shot_;
};

}  // namespace

Plate ShootPlate(const Camera& camera, const Lighting& lighting, int samples) {
  const PinholeRays rays(camera);
  const std::size_t layers = lighting.environment != nullptr ? 1 : lighting.lamps.size() + 1;
  Plate plate;
  plate.radiance = ImageF(camera.width, camera.height, 3);
  plate.of_lamp.assign(layers, plate.radiance);
  ParallelFor(static_cast<std::size_t>(camera.height), [&](std::size_t row) {
    const int y = static_cast<int>(row);
    std::vector<Rgb> sums(layers);
    for (int x = 0; x < camera.width; ++x) {
      std::fill(sums.begin(), sums.end(), Rgb::Zero());
      for (int s = 0; s < samples; ++s) {
        const Vec2f jitter = PixelJitter(x, y, s);
        const Vec3f direction =
            rays.Direction(static_cast<float>(x) + jitter.x(), static_cast<float>(y) + jitter.y());
        if (lighting.environment != nullptr) {
          sums[0] += lighting.environment->Lookup(direction);
          continue;
        }
        const RoomPoint point = MeetRoom(lighting.room, rays.origin(), direction);
        if (point.distance <= 0) continue;
        const Rgb reflected = RoomAlbedo(lighting.room, point) / kPi;
        for (std::size_t lamp = 0; lamp + 1 < layers; ++lamp) {
          const LampRay at = LampAt(lighting.lamps[lamp], point.position);
          const float cosine = point.normal.dot(at.to_light);
          if (cosine > 0) sums[lamp] += reflected * at.irradiance * cosine;
        }
        sums.back() += reflected * lighting.ambient;
      }
      for (std::size_t lamp = 0; lamp < layers; ++lamp) {
        for (int k = 0; k < 3; ++k) {
          const float value = sums[lamp][k] / static_cast<float>(samples);
          plate.of_lamp[lamp].At(x, y, k) = value;
          plate.radiance.At(x, y, k) += value;
        }
      }
    }
  });
  return plate;
}

Shot Shoot(const Subject& subject,
           const Lighting& lighting,
           const Camera& camera,
           const Plate& plate,
           const PictureOptions& options) {
  return Picture(subject, lighting, camera, plate, options).Run();
}

}  // namespace dyxel::studio
