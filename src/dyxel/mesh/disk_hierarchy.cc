#include "dyxel/mesh/disk_hierarchy.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace dyxel::internal {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr int kShortestBorder = 8;

// 1 for an equilateral triangle, 0 for none.
double Quality(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const double edges = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return 2 * std::sqrt(3.0) * (b - a).cross(c - a).norm() / std::max(edges, 1e-300);
}

// Centre of the part of a box around the ring that sees every ring edge (a, b) from the left;
// false if there is none.
bool KernelCentre(const std::vector<std::array<Vec2d, 2>>& edges, Vec2d& centre) {
  Vec2d low = edges[0][0], high = low;
  for (const auto& e : edges) {
    for (const Vec2d& p : e) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
  }
  std::vector<Vec2d> polygon = {low, {high.x(), low.y()}, high, {low.x(), high.y()}}, clipped;
  for (const auto& e : edges) {
    clipped.clear();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2d &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
      const double dp = DoubleArea(e[0], e[1], p), dq = DoubleArea(e[0], e[1], q);
      if (dp >= 0) clipped.push_back(p);
      if ((dp > 0 && dq < 0) || (dp < 0 && dq > 0))
        clipped.emplace_back(p + dp / (dp - dq) * (q - p));
    }
    polygon.swap(clipped);
    if (polygon.size() < 3) return false;
  }
  // Area-weighted, so that the many vertices of a clipped corner do not pull.
  double area = 0;
  Vec2d sum = Vec2d::Zero();
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const double a = DoubleArea(polygon[0], polygon[i], polygon[i + 1]);
    area += a;
    sum += a / 3 * (polygon[0] + polygon[i] + polygon[i + 1]);
  }
  if (!(area > 0)) return false;
  centre = sum / area;
  return true;
}

bool SeesAll(const std::vector<std::array<Vec2d, 2>>& edges, const Vec2d& p) {
  return std::all_of(edges.begin(), edges.end(), [&](const std::array<Vec2d, 2>& e) {
    // More than rounding: relative to the edge's length.
    return DoubleArea(e[0], e[1], p) > 1e-9 * (e[1] - e[0]).squaredNorm();
  });
}

}  // namespace

DiskHierarchy::DiskHierarchy(std::vector<Vec3d> positions,
                             std::vector<Triangle> triangles,
                             std::span<const int> border,
                             std::span<const char> kept,
                             int coarsest_vertices)
    : positions_(std::move(positions)),
      triangles_(std::move(triangles)),
      alive_(triangles_.size(), 1),
      present_(positions_.size(), 1),
      kept_(kept.begin(), kept.end()),
      next_(positions_.size(), -1),
      previous_(positions_.size(), -1),
      incident_(positions_.size()),
      border_length_(static_cast<int>(border.size())) {
  for (std::size_t i = 0; i < border.size(); ++i) {
    const int v = border[i], w = border[(i + 1) % border.size()];
    next_[v] = w;
    previous_[w] = v;
  }
  for (int f = 0; f < static_cast<int>(triangles_.size()); ++f) {
    for (const int v : triangles_[f]) incident_[v].push_back(f);
  }
  int count = static_cast<int>(positions_.size());
  std::vector<char> locked(positions_.size());
  std::vector<Candidate> candidates;
  Ring ring;
  while (count > coarsest_vertices) {
    candidates.clear();
    for (int v = 0; v < static_cast<int>(positions_.size()); ++v) {
      if (!present_[v] || kept_[v]) continue;
      const Candidate candidate = BestCollapse(v);
      if (candidate.cost < kNever) candidates.push_back(candidate);
    }
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
      return a.cost != b.cost ? a.cost < b.cost : a.removed < b.removed;
    });
    // The dearest wait for a later level, where they may be cheap beside what is left.
    candidates.resize(candidates.size() - candidates.size() / 8);
    std::fill(locked.begin(), locked.end(), 0);
    levels_.emplace_back();
    for (const Candidate& candidate : candidates) {
      if (count <= coarsest_vertices) break;
      if (locked[candidate.removed]) continue;
      if (next_[candidate.removed] >= 0 && border_length_ <= kShortestBorder) continue;
      // Neighbours may have changed since the costs were found: only where none was touched.
      if (!FindRing(candidate.removed, ring)) continue;
      if (CollapseCost(candidate.removed, candidate.kept, ring) == kNever) continue;
      for (std::size_t i = 0; i < ring.size; ++i) locked[ring.vertex[i]] = 1;
      Apply(candidate);
      --count;
    }
    if (levels_.back().empty()) {
      levels_.pop_back();
      break;
    }
  }
}

