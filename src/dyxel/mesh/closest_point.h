// Closest points on a triangle mesh, by a tree of bounding boxes.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "dyxel/math/types.h"

namespace dyxel {

struct ClosestPoint {
  int triangle = -1;
  Vec3f point = Vec3f::Zero();
  float distance = 0;  // metres
};

// Point of triangle abc that is nearest to x (Ericson, Real-Time Collision Detection, 5.1.5).
[[nodiscard]] Vec3f ClosestPointOnTriangle(const Vec3f& x,
                                           const Vec3f& a,
                                           const Vec3f& b,
                                           const Vec3f& c);

// Answers closest-point queries on one posed mesh; keeps its own copy of the corners. Find() may be
// called from several threads.
class ClosestPointTree {
 public:
  ClosestPointTree(std::span<const Vec3f> positions, std::span<const Triangle> triangles);
  // An empty mesh gives triangle -1 and an infinite distance. A `guess`, such as the triangle of
  // the point before, saves time where it is near; of triangles at one distance it is the answer.
  [[nodiscard]] ClosestPoint Find(const Vec3f& x, int guess = -1) const;

 private:
  struct Node {
    Vec3f low, high;
    int begin, end;  // range of order_; leaves only
    int right;       // index of the right child, the left is the next node; -1 for a leaf
  };
  int Build(int begin, int end);

  std::vector<std::array<Vec3f, 3>> corners_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

}  // namespace dyxel
