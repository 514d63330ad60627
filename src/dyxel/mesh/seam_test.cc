#include "dyxel/mesh/seam.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "dyxel/mesh/chart_cuts.h"
#include "dyxel/mesh/exposure.h"
#include "dyxel/mesh/test_meshes.h"
#include "dyxel/mesh/test_person.h"

namespace dyxel::internal {
namespace {

TEST(Exposure, IsOneOnASphereAndLessBetweenTheLegs) {
  const TriangleMesh sphere = MakeSphere(Vec3f(1, 2, 3), 0.5F, 24);
  for (const float e : Exposure(sphere.positions, sphere.triangles)) EXPECT_GT(e, 0.97F);

  const TriangleMesh person = MakeTestPerson(0.025F);
  const std::vector<float> exposure = Exposure(person.positions, person.triangles);
  double inner = 0, outer = 0;
  int num_inner = 0, num_outer = 0;
  for (std::size_t v = 0; v < exposure.size(); ++v) {
    const Vec3f& p = person.positions[v];
    if (p.z() < 0.6F || p.z() > 0.8F) continue;
    (std::abs(p.x()) < 0.08F ? inner : outer) += static_cast<double>(exposure[v]);
    ++(std::abs(p.x()) < 0.08F ? num_inner : num_outer);
  }
  EXPECT_LT(inner / num_inner, 0.75 * outer / num_outer);
}

TEST(FindExtremities, FindsHeadHandsAndFeet) {
  const TriangleMesh person = MakeTestPerson(0.025F);
  const VertexGraph graph =
      MakeVertexGraph(person.triangles, static_cast<int>(person.positions.size()));
  const std::vector<Extremity> found = FindExtremities(graph, EdgeLengths(graph, person.positions));
  ASSERT_GE(found.size(), 5U);
  std::multiset<int> kinds;
  for (int i = 0; i < 5; ++i) {
    EXPECT_GT(found[i].prominence, 0.15F);
    const Vec3f& p = person.positions[found[i].vertex];
    const int side = p.x() < 0 ? 0 : 1;
    kinds.insert(p.z() > 1.6F ? 4 : (p.z() < 0.1F ? side : (p.z() < 1 ? 2 + side : 9)));
  }
  EXPECT_EQ(kinds, (std::multiset<int>{0, 1, 2, 3, 4}));
  ASSERT_GT(found.size(), 5U);
  EXPECT_LT(found[5].prominence, 0.1F);
}

TEST(JoinInduced, MakesATreeWithoutShortcuts) {
  const TriangleMesh person = MakeTestPerson(0.025F);
  const int n = static_cast<int>(person.positions.size());
  const VertexGraph graph = MakeVertexGraph(person.triangles, n);
  const std::vector<float> length = EdgeLengths(graph, person.positions);
  std::vector<int> ends;
  for (const Extremity& e : FindExtremities(graph, length)) {
    if (e.prominence > 0.1F) ends.push_back(e.vertex);
  }
  const Seam seam = JoinInduced(graph, length, ends);
  EXPECT_EQ(seam.terminals.size(), ends.size());
  std::set<int> on;
  std::set<std::pair<int, int>> edges;
  for (const auto& edge : seam.edges) {
    on.insert(edge.begin(), edge.end());
    edges.insert(std::minmax(edge[0], edge[1]));
  }
  for (const int t : seam.terminals) EXPECT_TRUE(on.count(t));
  // Connected and without a cycle: cutting along it leaves a disk, which DiskBoundary checks.
  EXPECT_EQ(seam.edges.size() + 1, on.size());
  const std::vector<int> twins = FindTwins(person.triangles, n);
  std::vector<char> cut(twins.size(), 0);
  MarkCut(person.triangles, twins, graph, seam.edges, cut);
  const CutMesh disk = CutOpen(person.triangles, twins, cut, n);
  const std::vector<int> border =
      DiskBoundary(disk.triangles, static_cast<int>(disk.vertex.size()));
  EXPECT_EQ(border.size(), 2 * seam.edges.size());
  // Induced: every mesh edge between two of its vertices is its own.
  for (const int v : on) {
    for (const int w : graph.Of(v)) {
      EXPECT_EQ(on.count(w), edges.count(std::minmax(v, w))) << v << " " << w;
    }
  }
}

}  // namespace
}  // namespace dyxel::internal
