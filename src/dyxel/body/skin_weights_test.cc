#include "dyxel/body/skin_weights.h"

#include <cmath>

#include <gtest/gtest.h>

namespace dyxel {
namespace {

// A plane of equilateral triangles, `n` rows.
TriangleMesh Plane(int n, float edge) {
  TriangleMesh mesh;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      mesh.positions.emplace_back(edge * (static_cast<float>(i) + 0.5F * static_cast<float>(j % 2)),
                                  edge * 0.8660254F * static_cast<float>(j),
                                  0.0F);
    }
  }
  for (int j = 0; j + 1 < n; ++j) {
    for (int i = 0; i + 1 < n; ++i) {
      const int a = j * n + i;
      if (j % 2 == 0) {
        mesh.triangles.push_back({a, a + 1, a + n});
        mesh.triangles.push_back({a + 1, a + n + 1, a + n});
      } else {
        mesh.triangles.push_back({a, a + n + 1, a + n});
        mesh.triangles.push_back({a, a + 1, a + n + 1});
      }
    }
  }
  return mesh;
}

// A straight border between two labels spreads into the normal distribution's integral.
TEST(SkinWeights, AStepBecomesAGaussian) {
  constexpr int kRows = 60;
  constexpr float kEdge = 0.01F;
  const TriangleMesh mesh = Plane(kRows, kEdge);
  const std::size_t n = mesh.positions.size();
  for (const float sigma : {0.02F, 0.05F}) {
    std::vector<int> labels;
    std::vector<int> self;
    // Half way between two rows.
    const float border = kEdge * 0.8660254F * 29.5F;
    for (std::size_t v = 0; v < n; ++v) {
      labels.push_back(mesh.positions[v][1] > border ? 1 : 0);
      self.push_back(static_cast<int>(v));
    }
    const std::vector<float> blend(n, sigma);
    const std::vector<int> joints = {0, 1};
    const SkinWeights weights = DiffuseLabels(
        mesh, {.labels = labels, .blend = blend, .mirror_vertices = self, .mirror_joints = joints});
    int checked = 0;
    for (std::size_t v = 0; v < n; ++v) {
      const float x = mesh.positions[v][0];
      const float s = mesh.positions[v][1] - border;
      if (x < 0.25F || x > 0.35F || std::abs(s) > 0.1F) continue;  // away from the plane's ends
      const float expected = 0.5F * std::erfc(-s / (sigma * 1.41421356F));
      float weight = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        if (weights.joints[v][k] == 1) weight += weights.weights[v][k];
      }
      EXPECT_NEAR(weight, expected, 0.025F) << s;
      ++checked;
    }
    EXPECT_GT(checked, 200);
  }
}

// Two vertices that are each other's image get each other's weights.
TEST(SkinWeights, MirroredVerticesMirrorTheirWeights) {
  const TriangleMesh mesh = Plane(9, 0.01F);
  const std::size_t n = mesh.positions.size();
  std::vector<int> labels(n, 0);
  std::vector<int> mirror(n);
  for (std::size_t v = 0; v < n; ++v) mirror[v] = static_cast<int>(v / 9 * 9 + 8 - v % 9);
  for (std::size_t v = 0; v < n; ++v) labels[v] = v % 9 < 3 ? 1 : v % 9 > 5 ? 2 : 0;
  const std::vector<float> blend(n, 0.02F);
  const std::vector<int> joints = {0, 2, 1};
  const SkinWeights weights = DiffuseLabels(
      mesh, {.labels = labels, .blend = blend, .mirror_vertices = mirror, .mirror_joints = joints});
  auto weight_of = [&](std::size_t v, int joint) {
    float weight = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      if (weights.joints[v][k] == joint) weight += weights.weights[v][k];
    }
    return weight;
  };
  for (std::size_t v = 0; v < n; ++v) {
    const auto other = static_cast<std::size_t>(mirror[v]);
    EXPECT_EQ(weight_of(v, 1), weight_of(other, 2));
    EXPECT_NEAR(weight_of(v, 0) + weight_of(v, 1) + weight_of(v, 2), 1, 1e-6F);
  }
  EXPECT_GT(weight_of(0, 1), 0.7F);
}

}  // namespace
}  // namespace dyxel
