#include "dyxel/body/skin_weights.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <numeric>
#include <utility>

#include "dyxel/base/parallel.h"

namespace dyxel {
namespace {

constexpr std::size_t kBlock = 512;

// The heat of every label at a vertex; in registers of eight.
constexpr int kMaxJoints = 16;
using Row = Eigen::Array<float, kMaxJoints, 1>;

// Neighbours of every vertex, ascending.
struct Rings {
  std::vector<int> first;  // (V + 1)
  std::vector<int> vertices;
};

Rings MakeRings(const TriangleMesh& mesh) {
  std::vector<std::pair<int, int>> edges;
  edges.reserve(6 * mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      edges.emplace_back(t[k], t[(k + 1) % 3]);
      edges.emplace_back(t[(k + 1) % 3], t[k]);
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  Rings rings;
  rings.first.assign(mesh.positions.size() + 1, 0);
  for (const std::pair<int, int>& edge : edges) {
    ++rings.first[static_cast<std::size_t>(edge.first) + 1];
    rings.vertices.push_back(edge.second);
  }
  std::partial_sum(rings.first.begin(), rings.first.end(), rings.first.begin());
  return rings;
}

}  // namespace

SkinWeights DiffuseLabels(const TriangleMesh& mesh, const SkinWeightProblem& problem) {
  const std::size_t num_vertices = mesh.positions.size();
  const std::size_t num_joints = problem.mirror_joints.size();
  assert(num_joints <= kMaxJoints);
  const Rings rings = MakeRings(mesh);
  auto ring = [&](std::size_t v) {
    return std::span<const int>(rings.vertices)
        .subspan(static_cast<std::size_t>(rings.first[v]),
                 static_cast<std::size_t>(rings.first[v + 1] - rings.first[v]));
  };

  // A step moves the share `rate` of a vertex's heat over its edges, of mean square length h²: per
  // dimension of the surface that is a variance of rate h² / 2.
  std::vector<float> spread(num_vertices);  // blend² / (h² / 2): the rates' sum over all steps
  float most = 0;
  for (std::size_t v = 0; v < num_vertices; ++v) {
    float h2 = 0;
    for (const int w : ring(v)) {
      h2 += (mesh.positions[static_cast<std::size_t>(w)] - mesh.positions[v]).squaredNorm();
    }
    h2 /= static_cast<float>(ring(v).size());
    spread[v] = problem.blend[v] * problem.blend[v] / (0.5F * h2);
    most = std::max(most, spread[v]);
  }
  constexpr float kMaxRate = 0.8F;
  const int steps = std::max(1, static_cast<int>(most / kMaxRate) + 1);
  std::vector<Row> now(num_vertices, Row::Zero());
  for (std::size_t v = 0; v < num_vertices; ++v) now[v][problem.labels[v]] = 1;
  std::vector<Row> next(num_vertices);
  for (int step = 0; step < steps; ++step) {
    ParallelForBlocks(num_vertices, kBlock, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        const float rate = spread[v] / static_cast<float>(steps);
        const float share = rate / static_cast<float>(ring(v).size());
        Row sum = Row::Zero();
        for (const int w : ring(v)) sum += now[static_cast<std::size_t>(w)];
        next[v] = (1 - rate) * now[v] + share * sum;
      }
    });
    std::swap(now, next);
  }

  SkinWeights result;
  result.joints.resize(num_vertices);
  result.weights.resize(num_vertices);
  ParallelForBlocks(num_vertices, kBlock, [&](std::size_t begin, std::size_t end) {
    std::vector<std::pair<float, int>> sorted(num_joints);
    for (std::size_t v = begin; v < end; ++v) {
      const auto other = static_cast<std::size_t>(problem.mirror_vertices[v]);
      for (std::size_t j = 0; j < num_joints; ++j) {
        const auto joint = static_cast<int>(j);
        sorted[j] = {0.5F * (now[v][joint] + now[other][problem.mirror_joints[j]]), joint};
      }
      std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
        return a.first != b.first ? a.first > b.first : a.second < b.second;
      });
      // Less than a hundredth moves nothing that one could see.
      constexpr float kLeast = 0.01F;
      float sum = 0;
      for (std::size_t k = 0; k < 4; ++k) sum += sorted[k].first >= kLeast ? sorted[k].first : 0;
      for (std::size_t k = 0; k < 4; ++k) {
        const bool used = sorted[k].first >= kLeast;
        result.joints[v][k] = used ? sorted[k].second : 0;
        result.weights[v][k] = used ? sorted[k].first / sum : 0;
      }
    }
  });
  return result;
}

}  // namespace dyxel
