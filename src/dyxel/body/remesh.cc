#include "dyxel/body/remesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>

#include "dyxel/base/parallel.h"

namespace dyxel {
namespace {

using Edge = std::pair<int, int>;

std::size_t At(int i) { return static_cast<std::size_t>(i); }

class Remesher {
 public:
  Remesher(const HalfMesh& mesh, const RemeshProblem& problem)
      : problem_(problem), positions_(mesh.positions), triangles_(mesh.triangles) {
    faces_.resize(positions_.size());
    for (std::size_t f = 0; f < triangles_.size(); ++f) {
      for (const int v : triangles_[f]) faces_[At(v)].push_back(static_cast<int>(f));
    }
    lengths_.resize(positions_.size());
    border_.resize(positions_.size());
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      border_[v] = positions_[v][1] == 0;
      lengths_[v] = problem_.edge_length(positions_[v]);
    }
  }

  HalfMesh Run() {
    for (int round = 0; round < problem_.rounds; ++round) {
      Split();
      Collapse();
      Flip();
      Relax(true);
    }
    // What is left is only made rounder.
    for (int i = 0; i < 3; ++i) {
      Flip();
      Relax(i < 2);
    }
    return Compact();
  }

 private:
  [[nodiscard]] double Length(int a, int b) const {
    return (positions_[At(a)] - positions_[At(b)]).norm();
  }
  [[nodiscard]] double Wanted(int a, int b) const {
    return 0.5 * (lengths_[At(a)] + lengths_[At(b)]);
  }

  // All edges, each once, in a fixed order.
  [[nodiscard]] std::vector<Edge> Edges() const {
    std::vector<Edge> edges;
    edges.reserve(3 * triangles_.size());
    for (const Triangle& t : triangles_) {
      if (t[0] < 0) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        edges.emplace_back(std::minmax(t[k], t[(k + 1) % 3]));
      }
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
  }

  // The (at most two) faces at an edge; -1 where there is none.
  [[nodiscard]] std::array<int, 2> FacesOf(int a, int b) const {
    std::array<int, 2> found = {-1, -1};
    std::size_t n = 0;
    for (const int f : faces_[At(a)]) {
      const Triangle& t = triangles_[At(f)];
      if ((t[0] == b || t[1] == b || t[2] == b) && n < 2) found[n++] = f;
    }
    return found;
  }

  [[nodiscard]] int Opposite(int f, int a, int b) const {
    for (const int v : triangles_[At(f)]) {
      if (v != a && v != b) return v;
    }
    return -1;
  }

  [[nodiscard]] std::vector<int> Neighbours(int v) const {
    std::vector<int> ring;
    for (const int f : faces_[At(v)]) {
      for (const int w : triangles_[At(f)]) {
        if (w != v && std::find(ring.begin(), ring.end(), w) == ring.end()) ring.push_back(w);
      }
    }
    return ring;
  }

  [[nodiscard]] Vec3d Normal(const Triangle& t) const {
    return (positions_[At(t[1])] - positions_[At(t[0])])
        .cross(positions_[At(t[2])] - positions_[At(t[0])]);
  }

  void Replace(int f, int from, int to) {
    for (int& v : triangles_[At(f)]) {
      if (v == from) v = to;
    }
  }

  void Unlink(int v, int f) {
    std::vector<int>& list = faces_[At(v)];
    list.erase(std::find(list.begin(), list.end(), f));
  }

