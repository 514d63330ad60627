#include "dyxel/studio/picture.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/random.h"

namespace dyxel::studio {
namespace {

struct Surface {
  std::vector<Vec3f> positions, normals;
  std::vector<Triangle> triangles;
};

// A sphere of rings × sectors, smooth normals; inward for a view from inside.
Surface Sphere(const Vec3f& center, float radius, int rings, bool inward = false) {
  Surface s;
  const int sectors = 2 * rings;
  for (int r = 0; r <= rings; ++r) {
    for (int c = 0; c < sectors; ++c) {
      const float polar = kPi * static_cast<float>(r) / static_cast<float>(rings);
      const float azimuth = 2 * kPi * static_cast<float>(c) / static_cast<float>(sectors);
      const Vec3f n(std::sin(polar) * std::cos(azimuth),
                    std::sin(polar) * std::sin(azimuth),
                    std::cos(polar));
      s.positions.push_back(center + radius * n);
      s.normals.push_back(inward ? Vec3f(-n) : n);
      if (r == rings) continue;
      const int a = r * sectors + c;
      const int b = r * sectors + (c + 1) % sectors;
      s.triangles.push_back({a, a + sectors, b + sectors});
      s.triangles.push_back({a, b + sectors, b});
    }
  }
  if (inward) {
    for (Triangle& t : s.triangles) std::swap(t[1], t[2]);
  }
  return s;
}

Subject MakeSubject(const Surface& s, const Tracer& tracer, const StudioMaterial& material) {
  return {&tracer,
          s.positions,
          s.normals,
          s.triangles,
          [material](int, const Vec3f&) { return material; },
          {}};
}

const StudioMaterial kLambert{.albedo = Rgb(0.2F, 0.5F, 0.8F), .specular = 0, .burley = false};

// L = ρ/π · I/d² · cos, cone included, at every pixel of a plane seen from above.
TEST(StudioPicture, LambertianPlaneUnderASpotHasItsClosedForm) {
  Surface plane;
  plane.positions = {{-2, -2, 1}, {2, -2, 1}, {2, 2, 1}, {-2, 2, 1}};
  plane.normals.assign(4, Vec3f::UnitZ());
  plane.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Tracer tracer(plane.positions, plane.triangles);
  Lighting lighting;
  lighting.lamps = {AimSpot("s", {1.2, -0.5, 3.0}, {0.1, 0.2, 1.0}, Rgb(30, 28, 25), 0.25, 0.75)};
  const Camera camera = AimCamera("c", {0.6, 0.4, 4.0}, {0, 0, 1}, 64, 1.5);
  const Plate plate = ShootPlate(camera, lighting, 1);
  const Shot shot =
      Shoot(MakeSubject(plane, tracer, kLambert), lighting, camera, plate, {.samples = 64});
  int lit = 0;
  for (int y = 4; y < 60; ++y) {
    for (int x = 4; x < 60; ++x) {
      // The mean over the pixel.
      double expected = 0;
      for (int i = 0; i < 49; ++i) {
        const int row = i / 7;
        const Vec3d in_cam((x + (i % 7 + 0.5) / 7 - camera.cx) / camera.fx,
                           (y + (row + 0.5) / 7 - camera.cy) / camera.fy,
                           1);
        const Vec3d ray = camera.cam_from_world.rotation.transpose() * in_cam;
        const Vec3d p = Vec3d(0.6, 0.4, 4.0) + ray * (3.0 / -ray.z());
        const Vec3d l = lighting.lamps[0].position - p;
        const double d = l.norm();
        const double in_cone = -l.dot(lighting.lamps[0].direction) / d;
        const double t =
            std::clamp((in_cone - std::cos(0.75)) / (std::cos(0.25) - std::cos(0.75)), 0.0, 1.0);
        expected += 0.5 / kPiD * 28 / (d * d) * (l.z() / d) * t * t * (3 - 2 * t) / 49;
      }
      EXPECT_NEAR(static_cast<double>(shot.radiance.At(x, y, 1)), expected, 5e-3 * expected + 1e-3);
      lit += expected > 0.1 ? 1 : 0;
      EXPECT_EQ(shot.mask.At(x, y), 255);
    }
  }
  EXPECT_GT(lit, 1000);
}

// The outline of a ball is an ellipse whose moments are known by its cone of rays.
TEST(StudioPicture, ProjectedBallLiesWhereTheCameraModelSays) {
  const Vec3f center(0.35F, -0.25F, 1.3F);
  const float radius = 0.22F;
  const Surface ball = Sphere(center, radius, 60);
  const Tracer tracer(ball.positions, ball.triangles);
  const Lighting lighting{
      .lamps = {AimSpot("s", {2, 2, 3}, {0, 0, 1}, Rgb::Constant(9), 0.5, 0.6)}};
  const Camera camera = AimCamera("c", {2.2, 1.0, 1.8}, {0, 0, 1}, 160, 1.2);
  const Plate plate = ShootPlate(camera, lighting, 1);
  const Shot shot = Shoot(MakeSubject(ball, tracer, kLambert),
                          lighting,
                          camera,
                          plate,
                          {.samples = 16, .passes = true});
  // By the format alone: a pixel is covered where its central ray passes within the radius.
  const Vec3d in_cam =
      camera.cam_from_world.rotation * center.cast<double>() + camera.cam_from_world.translation;
  double expected_x = 0, expected_y = 0, expected_area = 0;
  double x_sum = 0, y_sum = 0, area = 0;
  for (int y = 0; y < 160; ++y) {
    for (int x = 0; x < 160; ++x) {
      const Vec3d ray =
          Vec3d((x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, 1)
              .normalized();
      if ((in_cam - ray * ray.dot(in_cam)).norm() < static_cast<double>(radius)) {
        expected_x += x, expected_y += y, expected_area += 1;
      }
      if (shot.mask.At(x, y) != 0) x_sum += x, y_sum += y, area += 1;
    }
  }
  EXPECT_NEAR(x_sum / area, expected_x / expected_area, 0.03);
  EXPECT_NEAR(y_sum / area, expected_y / expected_area, 0.03);
  EXPECT_NEAR(area / expected_area, 1, 0.01);
  // Depth and normal at the ball's nearest point.
  const auto x = static_cast<int>(camera.fx * in_cam.x() / in_cam.z() + camera.cx);
  const auto y = static_cast<int>(camera.fy * in_cam.y() / in_cam.z() + camera.cy);
  const Vec3d ray =
      Vec3d((x + 0.5 - camera.cx) / camera.fx, (y + 0.5 - camera.cy) / camera.fy, 1).normalized();
  const double b = ray.dot(in_cam);
  const double t = b - std::sqrt(b * b - in_cam.squaredNorm() + 0.22 * 0.22);
  EXPECT_NEAR(static_cast<double>(shot.depth.At(x, y)), t * ray.z(), 1e-3);
  const Vec3d normal = camera.cam_from_world.rotation.transpose() * ((t * ray - in_cam) / 0.22);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(static_cast<double>(shot.normal.At(x, y, k)), normal[k], 0.01);
  }
}

// A convex Lambertian body in an environment of constant radiance L shows ρ L everywhere.
TEST(StudioPicture, FurnaceShowsAlbedoTimesRadiance) {
  const Surface ball = Sphere({0, 0, 1}, 0.3F, 24);
  const Tracer tracer(ball.positions, ball.triangles);
  const StudioEnvironment environment(ImageF(32, 16, 3, 0.7F), 0.3);
  Lighting lighting;
  lighting.environment = &environment;
  lighting.environment_samples = 64;
  const Camera camera = AimCamera("c", {2, 0, 1.2}, {0, 0, 1}, 40, 2.0);
  const Plate plate = ShootPlate(camera, lighting, 16);
  EXPECT_NEAR(plate.radiance.At(3, 3, 1), 0.7F, 1e-4F);
  Subject subject = MakeSubject(ball, tracer, kLambert);
  const std::vector<Rgb> bounce = GatherBounce(subject, lighting, 16, 1);
  subject.bounce = bounce;
  const Shot shot = Shoot(subject, lighting, camera, plate, {.samples = 16, .passes = true});
  double sum = 0;
  int count = 0;
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) {
      if (shot.mask.At(x, y) == 0 || shot.mask.At(x - 1, y) == 0 || shot.mask.At(x + 1, y) == 0 ||
          shot.mask.At(x, y - 1) == 0 || shot.mask.At(x, y + 1) == 0) {
        continue;
      }
      EXPECT_NEAR(shot.radiance.At(x, y, 1), 0.5F * 0.7F, 0.02F);
      sum += static_cast<double>(shot.radiance.At(x, y, 1));
      ++count;
    }
  }
  ASSERT_GT(count, 200);
  EXPECT_NEAR(sum / count, 0.35, 0.002);
}

