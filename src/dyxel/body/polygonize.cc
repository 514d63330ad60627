#include "dyxel/body/polygonize.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "dyxel/base/parallel.h"

namespace dyxel {
namespace {

constexpr int kBlockNodes = 6;

struct Grid {
  std::array<int, 3> size{};  // nodes
  Vec3d low;
  double spacing = 0;
  std::vector<double> values;

  [[nodiscard]] std::size_t Node(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size[1]) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(x);
  }
  [[nodiscard]] Vec3d Position(int x, int y, int z) const { return low + spacing * Vec3d(x, y, z); }
};

void FillBlock(const std::function<double(const Vec3d&)>& distance,
               Grid& grid,
               std::array<int, 3> begin) {
  std::array<int, 3> end{};
  for (std::size_t k = 0; k < 3; ++k) end[k] = std::min(begin[k] + kBlockNodes, grid.size[k]);
  const double half = 0.5 * (kBlockNodes - 1) * grid.spacing;
  const Vec3d center = grid.Position(begin[0], begin[1], begin[2]) + Vec3d::Constant(half);
  const double at_center = distance(center);
  // One cell more than the block, and the field may be twice the distance.
  const bool far = std::abs(at_center) > 2 * std::sqrt(3.0) * (half + grid.spacing);
  for (int z = begin[2]; z < end[2]; ++z) {
    for (int y = begin[1]; y < end[1]; ++y) {
      for (int x = begin[0]; x < end[0]; ++x) {
        grid.values[grid.Node(x, y, z)] = far ? at_center : distance(grid.Position(x, y, z));
      }
    }
  }
}

Grid Sample(const std::function<double(const Vec3d&)>& distance,
            const Vec3d& low,
            const Vec3d& high,
            double spacing) {
  Grid grid;
  grid.low = low;
  grid.spacing = spacing;
  std::array<int, 3> blocks{};
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    grid.size[i] = static_cast<int>(std::ceil((high[k] - low[k]) / spacing)) + 1;
    blocks[i] = (grid.size[i] + kBlockNodes - 1) / kBlockNodes;
  }
  grid.values.resize(grid.Node(0, 0, grid.size[2]));
  const int num_blocks = blocks[0] * blocks[1] * blocks[2];
  ParallelFor(static_cast<std::size_t>(num_blocks), [&](std::size_t b) {
    const int i = static_cast<int>(b);
    FillBlock(distance,
              grid,
              {i % blocks[0] * kBlockNodes,
               i / blocks[0] % blocks[1] * kBlockNodes,
               i / (blocks[0] * blocks[1]) * kBlockNodes});
  });
  return grid;
}

// Triangles of the grid's tetrahedra; one vertex for each grid edge that the surface crosses.
class Marcher {
 public:
  explicit Marcher(const Grid& grid) : grid_(grid), vertex_of_edge_(7 * grid.values.size(), -1) {}

  HalfMesh March() {
    for (int z = 0; z + 1 < grid_.size[2]; ++z) {
      for (int y = 0; y + 1 < grid_.size[1]; ++y) {
        for (int x = 0; x + 1 < grid_.size[0]; ++x) MarchCell({x, y, z});
      }
    }
    return std::move(mesh_);
  }

 private:
  struct Corner {
    std::array<int, 3> at;
    double value;
  };

  void MarchCell(std::array<int, 3> cell) {
    std::array<Corner, 8> corners;
    int inside = 0;
    for (unsigned c = 0; c < 8; ++c) {
      const std::array<int, 3> at = {cell[0] + static_cast<int>(c & 1U),
                                     cell[1] + static_cast<int>((c >> 1U) & 1U),
                                     cell[2] + static_cast<int>((c >> 2U) & 1U)};
      corners[c] = {at, grid_.values[grid_.Node(at[0], at[1], at[2])]};
      inside += corners[c].value < 0 ? 1 : 0;
    }
    if (inside == 0 || inside == 8) return;
    static constexpr std::array<std::array<unsigned, 2>, 6> kPaths = {
        {{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}}};
    for (const std::array<unsigned, 2>& path : kPaths) {
      MarchTetrahedron({corners[0], corners[path[0]], corners[path[1]], corners[7]});
    }
  }

