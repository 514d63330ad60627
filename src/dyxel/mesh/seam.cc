#include "dyxel/mesh/seam.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "dyxel/base/error.h"

namespace dyxel::internal {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// The tree while it grows, and who is near it.
class InducedTree {
 public:
  InducedTree(const VertexGraph& graph, std::span<const float> cost)
      : graph_(graph),
        cost_(cost),
        links_(graph.begin.size() - 1),
        near_(graph.begin.size() - 1, 0) {}

  [[nodiscard]] bool Contains(int v) const { return !links_[v].empty(); }
  // In the tree or beside it.
  [[nodiscard]] bool Near(int v) const { return near_[v] > 0; }

  void AddPath(std::span<const int> path) {
    for (std::size_t i = 0; i + 1 < path.size(); ++i) Link(path[i], path[i + 1]);
  }

  [[nodiscard]] std::vector<int> Vertices() const {
    std::vector<int> all;
    for (int v = 0; v < static_cast<int>(links_.size()); ++v) {
      if (Contains(v)) all.push_back(v);
    }
    return all;
  }

  [[nodiscard]] std::vector<std::array<int, 2>> Edges() const {
    std::vector<std::array<int, 2>> edges;
    for (int v = 0; v < static_cast<int>(links_.size()); ++v) {
      for (const int w : links_[v]) {
        if (v < w) edges.push_back({v, w});
      }
    }
    return edges;
  }

  // Hangs `path` (induced, none of it near the tree; path[0] nearest to it) onto the tree near its
  // vertex `at`: a stretch of the tree around `at` is taken away and its two ends and the path are
  // joined anew in a vertex whose three tree edges leave a triangle fan of at least two between any
  // two of them. False if there is no room.
  [[nodiscard]] bool Attach(int at, std::span<const int> path);

 private:
  void Link(int a, int b) {
    if (!Contains(a)) Count(a, 1);
    links_[a].push_back(b);
    if (!Contains(b)) Count(b, 1);
    links_[b].push_back(a);
  }
  void Unlink(int a, int b) {
    std::erase(links_[a], b);
    std::erase(links_[b], a);
    if (!Contains(a)) Count(a, -1);
    if (!Contains(b)) Count(b, -1);
  }
  void Count(int v, int by) {
    near_[v] += by;
    for (const int w : graph_.Of(v)) near_[w] += by;
  }
  [[nodiscard]] std::vector<int> WalkFrom(int at, int first, int steps) const;
  [[nodiscard]] bool AttachAt(int at, int reach, std::span<const int> path);