std::size_t DiskHierarchy::Ring::Find(int v) const {
  std::size_t i = 0;
  while (i < size && vertex[i] != v) ++i;
  return i;
}

bool DiskHierarchy::FindRing(int v, Ring& ring) const {
  ring.size = 0;
  for (const int f : incident_[v]) {
    for (const int w : triangles_[f]) {
      if (w == v || ring.Find(w) < ring.size) continue;
      if (ring.size == Ring::kMost) return false;
      ring.vertex[ring.size++] = w;
    }
  }
  return true;
}

double DiskHierarchy::CollapseCost(int v, int u, const Ring& ring) const {
  const bool on_border = next_[v] >= 0;
  if (on_border && next_[v] != u && previous_[v] != u) return kNever;
  const int expected = on_border ? 1 : 2;
  const int other = on_border ? (next_[v] == u ? previous_[v] : next_[v]) : -1;
  // The two have no neighbours in common but the far corners of the vanishing triangles, and no
  // edge between border vertices comes to be.
  std::uint64_t joined = 0;
  for (const int f : incident_[u]) {
    for (const int w : triangles_[f]) {
      const std::size_t i = w == u ? ring.size : ring.Find(w);
      if (i < ring.size) joined |= std::uint64_t{1} << i;
    }
  }
  if (std::popcount(joined) != expected) return kNever;
  if (next_[u] >= 0) {
    for (std::size_t i = 0; i < ring.size; ++i) {
      const int w = ring.vertex[i];
      if (w != u && w != other && next_[w] >= 0 && (joined >> i & 1U) == 0) return kNever;
    }
  }
  int vanishing = 0;
  double bend = 0;
  for (const int f : incident_[v]) {
    const Triangle& t = triangles_[f];
    if (t[0] == u || t[1] == u || t[2] == u) {
      ++vanishing;
      continue;
    }
    std::array<Vec3d, 3> p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = positions_[t[k] == v ? u : t[k]];
    const Vec3d before =
        (positions_[t[1]] - positions_[t[0]]).cross(positions_[t[2]] - positions_[t[0]]);
    const Vec3d after = (p[1] - p[0]).cross(p[2] - p[0]);
    const double cosine = before.dot(after) / std::max(before.norm() * after.norm(), 1e-300);
    if (cosine < 0.3) return kNever;
    const double quality = Quality(p[0], p[1], p[2]);
    if (quality < 0.1 &&
        quality < 0.7 * Quality(positions_[t[0]], positions_[t[1]], positions_[t[2]])) {
      return kNever;
    }
    bend += (1 - cosine) + 0.05 * std::max(0.0, 0.5 - quality);
  }
  if (vanishing != expected) return kNever;
  double cost = (positions_[u] - positions_[v]).squaredNorm() * (0.1 + bend);
  if (on_border) {
    const Vec3d along = (positions_[other] - positions_[u]).normalized();
    const Vec3d off = positions_[v] - positions_[u];
    cost += (off - off.dot(along) * along).squaredNorm();
  }
  return cost;
}

DiskHierarchy::Candidate DiskHierarchy::BestCollapse(int v) const {
  Candidate best{kNever, v, -1};
  Ring ring;
  if (!FindRing(v, ring)) return best;
  // The shortest edges first: the next best cannot be much better than the first that will do.
  std::array<std::pair<double, int>, Ring::kMost> edges;
  std::size_t count = 0;
  for (std::size_t i = 0; i < ring.size; ++i) {
    const int u = ring.vertex[i];
    if (next_[v] >= 0 && next_[v] != u && previous_[v] != u) continue;
    edges[count++] = {(positions_[u] - positions_[v]).squaredNorm(), u};
  }
  std::sort(edges.begin(), edges.begin() + static_cast<std::ptrdiff_t>(count));
  int good = 0;
  for (std::size_t i = 0; i < count && good < 2; ++i) {
    const double cost = CollapseCost(v, edges[i].second, ring);
    if (cost == kNever) continue;
    ++good;
    if (cost < best.cost) best = {cost, v, edges[i].second};
  }
  return best;
}