// Facets that face away from the lamp under normals that face it must not turn black.
TEST(StudioPicture, TerminatorOfACoarseBallIsSmooth) {
  const Surface ball = Sphere({0, 0, 1}, 0.4F, 10);
  const Tracer tracer(ball.positions, ball.triangles);
  Light sun;
  sun.type = LightType::kDirectional;
  sun.direction = Vec3d(0, -1, 0);
  sun.irradiance = Rgb::Constant(2);
  const Lighting lighting{.lamps = {sun}};
  const Camera camera = AimCamera("c", {2.5, 0, 1}, {0, 0, 1}, 80, 2.0);
  const Plate plate = ShootPlate(camera, lighting, 8);
  const Shot shot = Shoot(
      MakeSubject(ball, tracer, kLambert), lighting, camera, plate, {.samples = 8, .passes = true});
  int checked = 0;
  for (int y = 25; y < 55; ++y) {
    for (int x = 20; x < 60; ++x) {
      if (shot.mask.At(x, y) == 0) continue;
      const float cosine = shot.normal.At(x, y, 1);
      if (cosine < 0.1F) continue;
      EXPECT_NEAR(shot.radiance.At(x, y, 1), 0.5F / kPi * 2 * cosine, 0.01F) << x << " " << y;
      ++checked;
    }
  }
  EXPECT_GT(checked, 300);
}