  void Split() {
    for (const Edge& edge : Edges()) {
      const int a = edge.first;
      const int b = edge.second;
      if (Length(a, b) <= 4.0 / 3.0 * Wanted(a, b)) continue;
      const std::array<int, 2> faces = FacesOf(a, b);
      const int m = static_cast<int>(positions_.size());
      positions_.emplace_back(0.5 * (positions_[At(a)] + positions_[At(b)]));
      lengths_.push_back(problem_.edge_length(positions_.back()));
      border_.push_back(faces[1] < 0);
      faces_.emplace_back();
      for (const int f : faces) {
        if (f < 0) continue;
        const int c = Opposite(f, a, b);
        Triangle copy = triangles_[At(f)];
        for (int& v : copy) {
          if (v == a) v = m;
        }
        const int g = static_cast<int>(triangles_.size());
        triangles_.push_back(copy);
        Replace(f, b, m);
        Unlink(b, f);
        faces_[At(b)].push_back(g);
        faces_[At(c)].push_back(g);
        faces_[At(m)].push_back(f);
        faces_[At(m)].push_back(g);
      }
    }
  }

  // Would every remaining face of `v` keep its side and its edges short, if v were at `x`?
  [[nodiscard]] bool MayMove(int v, int other, const Vec3d& x) const {
    for (const int f : faces_[At(v)]) {
      Triangle t = triangles_[At(f)];
      if (t[0] == other || t[1] == other || t[2] == other) continue;
      const Vec3d before = Normal(t);
      std::array<Vec3d, 3> p;
      for (std::size_t k = 0; k < 3; ++k) {
        p[k] = t[k] == v ? x : positions_[At(t[k])];
        if (t[k] != v && (positions_[At(t[k])] - x).norm() > 4.0 / 3.0 * Wanted(v, t[k])) {
          return false;
        }
      }
      const Vec3d after = (p[1] - p[0]).cross(p[2] - p[0]);
      if (after.dot(before) < 0.3 * after.norm() * before.norm() || after.norm() < 1e-12) {
        return false;
      }
    }
    return true;
  }

  void Collapse() {
    for (const Edge& edge : Edges()) {
      int a = edge.first;
      int b = edge.second;
      if (faces_[At(a)].empty() || faces_[At(b)].empty()) continue;
      if (Length(a, b) >= 0.8 * Wanted(a, b)) continue;
      const std::array<int, 2> faces = FacesOf(a, b);
      if (faces[0] < 0) continue;  // gone since
      const bool border_edge = faces[1] < 0;
      if (border_[At(a)] && border_[At(b)] && !border_edge) continue;
      if (border_[At(b)] && !border_[At(a)]) std::swap(a, b);  // b goes into a
      const Vec3d x = border_[At(a)] && !border_[At(b)]
                          ? positions_[At(a)]
                          : Vec3d(0.5 * (positions_[At(a)] + positions_[At(b)]));
      // Link condition: else the surface would be pinched.
      const std::vector<int> ring_a = Neighbours(a);
      std::size_t common = 0;
      for (const int w : Neighbours(b)) {
        common += std::find(ring_a.begin(), ring_a.end(), w) != ring_a.end() ? 1U : 0U;
      }
      if (common != (border_edge ? 1U : 2U)) continue;
      bool keeps_valence = true;
      for (const int f : faces) {
        if (f < 0) continue;
        const int c = Opposite(f, a, b);
        keeps_valence = keeps_valence && faces_[At(c)].size() > (border_[At(c)] ? 2U : 3U);
      }
      if (!keeps_valence || !MayMove(a, b, x) || !MayMove(b, a, x)) continue;
      for (const int f : faces) {
        if (f < 0) continue;
        for (const int v : triangles_[At(f)]) Unlink(v, f);
        triangles_[At(f)] = {-1, -1, -1};
      }
      for (const int f : faces_[At(b)]) {
        Replace(f, b, a);
        faces_[At(a)].push_back(f);
      }
      faces_[At(b)].clear();
      positions_[At(a)] = x;
      lengths_[At(a)] = problem_.edge_length(x);
    }
  }

  [[nodiscard]] int Excess(int v) const {
    const int valence = static_cast<int>(faces_[At(v)].size()) + (border_[At(v)] ? 1 : 0);
    return valence - (border_[At(v)] ? 4 : 6);
  }

