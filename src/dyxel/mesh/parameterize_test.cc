#include "dyxel/mesh/parameterize.h"

#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/mesh/flatten.h"
#include "dyxel/mesh/half_edges.h"
#include "dyxel/mesh/triangle_mesh.h"

namespace dyxel::internal {
namespace {

// An m × n grid of cells over [0, 1]², bent by `shape`.
template <class Shape>
TriangleMesh MakePatch(int m, int n, const Shape& shape) {
  TriangleMesh mesh;
  for (int y = 0; y <= n; ++y) {
    for (int x = 0; x <= m; ++x) {
      mesh.positions.push_back(shape(static_cast<float>(x) / static_cast<float>(m),
                                     static_cast<float>(y) / static_cast<float>(n)));
    }
  }
  const auto at = [&](int x, int y) { return y * (m + 1) + x; };
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < m; ++x) {
      // Diagonals to the middle, so that no corner is an ear.
      if ((x < m / 2) == (y < n / 2)) {
        mesh.triangles.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
        mesh.triangles.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
      } else {
        mesh.triangles.push_back({at(x, y), at(x + 1, y), at(x, y + 1)});
        mesh.triangles.push_back({at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)});
      }
    }
  }
  return mesh;
}

FlatMesh MakeFlat(const TriangleMesh& mesh, std::vector<Vec2d> uv) {
  FlatMesh flat{mesh.triangles, {}, std::move(uv)};
  for (const Triangle& t : mesh.triangles) {
    flat.rest.push_back(MakeRestTriangle(mesh.positions[t[0]].cast<double>(),
                                         mesh.positions[t[1]].cast<double>(),
                                         mesh.positions[t[2]].cast<double>()));
  }
  return flat;
}

double MeanEnergy(const FlatMesh& flat) {
  double area = 0;
  for (const RestTriangle& rest : flat.rest) area += rest.area;
  return TotalEnergy(flat) / area;
}

TEST(QuasiHarmonicMap, ReproducesAnAffineMapFromItsBorder) {
  const TriangleMesh mesh = MakePatch(9, 7, [](float x, float y) { return Vec3f(2 * x, y, 0); });
  std::vector<Vec2d> truth, uv;
  std::vector<char> fixed(mesh.positions.size(), 0);
  for (const Vec3f& p : mesh.positions) {
    truth.emplace_back(0.5 * p.x() + 0.2 * p.y(), p.y() - 0.1 * p.x());
  }
  uv.assign(truth.size(), Vec2d::Zero());
  for (const int v : DiskBoundary(mesh.triangles, static_cast<int>(truth.size()))) {
    fixed[v] = 1;
    uv[v] = truth[v];
  }
  FlatMesh flat = MakeFlat(mesh, uv);
  ASSERT_TRUE(QuasiHarmonicMap(flat, fixed));
  for (std::size_t v = 0; v < truth.size(); ++v) EXPECT_LT((flat.uv[v] - truth[v]).norm(), 1e-9);
}

TEST(QuasiHarmonicMap, DistortsLessThanTheHarmonicMap) {
  // A hill: harmonic maps crowd its top.
  const TriangleMesh mesh = MakePatch(24, 24, [](float x, float y) {
    const float r = (x - 0.5F) * (x - 0.5F) + (y - 0.5F) * (y - 0.5F);
    return Vec3f(x, y, 0.6F * std::exp(-20 * r));
  });
  std::vector<Vec2d> uv;
  for (const Vec3f& p : mesh.positions) uv.emplace_back(p.x(), p.y());
  std::vector<char> fixed(uv.size(), 0);
  for (const int v : DiskBoundary(mesh.triangles, static_cast<int>(uv.size()))) fixed[v] = 1;
  FlatMesh harmonic = MakeFlat(mesh, uv), settled = harmonic;
  ASSERT_TRUE(QuasiHarmonicMap(harmonic, fixed, 1));
  ASSERT_TRUE(QuasiHarmonicMap(settled, fixed));
  EXPECT_LT(MeanEnergy(settled), 0.97 * MeanEnergy(harmonic));
}

TEST(DescendNewton, FindsTheIsometryOfAFlatPatch) {
  const TriangleMesh mesh = MakePatch(10, 6, [](float x, float y) { return Vec3f(x, y, x); });
  std::vector<Vec2d> uv;
  const std::vector<int> border =
      DiskBoundary(mesh.triangles, static_cast<int>(mesh.positions.size()));
  uv.assign(mesh.positions.size(), Vec2d::Zero());
  std::vector<char> fixed(uv.size(), 0);
  for (std::size_t i = 0; i < border.size(); ++i) {
    const double angle = 2 * kPiD * static_cast<double>(i) / static_cast<double>(border.size());
    uv[border[i]] = {std::cos(angle), std::sin(angle)};
    fixed[border[i]] = 1;
  }
  FlatMesh flat = MakeFlat(mesh, uv);
  TutteEmbedding(flat, fixed);
  EXPECT_EQ(CountFlips(flat), 0);
  DescendNewton(flat, Freedom(uv.size(), 3), 100, 1e-10);
  EXPECT_NEAR(MeanEnergy(flat), 4, 1e-6);
}

TEST(FlattenFree, LaysDevelopableSurfacesOutIsometrically) {
  // Most of a cylinder, and of a cone, cut along a line.
  const TriangleMesh cylinder = MakePatch(60, 60, [](float x, float y) {
    return Vec3f(0.2F * std::cos(6 * x), 0.2F * std::sin(6 * x), y);
  });
  const TriangleMesh cone = MakePatch(60, 60, [](float x, float y) {
    const float r = 0.1F + 0.4F * y;
    return Vec3f(r * std::cos(5 * x), r * std::sin(5 * x), 1.5F * r);
  });
  for (const TriangleMesh* mesh : {&cylinder, &cone}) {
    const std::vector<Vec2d> uv = FlattenFree(mesh->positions, mesh->triangles).uv;
    const FlatMesh flat = MakeFlat(*mesh, uv);
    EXPECT_EQ(CountFlips(flat), 0);
    EXPECT_NEAR(MeanEnergy(flat), 4, 0.002);
  }
}

TEST(FlattenToSquare, PutsTheBorderOnTheSquareInOrder) {
  const TriangleMesh mesh = MakePatch(40, 70, [](float x, float y) {
    return Vec3f(x, 1.5F * y, 0.3F * std::sin(4 * x) * std::cos(3 * y));
  });
  const std::vector<Vec2d> uv = FlattenToSquare(mesh.positions, mesh.triangles);
  EXPECT_EQ(CountFlips(MakeFlat(mesh, uv)), 0);
  // Along the border the way round the square grows from vertex to vertex.
  std::vector<double> way;
  for (const int v : DiskBoundary(mesh.triangles, static_cast<int>(uv.size()))) {
    const Vec2d& p = uv[v];
    const double inset = std::min({p.x(), p.y(), 1 - p.x(), 1 - p.y()});
    EXPECT_EQ(inset, 0) << p.transpose();
    way.push_back(p.y() == 0 ? p.x() : p.x() == 1 ? 1 + p.y() : p.y() == 1 ? 3 - p.x() : 4 - p.y());
  }
  int wraps = 0;
  for (std::size_t i = 0; i < way.size(); ++i) wraps += way[(i + 1) % way.size()] > way[i] ? 0 : 1;
  EXPECT_EQ(wraps, 1);
}

}  // namespace
}  // namespace dyxel::internal
