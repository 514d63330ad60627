#include "dyxel/mesh/triangle_mesh.h"

#include "dyxel/base/parallel.h"
#include "dyxel/mesh/adjacency.h"

namespace dyxel {

std::vector<Vec3f> VertexNormals(std::span<const Vec3f> positions,
                                 std::span<const Triangle> triangles) {
  std::vector<Vec3f> normals(positions.size(), Vec3f::Zero());
  for (const Triangle& t : triangles) {
    const auto a = static_cast<std::size_t>(t[0]);
    const auto b = static_cast<std::size_t>(t[1]);
    const auto c = static_cast<std::size_t>(t[2]);
    const Vec3f doubled_area = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
    normals[a] += doubled_area;
    normals[b] += doubled_area;
    normals[c] += doubled_area;
  }
  for (Vec3f& n : normals) {
    const float length = n.norm();
    n = length > 0 ? Vec3f(n / length) : Vec3f::Zero();
  }
  return normals;
}

std::vector<Vec3f> SmoothPositions(std::span<const Vec3f> positions,
                                   std::span<const Triangle> triangles,
                                   int rounds) {
  const VertexNeighbours neighbours =
      NeighboursOfVertices(triangles, static_cast<int>(positions.size()));
  std::vector<Vec3f> current(positions.begin(), positions.end());
  std::vector<Vec3f> next(current.size());
  for (int round = 0; round < rounds; ++round) {
    ParallelForBlocks(current.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        const int first = neighbours.begin[v];
        const int last = neighbours.begin[v + 1];
        if (first == last) {
          next[v] = current[v];
          continue;
        }
        Vec3f sum = Vec3f::Zero();
        for (int i = first; i < last; ++i) {
          sum += current[static_cast<std::size_t>(neighbours.index[static_cast<std::size_t>(i)])];
        }
        next[v] = 0.5F * current[v] + (0.5F / static_cast<float>(last - first)) * sum;
      }
    });
    current.swap(next);
  }
  return current;
}

}  // namespace dyxel