  const VertexGraph& graph_;
  std::span<const float> cost_;
  std::vector<std::vector<int>> links_;  // (V) tree neighbours
  std::vector<int> near_;                // (V) tree vertices in the closed neighbourhood
};

// Fewest-edges path between two vertices over allowed ones, ends included; empty if there is none.
// Being shortest, it is induced.
std::vector<int> FewestEdges(const VertexGraph& graph,
                             std::span<const char> allowed,
                             int from,
                             int to,
                             std::vector<int>& before) {
  std::vector<int> queue = {from};
  std::vector<int> path;
  before[from] = from;
  for (std::size_t i = 0; i < queue.size() && before[to] < 0; ++i) {
    for (const int w : graph.Of(queue[i])) {
      if (before[w] >= 0 || (w != to && !allowed[w])) continue;
      before[w] = queue[i];
      queue.push_back(w);
    }
  }
  if (before[to] >= 0) {
    for (int v = to; v != from; v = before[v]) path.push_back(v);
    path.push_back(from);
    std::reverse(path.begin(), path.end());
  }
  for (const int v : queue) before[v] = -1;
  return path;
}

// The vertices of a path straightened until no edge of the mesh shortcuts it.
std::vector<int> Straighten(const VertexGraph& graph, const std::vector<int>& path) {
  std::vector<char> allowed(graph.begin.size() - 1, 0);
  std::vector<int> before(graph.begin.size() - 1, -1);
  for (const int v : path) allowed[v] = 1;
  return FewestEdges(graph, allowed, path.front(), path.back(), before);
}

std::vector<int> PathTo(const Paths& paths, int v) {
  std::vector<int> path;
  for (; v >= 0; v = paths.parent[v]) path.push_back(v);
  std::reverse(path.begin(), path.end());
  return path;
}

// `steps` tree vertices from `at` by way of its neighbour `first`, `at` included; shorter where
// the tree ends or forks.
std::vector<int> InducedTree::WalkFrom(int at, int first, int steps) const {
  std::vector<int> walk = {at, first};
  while (static_cast<int>(walk.size()) <= steps && links_[walk.back()].size() == 2) {
    const std::vector<int>& links = links_[walk.back()];
    const int next = links[0] == walk[walk.size() - 2] ? links[1] : links[0];
    walk.push_back(next);
  }
  return walk;
}

bool InducedTree::AttachAt(int at, int reach, std::span<const int> path) {
  if (links_[at].size() != 2) return false;
  const std::vector<int> left = WalkFrom(at, links_[at][0], reach);
  const std::vector<int> right = WalkFrom(at, links_[at][1], reach);
  if (static_cast<int>(std::min(left.size(), right.size())) <= reach) return false;
  const std::array<int, 3> ends = {left.back(), right.back(), path[0]};

  // Take the stretch away, then see who is near what stays. An end's own closed neighbourhood must
  // not count against itself, so ends are left out and blocked for one another below.
  for (int i = 0; i < reach; ++i) {
    Unlink(left[i], left[i + 1]);
    Unlink(right[i], right[i + 1]);
  }
  const auto restore = [&] {
    for (int i = 0; i < reach; ++i) {
      Link(left[i], left[i + 1]);
      Link(right[i], right[i + 1]);
    }
    return false;
  };
  const auto forget = [&](int v, int sign) {
    if (Contains(v)) Count(v, sign);
  };
  forget(ends[0], -1);
  forget(ends[1], -1);
  for (std::size_t i = 1; i < path.size(); ++i) Count(path[i], 1);

  // The neighbourhood of `at`.
  std::vector<int> region = {at};
  std::vector<char> allowed(links_.size(), 0), seen(links_.size(), 0);
  seen[at] = 1;
  std::size_t ring_end = 1;
  for (int ring = 0; ring < reach + 2; ++ring) {
    for (std::size_t i = 0, end = ring_end; i < end; ++i) {
      for (const int w : graph_.Of(region[i])) {
        if (!seen[w]) region.push_back(w);
        seen[w] = 1;
      }
    }
    ring_end = region.size();
  }

  std::vector<int> before(links_.size(), -1);
  std::vector<int> taken(links_.size(), 0);  // branches and ends near a vertex
  std::array<std::vector<int>, 3> best;
  float best_cost = kInfinity;
  const auto count = [&](int v, int by) {
    taken[v] += by;
    for (const int w : graph_.Of(v)) taken[w] += by;
  };
  constexpr std::array<std::array<int, 3>, 6> kOrders = {
      {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
  for (const int centre : region) {
    if (near_[centre] > 0) continue;
    if (std::find(ends.begin(), ends.end(), centre) != ends.end()) continue;
    for (const auto& order : kOrders) {
      std::array<std::vector<int>, 3> branches;
      float total = 0;
      bool good = true;
      std::vector<int> counted;
      for (const int end : ends) {
        count(end, 1);
        counted.push_back(end);
      }
      for (const int k : order) {
        // This end no longer stands in its own way; what the others have taken does.
        count(ends[k], -1);
        counted.erase(std::find(counted.begin(), counted.end(), ends[k]));
        const int own =
            k == 2 ? (path.size() > 1 ? 1 : 0) : static_cast<int>(links_[ends[k]].size());
        good = taken[ends[k]] == 0 && near_[ends[k]] <= own;
        if (!good) break;
        for (const int v : region) allowed[v] = near_[v] == 0 && taken[v] == 0;
        branches[k] = FewestEdges(graph_, allowed, ends[k], centre, before);
        for (const int v : region) allowed[v] = 0;
        good = !branches[k].empty();
        if (!good) break;
        for (std::size_t i = 0; i + 1 < branches[k].size(); ++i) {
          count(branches[k][i], 1);
          counted.push_back(branches[k][i]);
          const auto neighbours = graph_.Of(branches[k][i]);
          const auto it =
              std::lower_bound(neighbours.begin(), neighbours.end(), branches[k][i + 1]);
          total += cost_[static_cast<std::size_t>(graph_.begin[branches[k][i]]) +
                         static_cast<std::size_t>(it - neighbours.begin())];
        }
      }
      for (const int v : counted) count(v, -1);
      if (good && total < best_cost) {
        best_cost = total;
        best = branches;
      }
    }
  }
  for (std::size_t i = 1; i < path.size(); ++i) Count(path[i], -1);
  forget(ends[0], 1);
  forget(ends[1], 1);
  if (best_cost == kInfinity) return restore();
  for (const std::vector<int>& branch : best) AddPath(branch);
  AddPath(path);
  return true;
}

bool InducedTree::Attach(int at, std::span<const int> path) {
  // Nearest places on the tree first.
  std::vector<int> places = {at};
  std::vector<char> seen(links_.size(), 0);
  seen[at] = 1;
  for (std::size_t i = 0; i < places.size() && places.size() < 24; ++i) {
    for (const int w : links_[places[i]]) {
      if (!seen[w]) places.push_back(w);
      seen[w] = 1;
    }
  }
  for (const int place : places) {
    for (int reach = 2; reach <= 5; ++reach) {
      if (AttachAt(place, reach, path)) return true;
    }
  }
  return false;
}

}  // namespace

Paths ShortestPaths(const VertexGraph& graph,
                    std::span<const float> cost,
                    std::span<const int> sources,
                    std::span<const char> blocked,
                    int target) {
  const std::size_t n = graph.begin.size() - 1;
  Paths paths{std::vector<float>(n, kInfinity), std::vector<int>(n, -1)};
  using Entry = std::pair<float, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (const int s : sources) {
    paths.distance[s] = 0;
    queue.emplace(0.0F, s);
  }
  while (!queue.empty()) {
    const Entry top = queue.top();
    queue.pop();
    const int v = top.second;
    if (top.first > paths.distance[v]) continue;
    if (v == target) break;
    for (int e = graph.begin[v]; e < graph.begin[v + 1]; ++e) {
      const int w = graph.neighbour[e];
      if (!blocked.empty() && blocked[w]) continue;
      const float distance = top.first + cost[e];
      if (distance < paths.distance[w]) {
        paths.distance[w] = distance;
        paths.parent[w] = v;
        queue.emplace(distance, w);
      }
    }
  }
  return paths;
}

std::vector<Extremity> FindExtremities(const VertexGraph& graph, std::span<const float> length) {
  const int n = static_cast<int>(graph.begin.size()) - 1;
  // The middle: least greatest distance to points spread by farthest-point sampling.
  std::vector<float> worst(static_cast<std::size_t>(n), 0), nearest(worst.size(), kInfinity);
  int source = 0;
  for (int round = 0; round < 8; ++round) {
    const Paths paths = ShortestPaths(graph, length, std::array{source});
    for (int v = 0; v < n; ++v) {
      // The first source is arbitrary: it only starts the spread.
      if (round > 0) worst[v] = std::max(worst[v], paths.distance[v]);
      nearest[v] = round > 1 ? std::min(nearest[v], paths.distance[v]) : paths.distance[v];
    }
    source = static_cast<int>(std::max_element(nearest.begin(), nearest.end()) - nearest.begin());
  }
  const int middle = static_cast<int>(std::min_element(worst.begin(), worst.end()) - worst.begin());
  const std::vector<float> distance = ShortestPaths(graph, length, std::array{middle}).distance;

  // Peaks by descending distance; two meet at a pass, and the lower one ends there.
  std::vector<int> order(static_cast<std::size_t>(n));
  for (int v = 0; v < n; ++v) order[v] = v;
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    return distance[a] != distance[b] ? distance[a] > distance[b] : a < b;
  });
  std::vector<int> peak(static_cast<std::size_t>(n), -1);  // towards the peak of its component
  const auto find = [&](int v) {
    while (peak[v] != v) v = peak[v] = peak[peak[v]];
    return v;
  };
  std::vector<Extremity> extremities;
  const float highest = distance[order[0]];
  for (const int v : order) {
    int mine = -1;
    for (const int w : graph.Of(v)) {
      if (peak[w] < 0) continue;
      int other = find(w);
      if (mine < 0) {
        mine = other;
      } else if (other != mine) {
        const bool mine_is_higher =
            distance[mine] != distance[other] ? distance[mine] > distance[other] : mine < other;
        if (!mine_is_higher) std::swap(mine, other);
        extremities.push_back({other, (distance[other] - distance[v]) / highest});
        peak[other] = mine;
      }
    }
    peak[v] = mine < 0 ? v : mine;
  }
  extremities.push_back({order[0], 1.0F});
  std::stable_sort(
      extremities.begin(), extremities.end(), [](const Extremity& a, const Extremity& b) {
        return a.prominence > b.prominence;
      });
  return extremities;
}

