#include "dyxel/mesh/closest_point.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace dyxel {
namespace {

constexpr int kLeafSize = 4;

float SquaredDistanceToBox(const Vec3f& x, const Vec3f& low, const Vec3f& high) {
  return (x - x.cwiseMax(low).cwiseMin(high)).squaredNorm();
}

}  // namespace

Vec3f ClosestPointOnTriangle(const Vec3f& x, const Vec3f& a, const Vec3f& b, const Vec3f& c) {
  const Vec3f ab = b - a;
  const Vec3f ac = c - a;
  const Vec3f ax = x - a;
  const float d1 = ab.dot(ax);
  const float d2 = ac.dot(ax);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec3f bx = x - b;
  const float d3 = ab.dot(bx);
  const float d4 = ac.dot(bx);
  if (d3 >= 0 && d4 <= d3) return b;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  const Vec3f cx = x - c;
  const float d5 = ab.dot(cx);
  const float d6 = ac.dot(cx);
  if (d6 >= 0 && d5 <= d6) return c;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  }
  const float inverse = 1 / (va + vb + vc);
  return a + ab * (vb * inverse) + ac * (vc * inverse);
}

ClosestPointTree::ClosestPointTree(std::span<const Vec3f> positions,
                                   std::span<const Triangle> triangles) {
  corners_.reserve(triangles.size());
  for (const Triangle& t : triangles) {
    corners_.push_back({positions[static_cast<std::size_t>(t[0])],
                        positions[static_cast<std::size_t>(t[1])],
                        positions[static_cast<std::size_t>(t[2])]});
  }
  order_.resize(corners_.size());
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.reserve(corners_.size());
  if (!order_.empty()) Build(0, static_cast<int>(order_.size()));
}

int ClosestPointTree::Build(int begin, int end) {
  const int index = static_cast<int>(nodes_.size());
  Node node{Vec3f::Constant(std::numeric_limits<float>::max()),
            Vec3f::Constant(std::numeric_limits<float>::lowest()),
            begin,
            end,
            -1};
  for (int i = begin; i < end; ++i) {
    for (const Vec3f& x : corners_[static_cast<std::size_t>(order_[static_cast<std::size_t>(i)])]) {
      node.low = node.low.cwiseMin(x);
      node.high = node.high.cwiseMax(x);
    }
  }
  nodes_.push_back(node);
  if (end - begin <= kLeafSize) return index;
  int axis = 0;
  (node.high - node.low).maxCoeff(&axis);
  const int middle = (begin + end) / 2;
  const auto centre = [&](int t) {
    const auto& c = corners_[static_cast<std::size_t>(t)];
    return c[0][axis] + c[1][axis] + c[2][axis];
  };
  std::nth_element(
      order_.begin() + begin, order_.begin() + middle, order_.begin() + end, [&](int a, int b) {
        const float ca = centre(a);
        const float cb = centre(b);
        return ca < cb || (ca == cb && a < b);
      });
  Build(begin, middle);
  const int right = Build(middle, end);
  nodes_[static_cast<std::size_t>(index)].right = right;
  return index;
}

ClosestPoint ClosestPointTree::Find(const Vec3f& x, int guess) const {
  ClosestPoint best;
  float best_squared = std::numeric_limits<float>::infinity();
  const auto look_at = [&](int t) {
    const auto& c = corners_[static_cast<std::size_t>(t)];
    const Vec3f point = ClosestPointOnTriangle(x, c[0], c[1], c[2]);
    const float squared = (x - point).squaredNorm();
    if (!(squared < best_squared)) return;
    best_squared = squared;
    best.triangle = t;
    best.point = point;
  };
  if (guess >= 0) look_at(guess);
  std::array<int, 64> stack;
  int top = 0;
  if (!nodes_.empty()) stack[static_cast<std::size_t>(top++)] = 0;
  while (top > 0) {
    const int index = stack[static_cast<std::size_t>(--top)];
    const Node& node = nodes_[static_cast<std::size_t>(index)];
    if (SquaredDistanceToBox(x, node.low, node.high) >= best_squared) continue;
    if (node.right < 0) {
      for (int i = node.begin; i < node.end; ++i) look_at(order_[static_cast<std::size_t>(i)]);
      continue;
    }
    // The nearer child is looked at first.
    const int left = index + 1;
    const Node& l = nodes_[static_cast<std::size_t>(left)];
    const Node& r = nodes_[static_cast<std::size_t>(node.right)];
    const bool left_first =
        SquaredDistanceToBox(x, l.low, l.high) <= SquaredDistanceToBox(x, r.low, r.high);
    stack[static_cast<std::size_t>(top++)] = left_first ? node.right : left;
    stack[static_cast<std::size_t>(top++)] = left_first ? left : node.right;
  }
  best.distance = std::sqrt(best_squared);
  return best;
}

}  // namespace dyxel