  void Flip() {
    for (const Edge& edge : Edges()) {
      const int a = edge.first;
      const int b = edge.second;
      const std::array<int, 2> faces = FacesOf(a, b);
      if (faces[0] < 0 || faces[1] < 0) continue;
      const int c = Opposite(faces[0], a, b);
      const int d = Opposite(faces[1], a, b);
      auto square = [](int x) { return x * x; };
      const int before =
          square(Excess(a)) + square(Excess(b)) + square(Excess(c)) + square(Excess(d));
      const int after = square(Excess(a) - 1) + square(Excess(b) - 1) + square(Excess(c) + 1) +
                        square(Excess(d) + 1);
      if (after >= before || FacesOf(c, d)[0] >= 0) continue;
      if (border_[At(c)] && border_[At(d)]) continue;
      Triangle t0 = triangles_[At(faces[0])];
      Triangle t1 = triangles_[At(faces[1])];
      const Vec3d n = Normal(t0).normalized() + Normal(t1).normalized();
      // (a, b, c) and (b, a, d) become (a, d, c) and (d, b, c).
      std::replace(t0.begin(), t0.end(), b, d);
      std::replace(t1.begin(), t1.end(), a, c);
      const Vec3d n0 = Normal(t0);
      const Vec3d n1 = Normal(t1);
      if (n0.dot(n) < 0.8 * n0.norm() * n.norm() || n1.dot(n) < 0.8 * n1.norm() * n.norm())
        continue;
      triangles_[At(faces[0])] = t0;
      triangles_[At(faces[1])] = t1;
      Unlink(b, faces[0]);
      Unlink(a, faces[1]);
      faces_[At(d)].push_back(faces[0]);
      faces_[At(c)].push_back(faces[1]);
    }
  }

  void Relax(bool roughly) {
    std::vector<Vec3d> moved = positions_;
    ParallelForBlocks(positions_.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        if (!faces_[v].empty()) moved[v] = Relaxed(static_cast<int>(v), roughly);
      }
    });
    positions_ = std::move(moved);
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      lengths_[v] = problem_.edge_length(positions_[v]);
    }
  }

  [[nodiscard]] Vec3d Relaxed(int v, bool roughly) const {
    const Vec3d& x = positions_[At(v)];
    Vec3d mean = Vec3d::Zero();
    double count = 0;
    for (const int w : Neighbours(v)) {
      // A vertex of the boundary follows its two neighbours there.
      if (border_[At(v)] && (!border_[At(w)] || FacesOf(v, w)[1] >= 0)) continue;
      mean += positions_[At(w)];
      count += 1;
    }
    mean /= count;
    Vec3d normal = Vec3d::Zero();
    for (const int f : faces_[At(v)]) normal += Normal(triangles_[At(f)]);
    if (border_[At(v)]) normal[1] = 0;
    normal.normalize();
    const Vec3d pull = mean - x;
    Vec3d y = problem_.project(x + 0.7 * (pull - normal * normal.dot(pull)), roughly);
    if (border_[At(v)]) y[1] = 0;
    return y;
  }

  [[nodiscard]] HalfMesh Compact() const {
    HalfMesh mesh;
    std::vector<int> renumbered(positions_.size(), -1);
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      if (faces_[v].empty()) continue;
      renumbered[v] = static_cast<int>(mesh.positions.size());
      mesh.positions.push_back(positions_[v]);
    }
    for (const Triangle& t : triangles_) {
      if (t[0] < 0) continue;
      mesh.triangles.push_back({renumbered[At(t[0])], renumbered[At(t[1])], renumbered[At(t[2])]});
    }
    return mesh;
  }

  const RemeshProblem& problem_;
  std::vector<Vec3d> positions_;
  std::vector<Triangle> triangles_;
  std::vector<std::vector<int>> faces_;  // of each vertex
  std::vector<double> lengths_;          // wanted at each vertex
  std::vector<bool> border_;
};

}  // namespace

HalfMesh Remesh(const HalfMesh& mesh, const RemeshProblem& problem) {
  return Remesher(mesh, problem).Run();
}

}  // namespace dyxel