// In a sphere with a lamp in its centre every place gets E = I/R² directly and ρE by one bounce.
TEST(StudioPicture, OneBounceInASphereHasItsClosedForm) {
  const Surface shell = Sphere({0, 0, 0}, 0.5F, 24, true);
  const Tracer tracer(shell.positions, shell.triangles);
  Light lamp;
  lamp.type = LightType::kPoint;
  lamp.intensity = Rgb(1, 2, 3);
  const Lighting lighting{.lamps = {lamp}};
  const std::vector<Rgb> bounce =
      GatherBounce(MakeSubject(shell, tracer, kLambert), lighting, 64, 1);
  for (const Rgb& b : bounce) {
    EXPECT_NEAR(b[1], 0.5F * 2 / 0.25F, 0.15F);
    EXPECT_NEAR(b[0], 0.2F * 1 / 0.25F, 0.04F);
  }
}

// A patch that looks down on a floor lit from straight above gets ρE times the floor's form factor:
// for a square of side 2a as seen from height h over its middle, with A = a/h,
// 4/π · A/√(1+A²) · atan(A/√(1+A²)).
TEST(StudioPicture, RoomsFloorBouncesByItsFormFactor) {
  const Surface patch{{{-0.1F, -0.1F, 1.5F}, {0, 0.1F, 1.5F}, {0.1F, -0.1F, 1.5F}},
                      {-Vec3f::UnitZ(), -Vec3f::UnitZ(), -Vec3f::UnitZ()},
                      {{0, 1, 2}}};
  const Tracer tracer(patch.positions, patch.triangles);
  Light lamp;
  lamp.type = LightType::kDirectional;
  lamp.direction = -Vec3d::UnitZ();
  lamp.irradiance = Rgb(1, 2, 3);
  const Lighting lighting{.lamps = {lamp}};
  const double a = static_cast<double>(lighting.room.half_size) / 1.5;
  const double slope = a / std::sqrt(1 + a * a);
  const auto factor = static_cast<float>(4 / kPiD * slope * std::atan(slope));
  const std::vector<Rgb> bounce =
      GatherBounce(MakeSubject(patch, tracer, kLambert), lighting, 512, 1);
  for (const Rgb& b : bounce) {
    for (int c = 0; c < 3; ++c) {
      const float expected = lighting.room.floor[c] * lamp.irradiance[c] * factor;
      EXPECT_NEAR(b[c], expected, 0.08F * expected);  // the floor is mottled, and has seams
    }
  }
}

