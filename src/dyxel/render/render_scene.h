// Small surfaces with constant maps, for the renderer's tests only.
#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "dyxel/render/renderer.h"

namespace dyxel::test_scene {

// A surface with its maps; surface() points into it.
struct Scene {
  Atlas atlas;
  PosedSurface posed;
  MaterialMaps maps;
  ImageF normal_map;  // empty: none

  [[nodiscard]] RenderSurface surface() const {
    return {&atlas, &posed, &maps, normal_map.empty() ? nullptr : &normal_map};
  }
};

inline void SetMaps(Scene& scene,
                    const std::string& model,
                    const Rgb& diffuse,
                    const std::vector<float>& specular) {
  const int n = scene.atlas.size;
  scene.maps.model = model;
  scene.maps.materials = {Material{"material0", specular, diffuse, n * n}};
  scene.maps.diffuse = ImageF(n, n, 3);
  scene.maps.specular = ImageF(n, n, static_cast<int>(specular.size()));
  scene.maps.material = ImageU8(n, n, 1);
  scene.maps.confidence = ImageF(n, n, 1, 0.75F);
  for (int i = 0; i < n * n; ++i) {
    for (int c = 0; c < 3; ++c)
      scene.maps.diffuse.data[3 * static_cast<std::size_t>(i) + static_cast<std::size_t>(c)] =
          diffuse[c];
    for (std::size_t p = 0; p < specular.size(); ++p) {
      scene.maps.specular.data[static_cast<std::size_t>(i) * specular.size() + p] = specular[p];
    }
  }
}

inline void AddVertex(
    Scene& scene, const Vec3f& x, const Vec3f& n, const Vec3f& t, const Vec2f& uv) {
  scene.atlas.skin_vertex.push_back(static_cast<int>(scene.atlas.skin_vertex.size()));
  scene.atlas.uv_i.push_back(uv);
  scene.posed.positions.push_back(x);
  scene.posed.normals.push_back(n);
  scene.posed.tangents.push_back(t);
  scene.posed.handedness.push_back(1);
}

// Adds the rectangle corner + s·a + t·b, s and t in [0, 1], whose normal is a × b.
inline void AddQuad(Scene& scene, const Vec3f& corner, const Vec3f& a, const Vec3f& b) {
  scene.atlas.size = 8;
  const Vec3f n = a.cross(b).normalized();
  const Vec3f t = a.normalized();
  const int first = static_cast<int>(scene.posed.positions.size());
  AddVertex(scene, corner, n, t, {0, 0});
  AddVertex(scene, corner + a, n, t, {1, 0});
  AddVertex(scene, corner + a + b, n, t, {1, 1});
  AddVertex(scene, corner + b, n, t, {0, 1});
  scene.atlas.triangles.push_back({first, first + 1, first + 2});
  scene.atlas.triangles.push_back({first, first + 2, first + 3});
}

// A sphere about the origin, poles along z, normals exact.
inline Scene MakeSphere(float radius, int rings) {
  Scene scene;
  scene.atlas.size = 8;
  const int sectors = 2 * rings;
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j <= sectors; ++j) {
      const float theta = kPi * static_cast<float>(i) / static_cast<float>(rings);
      const float phi = 2 * kPi * static_cast<float>(j) / static_cast<float>(sectors);
      const Vec3f n(
          std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      AddVertex(scene,
                radius * n,
                n,
                {-std::sin(phi), std::cos(phi), 0},
                {static_cast<float>(j) / static_cast<float>(sectors),
                 static_cast<float>(i) / static_cast<float>(rings)});
    }
  }
  const int row = sectors + 1;
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const int a = i * row + j;
      if (i > 0) scene.atlas.triangles.push_back({a, a + row, a + 1});
      if (i + 1 < rings) scene.atlas.triangles.push_back({a + 1, a + row, a + row + 1});
    }
  }
  return scene;
}

// At (0, 0, height) looking down -z, x to the right, -y down: pixel x grows with world x, pixel y
// falls with world y.
inline Camera CameraAbove(double height, int size, double focal_px) {
  Camera camera;
  camera.name = "above";
  camera.width = size;
  camera.height = size;
  camera.fx = focal_px;
  camera.fy = focal_px;
  camera.cx = 0.5 * size;
  camera.cy = 0.5 * size;
  camera.cam_from_world.rotation << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  camera.cam_from_world.translation = Vec3d(0, 0, height);
  return camera;
}

inline Light PointLight(const Vec3d& position, const Rgb& intensity) {
  Light light;
  light.type = LightType::kPoint;
  light.position = position;
  light.intensity = intensity;
  return light;
}

inline Light DirectionalLight(const Vec3d& to_light, const Rgb& irradiance) {
  Light light;
  light.type = LightType::kDirectional;
  light.direction = -to_light.normalized();
  light.irradiance = irradiance;
  return light;
}

}  // namespace dyxel::test_scene
