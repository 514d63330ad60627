// One camera's picture of the person in the room: lamps or an environment, hard shadows, one
// diffuse bounce off the person and the room.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "dyxel/capture/camera.h"
#include "dyxel/capture/light.h"
#include "dyxel/image/image.h"
#include "dyxel/studio/brdf.h"
#include "dyxel/studio/optics.h"
#include "dyxel/studio/room.h"
#include "dyxel/studio/tracer.h"

namespace dyxel::studio {

// What stands in the room at one time step. The spans must outlive it.
struct Subject {
  const Tracer* tracer = nullptr;
  std::span<const Vec3f> positions;     // (V) world
  std::span<const Vec3f> normals;       // (V) unit: the shading normals
  std::span<const Triangle> triangles;  // (F)
  // The material at a point of a triangle; called from many threads.
  std::function<StudioMaterial(int triangle, const Vec3f& bary)> material;
  // (V) irradiance over one other place of the subject (GatherBounce); empty for none.
  std::span<const Rgb> bounce = {};
};

// Lamps and the room they light; or, with an environment, that alone.
struct Lighting {
  std::vector<Light> lamps;
  Room room;
  const StudioEnvironment* environment = nullptr;
  int environment_samples = 8;  // light directions a pixel sample
  Rgb ambient = Rgb::Zero();    // irradiance on the room by the room itself, taken as even
};

struct PictureOptions {
  int samples = 8;         // a pixel
  bool passes = false;     // also normal, albedo, depth
  std::uint64_t seed = 1;  // of the environment's directions
};

// What a camera sees without the subject, by lamp, so that a shadow takes away its lamp's share.
struct Plate {
  // [lamps + 1] of [h][w][3], the last by ambient light; with an environment: that alone.
  std::vector<ImageF> of_lamp;
  ImageF radiance;  // [h][w][3] their sum
};
[[nodiscard]] Plate ShootPlate(const Camera& camera, const Lighting& lighting, int samples);

// The irradiance that reaches each vertex over one diffuse reflection elsewhere on the subject or
// on the room: the direct light at the vertices, then `rays` cosine-distributed rays from each
// vertex, which look up what they meet. Under an environment there is no room. (V). Parallel over
// vertices.
[[nodiscard]] std::vector<Rgb> GatherBounce(const Subject& subject,
                                            const Lighting& lighting,
                                            int rays,
                                            std::uint64_t seed);

// The light that the lamps' room gives itself: the mean over all directions of what the lit room
// sends to its middle, a stand-in for its irradiance everywhere.
[[nodiscard]] Rgb AmbientLight(const Lighting& lighting);

struct Shot {
  ImageF radiance;  // [h][w][3]
  ImageU8 mask;     // 255 where the subject covers at least half of the pixel
  // With passes, on the mask, 0 elsewhere: world normal and diffuse albedo (means over the pixel),
  // z along the camera's axis at the pixel's centre (the mean where the centre misses).
  ImageF normal, albedo, depth;
};

// `plate` is ShootPlate's with the same camera, lighting and samples: where the subject and its
// shadow are not, the picture is the plate. Single-threaded: shoot several pictures at once.
[[nodiscard]] Shot Shoot(const Subject& subject,
                         const Lighting& lighting,
                         const Camera& camera,
                         const Plate& plate,
                         const PictureOptions& options);

}  // namespace dyxel::studio