// All of a room that a lamp without falloff lights from above is its floor, half of all directions
// but for the walls' share.
TEST(StudioPicture, AmbientLightIsTheRoomsMeanRadiosity) {
  Light lamp;
  lamp.type = LightType::kDirectional;
  lamp.direction = -Vec3d::UnitZ();
  lamp.irradiance = Rgb(1, 2, 3);
  const Lighting lighting{.lamps = {lamp}};
  // Solid angle of a square of side 2a from height h over its middle: 4 asin(a² / (a² + h²)).
  const double a2 = std::pow(static_cast<double>(lighting.room.half_size), 2);
  const double h2 = std::pow(0.25 * static_cast<double>(lighting.room.height), 2);
  const auto share = static_cast<float>(4 * std::asin(a2 / (a2 + h2)) / (4 * kPiD));
  const Rgb light = AmbientLight(lighting);
  for (int c = 0; c < 3; ++c) {
    const float expected = lighting.room.floor[c] * lamp.irradiance[c] * share;
    EXPECT_NEAR(light[c], expected, 0.08F * expected);
  }
}

// The person's shadow lies on the floor; where neither is, the picture is the plate.
TEST(StudioPicture, BallShadowsTheFloorAndLeavesTheRestOfThePlate) {
  const Surface ball = Sphere({0, 0, 1}, 0.3F, 24);
  const Tracer tracer(ball.positions, ball.triangles);
  const Lighting lighting{
      .lamps = {AimSpot("s", {0.5, 0, 3}, {0, 0, 0}, Rgb::Constant(30), 0.6, 0.7)}};
  const Camera camera = AimCamera("c", {3, 0.5, 1.6}, {0, 0, 0.6}, 96, 1.2);
  const Plate plate = ShootPlate(camera, lighting, 4);
  const Shot shot =
      Shoot(MakeSubject(ball, tracer, kLambert), lighting, camera, plate, {.samples = 4});
  const auto pixel = [&](const Vec3d& p) {
    const Vec3d c = camera.cam_from_world * p;
    return std::pair<int, int>(static_cast<int>(camera.fx * c.x() / c.z() + camera.cx),
                               static_cast<int>(camera.fy * c.y() / c.z() + camera.cy));
  };
  // The axis of the shadow: from the lamp through the ball's centre to the floor.
  const auto [x, y] = pixel({-0.25, 0, 0});
  EXPECT_EQ(shot.radiance.At(x, y, 1), 0);
  EXPECT_GT(plate.radiance.At(x, y, 1), 0.01F);
  const auto [u, v] = pixel({0.6, 0.9, 0});
  EXPECT_EQ(shot.radiance.At(u, v, 1), plate.radiance.At(u, v, 1));
  EXPECT_GT(shot.radiance.At(u, v, 1), 0.01F);
}

}  // namespace
}  // namespace dyxel::studio
