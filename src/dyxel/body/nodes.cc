#include "dyxel/body/nodes.h"

#include <algorithm>
#include <cassert>
#include <limits>
#include <queue>

#include <fmt/format.h>

#include "dyxel/mesh/adjacency.h"

namespace dyxel {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr std::size_t kInfluences = 4;

// Calls visit(vertex, distance) for the vertices within `reach` of `from` along the mesh's edges,
// nearest first, and goes on from those where it returns true.
class Walk {
 public:
  explicit Walk(const TriangleMesh& mesh)
      : mesh_(mesh),
        neighbours_(NeighboursOfVertices(mesh.triangles, static_cast<int>(mesh.positions.size()))),
        best_(mesh.positions.size(), kFar) {}

  template <class Visit>
  void From(int from, float reach, Visit&& visit) {
    touched_.clear();
    Push(from, 0);
    while (!queue_.empty()) {
      const auto [distance, v] = queue_.top();
      queue_.pop();
      const auto vertex = static_cast<std::size_t>(v);
      if (distance > best_[vertex] || !visit(v, distance)) continue;
      for (int k = neighbours_.begin[vertex]; k < neighbours_.begin[vertex + 1]; ++k) {
        const int u = neighbours_.index[static_cast<std::size_t>(k)];
        const float step =
            (mesh_.positions[vertex] - mesh_.positions[static_cast<std::size_t>(u)]).norm();
        if (distance + step <= reach) Push(u, distance + step);
      }
    }
    for (const int v : touched_) best_[static_cast<std::size_t>(v)] = kFar;
  }

 private:
  void Push(int v, float distance) {
    float& best = best_[static_cast<std::size_t>(v)];
    if (distance >= best) return;
    if (best == kFar) touched_.push_back(v);
    best = distance;
    queue_.push({distance, v});
  }

  using Entry = std::pair<float, int>;
  const TriangleMesh& mesh_;
  VertexNeighbours neighbours_;
  std::vector<float> best_;
  std::vector<int> touched_;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue_;
};

// Vertices of which each next one is the farthest from all before, until none is farther than
// `spacing`.
std::vector<int> SpreadVertices(const TriangleMesh& mesh, Walk& walk, float spacing) {
  std::vector<float> distance(mesh.positions.size(), kFar);
  std::vector<int> chosen;
  for (;;) {
    const auto farthest = std::max_element(distance.begin(), distance.end());
    if (farthest == distance.end() || *farthest <= spacing) return chosen;
    chosen.push_back(static_cast<int>(farthest - distance.begin()));
    walk.From(chosen.back(), kFar, [&](int v, float d) {
      float& known = distance[static_cast<std::size_t>(v)];
      if (d >= known) return false;
      known = d;
      return true;
    });
  }
}

}  // namespace

Actor WithNodes(const Actor& actor, double spacing) {
  assert(actor.skeleton.NumNodes() == 0);
  const TriangleMesh& skin = actor.skin;
  Walk walk(skin);
  const std::vector<int> chosen = SpreadVertices(skin, walk, static_cast<float>(spacing));
  const auto first = static_cast<int>(actor.skeleton.joints.size());
  const std::vector<Vec3d> rest = actor.skeleton.RestPositions();

  Actor out = actor;
  struct Near {
    float distance;
    int joint;
  };
  std::vector<std::vector<Near>> near(skin.positions.size());
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const auto v = static_cast<std::size_t>(chosen[k]);
    Joint node;
    node.name = fmt::format("node_{:03}", k);
    node.parent = actor.joint_indices[v][0];
    node.offset = skin.positions[v].cast<double>() - rest[static_cast<std::size_t>(node.parent)];
    double sum = 0;
    for (std::size_t i = 0; i < kInfluences; ++i) {
      const auto weight = static_cast<double>(actor.joint_weights[v][i]);
      if (weight > 0) node.follows.push_back({actor.joint_indices[v][i], weight});
      sum += weight;
    }
    for (JointShare& share : node.follows) share.weight /= sum;
    out.skeleton.joints.push_back(std::move(node));
    // Every vertex has a node within `spacing`; its fifth is hardly ever beyond three of them.
    walk.From(chosen[k], static_cast<float>(3 * spacing), [&](int u, float distance) {
      near[static_cast<std::size_t>(u)].push_back({distance, first + static_cast<int>(k)});
      return true;
    });
  }
  for (std::size_t v = 0; v < near.size(); ++v) {
    std::vector<Near>& list = near[v];
    std::sort(list.begin(), list.end(), [](const Near& a, const Near& b) {
      return a.distance != b.distance ? a.distance < b.distance : a.joint < b.joint;
    });
    const float end =
        list.size() > kInfluences ? list[kInfluences].distance : static_cast<float>(3 * spacing);
    const std::size_t count = std::min(list.size(), kInfluences);
    std::array<int, 4> joints{};
    std::array<float, 4> weights{};
    float sum = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const float w = std::max(0.0F, 1 - list[k].distance / end);
      weights[k] = w * w;
      joints[k] = list[k].joint;
      sum += weights[k];
    }
    if (!(sum > 0)) {  // five nodes at one distance
      weights[0] = sum = 1;
    }
    for (std::size_t k = 0; k < kInfluences; ++k) {
      weights[k] /= sum;
      if (weights[k] == 0) joints[k] = 0;
    }
    out.joint_indices[v] = joints;
    out.joint_weights[v] = weights;
  }
  return out;
}

std::vector<std::array<int, 2>> NodeEdges(const Actor& actor) {
  std::vector<int> number(actor.skeleton.joints.size(), -1);
  int nodes = 0;
  for (std::size_t j = 0; j < number.size(); ++j) {
    if (actor.skeleton.joints[j].IsNode()) number[j] = nodes++;
  }
  std::vector<std::array<int, 2>> edges;
  for (std::size_t v = 0; v < actor.joint_indices.size(); ++v) {
    for (std::size_t a = 0; a < kInfluences; ++a) {
      for (std::size_t b = 0; b < kInfluences; ++b) {
        const int i = number[static_cast<std::size_t>(actor.joint_indices[v][a])];
        const int j = number[static_cast<std::size_t>(actor.joint_indices[v][b])];
        if (actor.joint_weights[v][a] > 0 && actor.joint_weights[v][b] > 0 && i >= 0 && i < j) {
          edges.push_back({i, j});
        }
      }
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace dyxel
