// A crude closed person for tests: the level set of a smooth union of capsules.
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "dyxel/mesh/triangle_mesh.h"

namespace dyxel {

struct TestCapsule {
  Vec3f a, b;
  float radius_a, radius_b;
};

// Height 1.7 m, z up, facing -y, arms lowered to 45 degrees.
inline std::vector<TestCapsule> TestPersonCapsules() {
  std::vector<TestCapsule> parts = {{{0, 0, 0.95F}, {0, 0, 1.35F}, 0.13F, 0.14F},   // trunk
                                    {{0, 0, 1.40F}, {0, 0, 1.50F}, 0.06F, 0.055F},  // neck
                                    {{0, 0, 1.56F}, {0, -0.01F, 1.63F}, 0.09F, 0.095F}};
  for (const float side : {-1.0F, 1.0F}) {
    const auto at = [&](float x, float y, float z) { return Vec3f(side * x, y, z); };
    parts.push_back({at(0.10F, 0, 1.38F), at(0.19F, 0, 1.38F), 0.07F, 0.065F});   // shoulder
    parts.push_back({at(0.19F, 0, 1.38F), at(0.40F, 0, 1.16F), 0.055F, 0.045F});  // arm
    parts.push_back({at(0.40F, 0, 1.16F), at(0.57F, -0.05F, 0.97F), 0.042F, 0.032F});
    parts.push_back({at(0.57F, -0.05F, 0.97F), at(0.65F, -0.08F, 0.87F), 0.034F, 0.03F});
    parts.push_back({at(0.10F, 0, 0.93F), at(0.15F, 0, 0.50F), 0.095F, 0.06F});  // leg
    parts.push_back({at(0.15F, 0, 0.50F), at(0.18F, 0.02F, 0.09F), 0.055F, 0.04F});
    parts.push_back({at(0.18F, 0.02F, 0.05F), at(0.19F, -0.14F, 0.04F), 0.045F, 0.035F});
  }
  return parts;
}

inline float SmoothUnion(const std::vector<TestCapsule>& parts, const Vec3f& p) {
  float sum = 0;
  constexpr float kSharpness = 60;
  for (const TestCapsule& c : parts) {
    const Vec3f axis = c.b - c.a;
    const float t = std::clamp((p - c.a).dot(axis) / axis.squaredNorm(), 0.0F, 1.0F);
    const float distance =
        (p - c.a - t * axis).norm() - (c.radius_a + t * (c.radius_b - c.radius_a));
    sum += std::exp(-kSharpness * distance);
  }
  return -std::log(std::max(sum, 1e-30F)) / kSharpness;
}

// The zero set of `distance` over a box of cubes of side `cell`, by marching tetrahedra (six a
// cube, so that the surface is a closed manifold), its vertices smoothed.
template <class Distance>
TriangleMesh MarchTetrahedra(const Distance& distance,
                             const Vec3f& low,
                             const Vec3f& high,
                             float cell) {
  const std::array<int, 3> n = {static_cast<int>((high.x() - low.x()) / cell) + 2,
                                static_cast<int>((high.y() - low.y()) / cell) + 2,
                                static_cast<int>((high.z() - low.z()) / cell) + 2};
  const auto index = [&](int x, int y, int z) { return (z * n[1] + y) * n[0] + x; };
  std::vector<float> value(static_cast<std::size_t>(n[0]) * n[1] * n[2]);
  std::vector<Vec3f> point(value.size());
  for (int z = 0; z < n[2]; ++z) {
    for (int y = 0; y < n[1]; ++y) {
      for (int x = 0; x < n[0]; ++x) {
        const int i = index(x, y, z);
        point[i] =
            low + cell * Vec3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
        value[i] = distance(point[i]);
      }
    }
  }
  TriangleMesh mesh;
  std::map<std::pair<int, int>, int> crossing;
  const auto vertex = [&](int a, int b) {
    const auto key = std::minmax(a, b);
    const auto [it, fresh] = crossing.try_emplace({key.first, key.second}, 0);
    if (fresh) {
      it->second = static_cast<int>(mesh.positions.size());
      const float t = std::clamp(value[a] / (value[a] - value[b]), 0.05F, 0.95F);
      mesh.positions.emplace_back(point[a] + t * (point[b] - point[a]));
    }
    return it->second;
  };
  const auto emit = [&](int a, int b, int c, const Vec3f& outward) {
    const Vec3f normal =
        (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
    if (normal.dot(outward) > 0) {
      mesh.triangles.push_back({a, b, c});
    } else {
      mesh.triangles.push_back({a, c, b});
    }
  };
  constexpr std::array<std::array<int, 3>, 6> kPaths = {
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  for (int z = 0; z + 1 < n[2]; ++z) {
    for (int y = 0; y + 1 < n[1]; ++y) {
      for (int x = 0; x + 1 < n[0]; ++x) {
        for (const auto& path : kPaths) {
          std::array<int, 3> at = {x, y, z};
          std::array<int, 4> corner{};
          corner[0] = index(at[0], at[1], at[2]);
          for (std::size_t k = 0; k < 3; ++k) {
            ++at[path[k]];
            corner[k + 1] = index(at[0], at[1], at[2]);
          }
          std::vector<int> in, out;
          for (const int c : corner) (value[c] < 0 ? in : out).push_back(c);
          if (in.empty() || out.empty()) continue;
          Vec3f outward = Vec3f::Zero();
          for (const int c : out) outward += point[c] / static_cast<float>(out.size());
          for (const int c : in) outward -= point[c] / static_cast<float>(in.size());
          if (in.size() == 2) {
            const int a = vertex(in[0], out[0]), b = vertex(in[0], out[1]);
            const int c = vertex(in[1], out[1]), d = vertex(in[1], out[0]);
            emit(a, b, c, outward);
            emit(a, c, d, outward);
          } else {
            const int apex = in.size() == 1 ? in[0] : out[0];
            const std::vector<int>& base = in.size() == 1 ? out : in;
            emit(vertex(apex, base[0]), vertex(apex, base[1]), vertex(apex, base[2]), outward);
          }
        }
      }
    }
  }
  mesh.positions = SmoothPositions(mesh.positions, mesh.triangles, 3);
  return mesh;
}

inline TriangleMesh MakeTestPerson(float cell) {
  const std::vector<TestCapsule> parts = TestPersonCapsules();
  return MarchTetrahedra([&](const Vec3f& p) { return SmoothUnion(parts, p); },
                         Vec3f(-0.75F, -0.3F, -0.05F),
                         Vec3f(0.75F, 0.3F, 1.8F),
                         cell);
}

}  // namespace dyxel
