// Polygonizing and remeshing a ball and a ring, whose size and topology are known.
#include "dyxel/body/remesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <gtest/gtest.h>

namespace dyxel {
namespace {

std::size_t At(int i) { return static_cast<std::size_t>(i); }

constexpr double kRadius = 0.1;

double Ball(const Vec3d& x) { return x.norm() - kRadius; }

// In the plane y = 0.13, wholly inside the half space.
double Ring(const Vec3d& x) {
  const double r = std::hypot(x[0], x[2]) - 0.1;
  return std::hypot(r, x[1] - 0.13) - 0.03;
}

struct Topology {
  long euler = 0;
  long border_edges = 0;
  bool manifold = true;
};

Topology TopologyOf(const HalfMesh& mesh) {
  std::map<std::pair<int, int>, int> half_edges;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++half_edges[{t[k], t[(k + 1) % 3]}];
  }
  Topology topology;
  long edges = 0;
  for (const auto& [edge, count] : half_edges) {
    topology.manifold = topology.manifold && count == 1;
    const bool two_sided = half_edges.contains({edge.second, edge.first});
    if (!two_sided) {
      ++topology.border_edges;
      const bool in_plane =
          mesh.positions[At(edge.first)][1] == 0 && mesh.positions[At(edge.second)][1] == 0;
      topology.manifold = topology.manifold && in_plane;
    }
    edges += two_sided ? 1 : 2;
  }
  topology.euler = static_cast<long>(mesh.positions.size()) - edges / 2 +
                   static_cast<long>(mesh.triangles.size());
  return topology;
}

double Area(const HalfMesh& mesh) {
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3d& a = mesh.positions[At(t[0])];
    area += 0.5 * (mesh.positions[At(t[1])] - a).cross(mesh.positions[At(t[2])] - a).norm();
  }
  return area;
}

HalfMesh RoughBall() {
  return PolygonizeLeftHalf(Ball, {-0.13, 0, -0.13}, {0.13, 0.13, 0.13}, 0.009);
}

TEST(Polygonize, HalfABallIsADisc) {
  const HalfMesh mesh = RoughBall();
  const Topology topology = TopologyOf(mesh);
  EXPECT_TRUE(topology.manifold);
  EXPECT_EQ(topology.euler, 1);
  EXPECT_GT(topology.border_edges, 40);
  EXPECT_NEAR(Area(mesh), 2 * kPiD * kRadius * kRadius, 0.02 * 2 * kPiD * kRadius * kRadius);
  for (const Triangle& t : mesh.triangles) {  // seen from outside
    const Vec3d& a = mesh.positions[At(t[0])];
    EXPECT_GT((mesh.positions[At(t[1])] - a).cross(mesh.positions[At(t[2])] - a).dot(a), 0);
  }
}

TEST(Polygonize, ARingHasAHoleAndTheLargestPieceStays) {
  auto ring_and_crumb = [](const Vec3d& x) {
    return std::min(Ring(x), (x - Vec3d(0, 0.13, 0)).norm() - 0.02);
  };
  const Topology topology =
      TopologyOf(PolygonizeLeftHalf(ring_and_crumb, {-0.15, 0, -0.15}, {0.15, 0.18, 0.15}, 0.008));
  EXPECT_TRUE(topology.manifold);
  EXPECT_EQ(topology.border_edges, 0);
  EXPECT_EQ(topology.euler, 0);
}

TEST(Remesh, TrianglesGetTheWantedSizeOnTheSurface) {
  for (const double wanted : {0.006, 0.012}) {
    RemeshProblem problem;
    problem.edge_length = [&](const Vec3d&) { return wanted; };
    problem.project = [](const Vec3d& x, bool) { return Vec3d(kRadius * x.normalized()); };
    const HalfMesh mesh = Remesh(RoughBall(), problem);
    const Topology topology = TopologyOf(mesh);
    EXPECT_TRUE(topology.manifold);
    EXPECT_EQ(topology.euler, 1);
    double mean = 0;
    double least_angle = kPiD;
    for (const Triangle& t : mesh.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d& a = mesh.positions[At(t[k])];
        const Vec3d ab = mesh.positions[At(t[(k + 1) % 3])] - a;
        const Vec3d ac = mesh.positions[At(t[(k + 2) % 3])] - a;
        mean += ab.norm();
        EXPECT_LT(ab.norm(), 1.7 * wanted);
        EXPECT_GT(ab.norm(), 0.4 * wanted);
        least_angle = std::min(least_angle, std::acos(ab.normalized().dot(ac.normalized())));
      }
    }
    EXPECT_NEAR(mean / (3 * static_cast<double>(mesh.triangles.size())), wanted, 0.12 * wanted);
    EXPECT_GT(least_angle * 180 / kPiD, 25);
    for (const Vec3d& x : mesh.positions) {
      EXPECT_NEAR(x.norm(), kRadius, 1e-5);
      EXPECT_GE(x[1], 0);
    }
  }
}

}  // namespace
}  // namespace dyxel
