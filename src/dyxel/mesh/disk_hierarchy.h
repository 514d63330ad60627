// A disk simplified level by level, and grown back with its map to the plane: what makes the
// parameterizations fast. (A progressive mesh; Hormann, Greiner, Campagna 1999.)
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dyxel/mesh/flatten.h"

namespace dyxel::internal {

// Vertices are removed by half-edge collapses, an independent set a level, so that each one's ring
// is as it was when it comes back. A collapse keeps the mesh a disk and never lets an inner edge
// join two border vertices that had none.
class DiskHierarchy {
 public:
  // `border` is the disk's loop, `kept` (V) nonzero for vertices that stay in every level.
  DiskHierarchy(std::vector<Vec3d> positions,
                std::vector<Triangle> triangles,
                std::span<const int> border,
                std::span<const char> kept,
                int coarsest_vertices);

  // The disk as it stands: its vertices, and its triangles by index into them.
  struct Level {
    std::vector<int> vertices;        // of the whole disk
    std::vector<Triangle> triangles;  // by index into `vertices`
    std::vector<RestTriangle> rest;
    std::vector<int> border;  // loop, by index into `vertices`
  };
  [[nodiscard]] Level Current() const;
  [[nodiscard]] bool AtFinest() const { return levels_.empty(); }

  // Brings the vertices of one level back and places each within the kernel of its ring, so that a
  // map without flips stays one; a border vertex on the line between its neighbours where that is
  // possible, always where `straight_border`. `uv` (V) of the whole disk. A vertex for which
  // precision leaves no room lands on its neighbour: a triangle without area.
  void Refine(std::vector<Vec2d>& uv, bool straight_border);

 private:
  struct Collapse {
    int removed, kept;
    int border_neighbour;         // the removed vertex's other one on the border, -1 inside
    std::vector<int> moved;       // triangles whose corner went from removed to kept
    std::array<int, 2> vanished;  // triangles, the second -1 at the border
  };
  struct Candidate {
    double cost;
    int removed, kept;
  };
  // Neighbours of a vertex; those with more are left in the mesh.
  struct Ring {
    static constexpr std::size_t kMost = 32;
    std::array<int, kMost> vertex;
    std::size_t size = 0;
    [[nodiscard]] std::size_t Find(int v) const;  // size if absent
  };
  [[nodiscard]] bool FindRing(int v, Ring& ring) const;
  [[nodiscard]] Candidate BestCollapse(int v) const;
  [[nodiscard]] double CollapseCost(int v, int u, const Ring& ring) const;
  void Apply(const Candidate& candidate);

  std::vector<Vec3d> positions_;            // (V)
  std::vector<Triangle> triangles_;         // (F); a vanished one as it was last
  std::vector<char> alive_;                 // (F)
  std::vector<char> present_;               // (V)
  std::vector<char> kept_;                  // (V)
  std::vector<int> next_, previous_;        // (V) on the border, -1 inside
  std::vector<std::vector<int>> incident_;  // (V) triangles
  int border_length_ = 0;
  std::vector<std::vector<Collapse>> levels_;  // from the finest
};

}  // namespace dyxel::internal
