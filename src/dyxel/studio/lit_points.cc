#include "dyxel/studio/lit_points.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/parallel.h"

namespace dyxel::studio {

void PlaceOnSubject(const Subject& subject,
                    int triangle,
                    const Vec3f& bary,
                    const Vec3f& direction,
                    std::size_t lane,
                    Points& points) {
  const Triangle& t = subject.triangles[static_cast<std::size_t>(triangle)];
  Vec3f p = Vec3f::Zero();
  Vec3f n = Vec3f::Zero();
  for (int c = 0; c < 3; ++c) {
    const auto v = static_cast<std::size_t>(t[static_cast<std::size_t>(c)]);
    p += bary[c] * subject.positions[v];
    n += bary[c] * subject.normals[v];
  }
  n.normalize();
  // Soft terminator: shadow rays leave from a smooth surface over the facets (Hanika, "Hacking the
  // shadow terminator", Ray Tracing Gems II, 2021).
  Vec3f lifted = Vec3f::Zero();
  for (int c = 0; c < 3; ++c) {
    const auto v = static_cast<std::size_t>(t[static_cast<std::size_t>(c)]);
    const Vec3f& corner_normal = subject.normals[v];
    const float below = std::min((p - subject.positions[v]).dot(corner_normal), 0.0F);
    lifted -= bary[c] * below * corner_normal;
  }
  points.active[lane] = true;
  points.normal[lane] = n;
  points.position[lane] = p + lifted + 3e-4F * n;
  points.view[lane] = -direction;
  points.material[lane] = subject.material(triangle, bary);
}

Packet<Rgb> DirectLight(const Subject& subject,
                        const Lighting& lighting,
                        const Points& points,
                        bool irradiance_only,
                        Packet<Random>& random) {
  Packet<Rgb> sum;
  sum.fill(Rgb::Zero());
  const auto reflected = [&](std::size_t i, const Vec3f& l) -> Rgb {
    if (irradiance_only) return Rgb::Ones();
    const StudioBrdfValue f =
        EvaluateStudioBrdf(points.material[i], points.normal[i], l, points.view[i]);
    return f.diffuse + f.specular;
  };
  const auto add = [&](const RayPacket& shadow, const Packet<Rgb>& light) {
    if (std::none_of(shadow.active.begin(), shadow.active.end(), [](bool a) { return a; })) return;
    const Packet<bool> occluded = subject.tracer->Occluded(shadow, true);
    for (std::size_t i = 0; i < kRays; ++i) {
      if (shadow.active[i] && !occluded[i]) sum[i] += light[i];
    }
  };
  const auto aim = [&](RayPacket& shadow, std::size_t i, const Vec3f& to_light, float distance) {
    shadow.active[i] = true;
    shadow.origin[i] = points.position[i];
    shadow.direction[i] = to_light;
    shadow.near[i] = 2e-4F;
    shadow.far[i] = distance;
  };
  if (lighting.environment == nullptr) {
    for (const Light& lamp : lighting.lamps) {
      RayPacket shadow;
      Packet<Rgb> light;
      for (std::size_t i = 0; i < kRays; ++i) {
        if (!points.active[i]) continue;
        const LampRay at = LampAt(lamp, points.position[i]);
        const float cosine = points.normal[i].dot(at.to_light);
        if (cosine <= 0 || at.irradiance.maxCoeff() <= 0) continue;
        light[i] = at.irradiance * cosine * reflected(i, at.to_light);
        aim(shadow, i, at.to_light, at.distance);
      }
      add(shadow, light);
    }
    return sum;
  }
  const int count = lighting.environment_samples;
  // A lattice (Roberts 2018, "R2") over all samples of a pixel or vertex, shifted by its stream.
  Packet<Vec2f> start;
  for (std::size_t i = 0; i < kRays; ++i) {
    const float u = random[i].Uniform();
    start[i] = {u, random[i].Uniform()};
  }
  for (int k = 0; k < count; ++k) {
    RayPacket shadow;
    Packet<Rgb> light;
    for (std::size_t i = 0; i < kRays; ++i) {
      if (!points.active[i]) continue;
      const auto n = static_cast<float>(points.sample[i] * count + k);
      const float u = start[i].x() + 0.7548776662F * n;
      const float v = start[i].y() + 0.5698402910F * n;
      const StudioEnvironment::Sample drawn =
          lighting.environment->Draw(u - std::floor(u), v - std::floor(v));
      const float cosine = points.normal[i].dot(drawn.direction);
      if (cosine <= 0) continue;
      light[i] = lighting.environment->Lookup(drawn.direction) *
                 (cosine / (drawn.pdf * static_cast<float>(count))) * reflected(i, drawn.direction);
      aim(shadow, i, drawn.direction, 1e4F);
    }
    add(shadow, light);
  }
  return sum;
}

namespace {

Packet<Random> Streams(std::uint64_t seed, std::size_t first) {
  return {Random(seed, first),
          Random(seed, first + 1),
          Random(seed, first + 2),
          Random(seed, first + 3),
          Random(seed, first + 4),
          Random(seed, first + 5),
          Random(seed, first + 6),
          Random(seed, first + 7)};
}

// Radiosity of the room's point that a ray meets, lit by lamps alone and without the subject's
// shadow: at a bounce's share of the light its edges would not show.
Rgb RoomRadiosity(const Lighting& lighting, const Vec3f& origin, const Vec3f& direction) {
  const RoomPoint point = MeetRoom(lighting.room, origin, direction);
  Rgb irradiance = Rgb::Zero();
  if (point.distance <= 0) return irradiance;
  for (const Light& lamp : lighting.lamps) {
    const LampRay at = LampAt(lamp, point.position);
    irradiance += at.irradiance * std::max(point.normal.dot(at.to_light), 0.0F);
  }
  if (irradiance.maxCoeff() <= 0) return irradiance;
  return RoomAlbedo(lighting.room, point) * irradiance;
}

// One vertex's rays.
Rgb GatherAtVertex(const Subject& subject,
                   const Lighting& lighting,
                   std::span<const Rgb> radiosity,
                   std::size_t v,
                   int rays,
                   Random random) {
  const Vec3f& n = subject.normals[v];
  const Vec3f side = n.unitOrthogonal();
  const Vec3f up = n.cross(side);
  const float turn = random.Uniform();
  const float lift = random.Uniform();
  Rgb sum = Rgb::Zero();
  for (int first = 0; first < rays; first += kRays) {
    RayPacket packet;
    for (std::size_t i = 0; i < kRays; ++i) {
      const int k = first + static_cast<int>(i);
      if (k >= rays) break;
      // A lattice over the cosine-weighted disk, turned vertex by vertex.
      const float a = 2 * kPi * (turn + 0.6180339887F * static_cast<float>(k));
      float r2 = (static_cast<float>(k) + lift) / static_cast<float>(rays);
      const float r = std::sqrt(r2);
      packet.active[i] = true;
      packet.origin[i] = subject.positions[v] + 1e-3F * n;
      packet.direction[i] = r * (std::cos(a) * side + std::sin(a) * up) + std::sqrt(1 - r2) * n;
      packet.near[i] = 1e-3F;
      packet.far[i] = 2.5F;
    }
    const PacketHits hits = subject.tracer->Trace(packet, false);
    for (std::size_t i = 0; i < kRays; ++i) {
      if (hits.triangle[i] < 0) {
        if (packet.active[i]) sum += RoomRadiosity(lighting, packet.origin[i], packet.direction[i]);
        continue;
      }
      const Triangle& t = subject.triangles[static_cast<std::size_t>(hits.triangle[i])];
      Rgb met = Rgb::Zero();
      Vec3f normal = Vec3f::Zero();
      for (int c = 0; c < 3; ++c) {
        const auto corner = static_cast<std::size_t>(t[static_cast<std::size_t>(c)]);
        met += hits.bary[i][c] * radiosity[corner];
        normal += hits.bary[i][c] * subject.normals[corner];
      }
      if (normal.dot(packet.direction[i]) < 0) sum += met;  // not from the inside
    }
  }
  return sum / static_cast<float>(rays);
}

}  // namespace

Rgb AmbientLight(const Lighting& lighting) {
  constexpr int kDirections = 4096;
  const Vec3f middle(0, 0, 0.25F * lighting.room.height);
  Rgb sum = Rgb::Zero();
  for (int k = 0; k < kDirections; ++k) {
    // A spiral of even density over the sphere.
    const float z = 1 - (2 * static_cast<float>(k) + 1) / kDirections;
    const float r = std::sqrt(1 - z * z);
    const float a = 2.3999632F * static_cast<float>(k);
    sum += RoomRadiosity(lighting, middle, Vec3f(r * std::cos(a), r * std::sin(a), z));
  }
  return sum / kDirections;
}

std::vector<Rgb> GatherBounce(const Subject& subject,
                              const Lighting& lighting,
                              int rays,
                              std::uint64_t seed) {
  const std::size_t n = subject.positions.size();
  std::vector<Rgb> radiosity(n, Rgb::Zero());
  // A triangle at each vertex, for its material.
  std::vector<std::pair<int, int>> place(n, {-1, 0});
  for (std::size_t t = 0; t < subject.triangles.size(); ++t) {
    for (int c = 0; c < 3; ++c) {
      place[static_cast<std::size_t>(subject.triangles[t][static_cast<std::size_t>(c)])] = {
          static_cast<int>(t), c};
    }
  }
  ParallelForBlocks(n, std::size_t{64} * kRays, [&](std::size_t begin, std::size_t end) {
    for (std::size_t first = begin; first < end; first += kRays) {
      Points points;
      for (std::size_t i = 0; i < std::min<std::size_t>(kRays, end - first); ++i) {
        const auto [triangle, corner] = place[first + i];
        if (triangle < 0) continue;
        const Vec3f& normal = subject.normals[first + i];
        PlaceOnSubject(subject, triangle, Vec3f::Unit(corner), -normal, i, points);
      }
      Packet<Random> random = Streams(seed, first);
      const Packet<Rgb> direct = DirectLight(subject, lighting, points, true, random);
      for (std::size_t i = 0; i < std::min<std::size_t>(kRays, end - first); ++i) {
        if (points.active[i]) radiosity[first + i] = points.material[i].albedo * direct[i];
      }
    }
  });
  std::vector<Rgb> bounce(n);
  ParallelForBlocks(n, 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
      bounce[v] = GatherAtVertex(subject, lighting, radiosity, v, rays, Random(seed + 1, v));
    }
  });
  return bounce;
}

}  // namespace dyxel::studio