Seam JoinInduced(const VertexGraph& graph,
                 std::span<const float> cost,
                 std::span<const int> terminals) {
  Require(terminals.size() >= 2, Fault::kStage, "the skin has no two ends to join by a seam");
  // The cheapest pair makes the trunk of the tree.
  Seam seam;
  std::vector<int> trunk;
  float least = kInfinity;
  for (std::size_t i = 0; i < terminals.size(); ++i) {
    const Paths paths = ShortestPaths(graph, cost, std::array{terminals[i]});
    for (std::size_t j = i + 1; j < terminals.size(); ++j) {
      if (paths.distance[terminals[j]] >= least) continue;
      const std::vector<int> path = Straighten(graph, PathTo(paths, terminals[j]));
      if (path.size() < 3) continue;  // its disk would have no four corners
      least = paths.distance[terminals[j]];
      trunk = path;
      seam.terminals = {terminals[i], terminals[j]};
    }
  }
  Require(!trunk.empty(), Fault::kStage, "the skin has too few vertices for a seam");
  InducedTree tree(graph, cost);
  tree.AddPath(trunk);

  std::vector<int> left;
  for (const int t : terminals) {
    if (t != seam.terminals[0] && t != seam.terminals[1]) left.push_back(t);
  }
  while (!left.empty()) {
    const Paths paths = ShortestPaths(graph, cost, tree.Vertices());
    const auto nearest = std::min_element(left.begin(), left.end(), [&](int a, int b) {
      return paths.distance[a] < paths.distance[b];
    });
    const int terminal = *nearest;
    left.erase(nearest);
    const std::vector<int> path = PathTo(paths, terminal);
    // The part of it clear of the tree.
    std::size_t first = 0;
    for (std::size_t i = 0; i < path.size(); ++i) {
      if (tree.Near(path[i])) first = i + 1;
    }
    if (first >= path.size()) continue;
    const std::vector<int> clear = Straighten(
        graph, std::vector<int>(path.begin() + static_cast<std::ptrdiff_t>(first), path.end()));
    int at = path[0];
    for (const int w : graph.Of(path[first - 1])) {
      if (tree.Contains(w)) at = w;
    }
    if (tree.Attach(at, clear)) seam.terminals.push_back(terminal);
  }
  seam.edges = tree.Edges();
  return seam;
}

}  // namespace dyxel::internal