  void MarchTetrahedron(const std::array<Corner, 4>& t) {
    std::array<Corner, 4> in;
    std::array<Corner, 4> out;
    std::size_t num_in = 0;
    std::size_t num_out = 0;
    for (const Corner& c : t) {
      if (c.value < 0) {
        in[num_in++] = c;
      } else {
        out[num_out++] = c;
      }
    }
    if (num_in == 0 || num_out == 0) return;
    Vec3d outward = Vec3d::Zero();
    for (std::size_t i = 0; i < num_out; ++i) outward += At(out[i]) / static_cast<double>(num_out);
    for (std::size_t i = 0; i < num_in; ++i) outward -= At(in[i]) / static_cast<double>(num_in);
    if (num_in == 2) {
      const int a = Vertex(in[0], out[0]);
      const int b = Vertex(in[0], out[1]);
      const int c = Vertex(in[1], out[1]);
      const int d = Vertex(in[1], out[0]);
      AddTriangle(a, b, c, outward);
      AddTriangle(a, c, d, outward);
    } else if (num_in == 1) {
      AddTriangle(Vertex(in[0], out[0]), Vertex(in[0], out[1]), Vertex(in[0], out[2]), outward);
    } else {
      AddTriangle(Vertex(in[0], out[0]), Vertex(in[1], out[0]), Vertex(in[2], out[0]), outward);
    }
  }

  [[nodiscard]] Vec3d At(const Corner& c) const {
    return grid_.Position(c.at[0], c.at[1], c.at[2]);
  }

  int Vertex(const Corner& inside, const Corner& outside) {
    const bool swapped = std::lexicographical_compare(
        outside.at.begin(), outside.at.end(), inside.at.begin(), inside.at.end());
    const Corner& low = swapped ? outside : inside;
    const Corner& high = swapped ? inside : outside;
    // Kuhn's edges go from a corner to one with larger or equal coordinates.
    std::size_t direction = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      direction |= static_cast<std::size_t>(high.at[k] - low.at[k]) << k;
    }
    int& vertex = vertex_of_edge_[7 * grid_.Node(low.at[0], low.at[1], low.at[2]) + direction - 1];
    if (vertex < 0) {
      vertex = static_cast<int>(mesh_.positions.size());
      // Kept off the nodes, so that no triangle is degenerate.
      const double t = std::clamp(low.value / (low.value - high.value), 0.05, 0.95);
      mesh_.positions.emplace_back(At(low) + t * (At(high) - At(low)));
      // Exactly in the plane, where the edge is.
      if (low.at[1] == 0 && high.at[1] == 0) mesh_.positions.back()[1] = 0;
    }
    return vertex;
  }

  void AddTriangle(int a, int b, int c, const Vec3d& outward) {
    const std::vector<Vec3d>& p = mesh_.positions;
    const auto at = [&](int i) -> const Vec3d& { return p[static_cast<std::size_t>(i)]; };
    if ((at(b) - at(a)).cross(at(c) - at(a)).dot(outward) < 0) std::swap(b, c);
    mesh_.triangles.push_back({a, b, c});
  }

  const Grid& grid_;
  std::vector<int> vertex_of_edge_;
  HalfMesh mesh_;
};

HalfMesh LargestPiece(const HalfMesh& mesh) {
  std::vector<int> root(mesh.positions.size());
  std::iota(root.begin(), root.end(), 0);
  auto find = [&](int v) {
    while (root[static_cast<std::size_t>(v)] != v) {
      int& up = root[static_cast<std::size_t>(v)];
      up = root[static_cast<std::size_t>(up)];
      v = up;
    }
    return v;
  };
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 1; k < 3; ++k) {
      const int a = find(t[0]);
      const int b = find(t[k]);
      root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
  }
  std::vector<int> count(mesh.positions.size(), 0);
  for (const Triangle& t : mesh.triangles) ++count[static_cast<std::size_t>(find(t[0]))];
  const int largest =
      static_cast<int>(std::max_element(count.begin(), count.end()) - count.begin());
  HalfMesh piece;
  std::vector<int> renumbered(mesh.positions.size(), -1);
  for (const Triangle& t : mesh.triangles) {
    if (find(t[0]) != largest) continue;
    Triangle out{};
    for (std::size_t k = 0; k < 3; ++k) {
      int& index = renumbered[static_cast<std::size_t>(t[k])];
      if (index < 0) {
        index = static_cast<int>(piece.positions.size());
        piece.positions.push_back(mesh.positions[static_cast<std::size_t>(t[k])]);
      }
      out[k] = index;
    }
    piece.triangles.push_back(out);
  }
  return piece;
}

}  // namespace

HalfMesh PolygonizeLeftHalf(const std::function<double(const Vec3d&)>& distance,
                            const Vec3d& low,
                            const Vec3d& high,
                            double spacing) {
  const Grid grid = Sample(distance, low, high, spacing);
  return LargestPiece(Marcher(grid).March());
}

}  // namespace dyxel
