// A small relightable video for tests: an egg on two joints, with varied maps.
#pragma once

#include <algorithm>
#include <cmath>

#include "dyxel/base/random.h"
#include "dyxel/video/relightable_video.h"

namespace dyxel::test_scene {

// The egg's skin: rings × sectors, one vertex at each pole; its atlas is cut along one meridian.
inline RelightableVideo MakeEgg(int rings, int sectors, int atlas_size) {
  RelightableVideo video;
  video.name = "egg \xC3\xA9";
  video.sequence = "dss";
  video.fps = 30;
  Actor& actor = video.actor.emplace();
  const int row = sectors + 1;
  const auto skin_index = [&](int i, int j) {
    if (i == 0) return 0;
    if (i == rings) return 1;
    return 2 + (i - 1) * sectors + j % sectors;
  };
  const int skin_vertices = 2 + (rings - 1) * sectors;
  actor.skin.positions.resize(static_cast<std::size_t>(skin_vertices));
  actor.joint_indices.assign(actor.skin.positions.size(), {0, 1, 0, 0});
  actor.joint_weights.resize(actor.skin.positions.size());
  video.atlas.size = atlas_size;
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j <= sectors; ++j) {
      const float theta = kPi * static_cast<float>(i) / static_cast<float>(rings);
      const float phi = 2 * kPi * static_cast<float>(j % sectors) / static_cast<float>(sectors);
      const int v = skin_index(i, j);
      const auto at = static_cast<std::size_t>(v);
      actor.skin.positions[at] = {0.3F * std::sin(theta) * std::cos(phi),
                                  0.4F * std::sin(theta) * std::sin(phi),
                                  1 + 0.7F * std::cos(theta)};
      const float upper = std::clamp(0.5F + std::cos(theta), 0.0F, 1.0F);
      actor.joint_indices[at] =
          upper > 0.5F ? std::array<int, 4>{1, 0, 0, 0} : std::array<int, 4>{0, 1, 0, 0};
      const float first = std::max(upper, 1 - upper);
      actor.joint_weights[at] = {first, 1 - first, 0, 0};
      if (1 - first == 0) actor.joint_indices[at][1] = 0;
      video.atlas.skin_vertex.push_back(v);
      video.atlas.uv_i.emplace_back(
          0.02F + 0.96F * static_cast<float>(j) / static_cast<float>(sectors),
          0.02F + 0.96F * static_cast<float>(i) / static_cast<float>(rings));
      video.atlas.uv_ii.emplace_back(static_cast<float>(j) / static_cast<float>(sectors),
                                     static_cast<float>(i) / static_cast<float>(rings));
    }
  }
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < sectors; ++j) {
      const int a = i * row + j;
      if (i > 0) video.atlas.triangles.push_back({a, a + row, a + 1});
      if (i + 1 < rings) video.atlas.triangles.push_back({a + 1, a + row, a + row + 1});
    }
  }
  for (const Triangle& t : video.atlas.triangles) {
    Triangle skin;
    for (std::size_t k = 0; k < 3; ++k) {
      skin[k] = video.atlas.skin_vertex[static_cast<std::size_t>(t[k])];
    }
    video.skin_triangles.push_back(skin);
  }
  actor.skin.triangles = video.skin_triangles;

  actor.skeleton.joints = {
      Joint{.name = "pelvis", .parent = -1, .offset = Vec3d(0, 0, 0.6)},
      Joint{.name = "chest",
            .parent = 0,
            .offset = Vec3d(0, 0.01, 0.4),
            .dofs = {{"bend", Vec3d::UnitY(), -1, 1.5}, {"twist", Vec3d::UnitZ(), -0.5, 0.5}}}};
  for (int f = 0; f < 5; ++f) {
    Pose pose;
    pose.root_translation = Vec3d(0.1 * f, 0.02 * f, 0.6 + 0.05 * std::sin(f));
    pose.root_rotation = Quatd(Eigen::AngleAxisd(0.3 * f, Vec3d::UnitZ()));
    pose.angles = {0.2 * f, -0.1 * f};
    video.motion.poses.push_back(pose);
    video.motion.confidence.push_back(1 - 0.1 * f);
  }

  MaterialMaps& maps = video.maps;
  const int n = atlas_size;
  maps.model = "ggx";
  maps.materials = {{"skin", {0.45F, 0.04F}, Rgb(0.6F, 0.4F, 0.3F), 100},
                    {"cloth", {0.7F, 0.02F}, Rgb(0.2F, 0.3F, 0.5F), 200}};
  maps.diffuse = ImageF(n, n, 3);
  maps.specular = ImageF(n, n, 2);
  maps.material = ImageU8(n, n, 1);
  maps.confidence = ImageF(n, n, 1);
  maps.normal = ImageF(n, n, 3);
  Random random(3);
  const auto normals = [&](float turn) {
    ImageF map(n, n, 3);
    for (int y = 0; y < n; ++y) {
      for (int x = 0; x < n; ++x) {
        const float u = static_cast<float>(x) / static_cast<float>(n);
        const float v = static_cast<float>(y) / static_cast<float>(n);
        const Vec3f normal = Vec3f(0.3F * std::sin(30 * u + turn) + 0.02F * random.Normal(),
                                   0.3F * std::cos(25 * v),
                                   1)
                                 .normalized();
        for (int c = 0; c < 3; ++c) map.At(x, y, c) = normal[c];
      }
    }
    return map;
  };
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const bool cloth = (4 * x / n + 4 * y / n) % 2 == 1;
      const Material& material = maps.materials[cloth ? 1 : 0];
      maps.material.At(x, y) = cloth ? 1 : 0;
      for (int c = 0; c < 3; ++c) {
        maps.diffuse.At(x, y, c) = material.mean_diffuse[c] * (0.8F + 0.4F * random.Uniform());
      }
      for (int p = 0; p < 2; ++p) {
        maps.specular.At(x, y, p) = material.specular[static_cast<std::size_t>(p)];
      }
      maps.confidence.At(x, y) = random.Uniform();
    }
  }
  maps.normal = normals(0);
  video.normals = {{0.5, normals(0.3F)}, {3, normals(0.9F)}};
  return video;
}

// The same as given surfaces, with smoothed normals.
inline RelightableVideo MakeSurfaceEgg(int rings, int sectors, int atlas_size) {
  RelightableVideo video = MakeEgg(rings, sectors, atlas_size);
  for (int f = 0; f < video.NumFrames(); ++f) {
    video.positions.push_back(SkinPositionsAt(video, f));
  }
  for (const auto& frame : video.positions) {
    video.normal_positions.push_back(SmoothPositions(frame, video.skin_triangles, 3));
  }
  video.actor.reset();
  video.motion = {};
  return video;
}

}  // namespace dyxel::test_scene
