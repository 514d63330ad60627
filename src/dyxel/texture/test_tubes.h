// Two upright tubes with a closed-form colour, for tests: what a camera sees of them, and where
// lamps cast shadows, is known exactly.
#pragma once

#include <cmath>
#include <limits>

#include "dyxel/capture/camera.h"
#include "dyxel/image/image.h"
#include "dyxel/mesh/surface.h"
#include "dyxel/mesh/test_meshes.h"

namespace dyxel {

struct Cylinder {
  Vec2f centre;
  float radius;
};
inline constexpr float kTubeHeight = 1.6F;
inline const Cylinder kBigTube = {Vec2f(0, 0), 0.4F};
inline const Cylinder kThinTube = {Vec2f(0.9F, 0.1F), 0.08F};

// Smooth, and different on the two tubes.
inline Rgb TubeColour(const Vec3f& x, bool thin) {
  return Rgb(0.5F + 0.3F * std::sin(6 * x.z()),
             0.5F + 0.3F * std::sin(5 * x.x() + 2 * x.y()),
             0.4F + 0.2F * std::cos(7 * x.y())) +
         (thin ? 2.0F : 0.0F);
}

// Where the ray from `x` along `d` first enters a tube from outside, as a distance, or infinity.
inline float EnterTube(const Cylinder& tube, const Vec3f& x, const Vec3f& d) {
  const Vec2f from = x.head<2>() - tube.centre;
  const Vec2f along = d.head<2>();
  const float a = along.squaredNorm();
  const float b = from.dot(along);
  const float c = from.squaredNorm() - tube.radius * tube.radius;
  const float root = b * b - a * c;
  if (root <= 0 || a <= 0) return std::numeric_limits<float>::infinity();
  const float t = (-b - std::sqrt(root)) / a;
  const float z = x.z() + t * d.z();
  return t > 1e-4F && z >= 0 && z <= kTubeHeight ? t : std::numeric_limits<float>::infinity();
}

struct TubeScene {
  TriangleMesh skin;
  Atlas atlas;
  std::vector<char> thin;  // (C) the tube of each cut vertex
};

inline TubeScene MakeTubeScene(int size) {
  TubeScene scene;
  scene.atlas.size = size;
  for (const bool thin : {false, true}) {
    const Cylinder& tube = thin ? kThinTube : kBigTube;
    const Tube unit = MakeTube(thin ? 64 : 128, 32, size);
    TriangleMesh skin = unit.skin;
    for (Vec3f& x : skin.positions) {
      x.head<2>() = tube.centre + tube.radius * x.head<2>();
      x.z() *= kTubeHeight / (2 * kPi);
    }
    const int cut_shift = static_cast<int>(scene.atlas.skin_vertex.size());
    const int skin_shift = static_cast<int>(scene.skin.positions.size());
    for (std::size_t c = 0; c < unit.atlas.skin_vertex.size(); ++c) {
      scene.atlas.skin_vertex.push_back(unit.atlas.skin_vertex[c] + skin_shift);
      const Vec2f& uv = unit.atlas.uv_i[c];  // in [1/4, 3/4]²
      scene.atlas.uv_i.emplace_back(thin ? 0.8F + 0.3F * (uv.x() - 0.25F) : 1.4F * uv.x() - 0.32F,
                                    1.8F * uv.y() - 0.4F);
      scene.thin.push_back(thin ? 1 : 0);
    }
    for (const Triangle& t : unit.atlas.triangles) {
      scene.atlas.triangles.push_back({t[0] + cut_shift, t[1] + cut_shift, t[2] + cut_shift});
    }
    Append(scene.skin, skin);
  }
  return scene;
}

// A camera at `eye` that looks at the middle of the tubes.
inline Camera MakeTubeCamera(const Vec3d& eye, int size) {
  Camera camera;
  camera.name = "camera";
  camera.width = camera.height = size;
  camera.fx = camera.fy = 1.5 * size;
  camera.cx = camera.cy = 0.5 * size;
  const Vec3d z = (Vec3d(0.3, 0, 0.5 * static_cast<double>(kTubeHeight)) - eye).normalized();
  const Vec3d x = z.cross(Vec3d::UnitZ()).normalized();
  camera.cam_from_world.rotation.row(0) = x;
  camera.cam_from_world.rotation.row(1) = z.cross(x);
  camera.cam_from_world.rotation.row(2) = z;
  camera.cam_from_world.translation = -(camera.cam_from_world.rotation * eye);
  return camera;
}

// What the camera sees at its pixels' centres: the tubes' colour, and 50 all around.
inline Picture TakePicture(const Camera& camera, const Rect& window) {
  Picture picture{ImageF(window.width, window.height, 3, 50.0F), window};
  const Vec3f eye = camera.Center().cast<float>();
  for (int y = 0; y < window.height; ++y) {
    for (int x = 0; x < window.width; ++x) {
      const Vec3f d = camera.Ray({window.x + x + 0.5, window.y + y + 0.5}).cast<float>();
      const float big = EnterTube(kBigTube, eye, d);
      const float thin = EnterTube(kThinTube, eye, d);
      const float t = std::min(big, thin);
      if (!std::isfinite(t)) continue;
      const Rgb colour = TubeColour(eye + t * d, thin < big);
      for (int i = 0; i < 3; ++i) picture.image.At(x, y, i) = colour[i];
    }
  }
  return picture;
}

}  // namespace dyxel