void DiskHierarchy::Apply(const Candidate& candidate) {
  const int v = candidate.removed, u = candidate.kept;
  Collapse collapse{v, u, -1, {}, {-1, -1}};
  std::size_t vanished = 0;
  for (const int f : incident_[v]) {
    Triangle& t = triangles_[f];
    if (t[0] == u || t[1] == u || t[2] == u) {
      collapse.vanished[vanished++] = f;
      alive_[f] = 0;
      for (const int w : t) {
        if (w != v) std::erase(incident_[w], f);
      }
    } else {
      std::replace(t.begin(), t.end(), v, u);
      incident_[u].push_back(f);
      collapse.moved.push_back(f);
    }
  }
  if (next_[v] >= 0) {
    const bool forward = next_[v] == u;
    const int other = forward ? previous_[v] : next_[v];
    collapse.border_neighbour = other;
    (forward ? next_[other] : previous_[other]) = u;
    (forward ? previous_[u] : next_[u]) = other;
    --border_length_;
  }
  present_[v] = 0;
  levels_.back().push_back(std::move(collapse));
}

DiskHierarchy::Level DiskHierarchy::Current() const {
  Level level;
  std::vector<int> index(positions_.size(), -1);
  for (int v = 0; v < static_cast<int>(positions_.size()); ++v) {
    if (!present_[v]) continue;
    index[v] = static_cast<int>(level.vertices.size());
    level.vertices.push_back(v);
  }
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    if (!alive_[f]) continue;
    const Triangle& t = triangles_[f];
    level.triangles.push_back({index[t[0]], index[t[1]], index[t[2]]});
    level.rest.push_back(MakeRestTriangle(positions_[t[0]], positions_[t[1]], positions_[t[2]]));
  }
  int first = 0;
  while (next_[level.vertices[first]] < 0) ++first;
  first = level.vertices[first];
  int v = first;
  do {
    level.border.push_back(index[v]);
    v = next_[v];
  } while (v != first);
  return level;
}

void DiskHierarchy::Refine(std::vector<Vec2d>& uv, bool straight_border) {
  std::vector<std::array<Vec2d, 2>> edges;
  std::vector<Collapse>& level = levels_.back();
  for (auto it = level.rbegin(); it != level.rend(); ++it) {
    const Collapse& collapse = *it;
    const int v = collapse.removed, u = collapse.kept;
    edges.clear();
    const auto add_edge = [&](int f) {
      const Triangle& t = triangles_[f];
      const std::size_t k = t[0] == v ? 0 : (t[1] == v ? 1 : 2);
      edges.push_back({uv[t[(k + 1) % 3]], uv[t[(k + 2) % 3]]});
    };
    for (const int f : collapse.moved) {
      std::replace(triangles_[f].begin(), triangles_[f].end(), u, v);
      add_edge(f);
    }
    for (const int f : collapse.vanished) {
      if (f < 0) continue;
      alive_[f] = 1;
      add_edge(f);
    }
    present_[v] = 1;

    Vec2d place = Vec2d::Zero();
    bool placed = false;
    const int other = collapse.border_neighbour;
    if (other >= 0) {
      // On the line to the other neighbour, by the lengths on the surface; nearer to the kept
      // vertex where the line bulges past the ring.
      const double to_u = (positions_[v] - positions_[u]).norm();
      double share = to_u / std::max(to_u + (positions_[v] - positions_[other]).norm(), 1e-300);
      for (int attempt = 0; attempt < 40 && !placed; ++attempt, share *= 0.6) {
        place = uv[u] + share * (uv[other] - uv[u]);
        placed = SeesAll(edges, place);
        if (!straight_border && attempt == 3) break;
      }
      if (next_[u] == other) {
        next_[u] = previous_[other] = v;
        previous_[v] = u;
        next_[v] = other;
      } else {
        previous_[u] = next_[other] = v;
        next_[v] = u;
        previous_[v] = other;
      }
      ++border_length_;
    } else {
      place.setZero();
      for (const auto& e : edges) place += e[0] / static_cast<double>(edges.size());
      placed = SeesAll(edges, place);
    }
    if (!placed && !(straight_border && other >= 0)) {
      placed = KernelCentre(edges, place) && SeesAll(edges, place);
    }
    if (!placed && !(straight_border && other >= 0)) place = uv[u];
    uv[v] = place;
  }
  levels_.pop_back();
}

}  // namespace dyxel::internal
