#include "dyxel/mesh/given_atlas.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/mesh/test_meshes.h"
#include "dyxel/mesh/texel_grid.h"

namespace dyxel {
namespace {

// A ball, a tube open at both ends, a wavy sheet, and an edge that three triangles share.
TriangleMesh Wardrobe() {
  TriangleMesh mesh = MakeSphere({3, 0, 0}, 0.5F, 24);
  TriangleMesh tube = MakeTube(48, 40, 64).skin;
  for (Vec3f& x : tube.positions) x *= 0.3F;
  Append(mesh, tube);
  TriangleMesh sheet = MakeSquare(0, 1, 40);
  for (Vec3f& x : sheet.positions) x.z() = 0.05F * std::sin(8 * x.x()) + 2;
  Append(mesh, sheet);
  const int v = static_cast<int>(mesh.positions.size());
  for (const Vec3f& x :
       {Vec3f(5, 0, 0), Vec3f(5, 1, 0), Vec3f(6, 0, 0), Vec3f(4, 0, 0), Vec3f(5, 0, 1)}) {
    mesh.positions.push_back(x);
  }
  mesh.triangles.push_back({v, v + 2, v + 1});
  mesh.triangles.push_back({v, v + 1, v + 3});
  mesh.triangles.push_back({v, v + 1, v + 4});
  return mesh;
}

TEST(MakeGivenAtlasTest, OpenPiecesBecomeFlatChartsOfOneScaleWithGutters) {
  const TriangleMesh mesh = Wardrobe();
  const int size = 512;
  const Atlas atlas = MakeGivenAtlas(mesh.positions, mesh.triangles, {}, {.size = size});
  ASSERT_EQ(atlas.triangles.size(), mesh.triangles.size());
  EXPECT_TRUE(atlas.uv_ii.empty());
  double area = 0;
  double flat_area = 0;
  std::vector<double> ratios;
  for (std::size_t f = 0; f < atlas.triangles.size(); ++f) {
    std::array<Vec3f, 3> x;
    std::array<Vec2f, 3> uv;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto cut = static_cast<std::size_t>(atlas.triangles[f][c]);
      ASSERT_EQ(atlas.skin_vertex[cut], mesh.triangles[f][c]);
      x[c] = mesh.positions[static_cast<std::size_t>(mesh.triangles[f][c])];
      uv[c] = atlas.uv_i[cut];
      ASSERT_GE(uv[c].minCoeff(), 0);
      ASSERT_LE(uv[c].maxCoeff(), 1);
    }
    const double on_surface = 0.5 * static_cast<double>((x[1] - x[0]).cross(x[2] - x[0]).norm());
    const Vec2f ab = uv[1] - uv[0];
    const Vec2f ac = uv[2] - uv[0];
    const double flat = -0.5 * static_cast<double>(ab.x() * ac.y() - ab.y() * ac.x());
    ASSERT_GT(flat, 0) << f;  // unmirrored: v grows downwards
    area += on_surface;
    flat_area += flat;
    ratios.push_back(flat / on_surface);
  }
  for (double& ratio : ratios) ratio /= flat_area / area;
  std::sort(ratios.begin(), ratios.end());
  EXPECT_GT(ratios[ratios.size() / 100], 0.4);
  EXPECT_LT(ratios[ratios.size() * 99 / 100], 2.5);

  const AtlasQuality quality = MeasureAtlas(mesh.positions, atlas, atlas.uv_i);
  EXPECT_EQ(quality.flips, 0);
  EXPECT_EQ(quality.overlap, 0);
  EXPECT_LT(quality.stretch_l2, 1.1);
  EXPECT_GT(quality.fill, 0.35);

  const TexelGrid grid = MakeTexelGrid(atlas);
  const std::vector<int> chart = ChartOfTriangles(atlas);
  EXPECT_LE(*std::max_element(chart.begin(), chart.end()), 24);
  const auto chart_at = [&](int x, int y) {
    const int k = grid.texel_at[static_cast<std::size_t>(y * size + x)];
    return k < 0 ? -1 : chart[static_cast<std::size_t>(grid.triangle[static_cast<std::size_t>(k)])];
  };
  for (int y = 2; y + 2 < size; ++y) {
    for (int x = 2; x + 2 < size; ++x) {
      const int own = chart_at(x, y);
      if (own < 0) continue;
      for (int j = -2; j <= 2; ++j) {
        for (int i = -2; i <= 2; ++i) {
          const int other = chart_at(x + i, y + j);
          ASSERT_TRUE(other < 0 || other == own) << x << ", " << y;
        }
      }
    }
  }
}

TEST(MakeGivenAtlasTest, KeepsUsableCoordinatesAndReplacesOthers) {
  const TriangleMesh square = MakeSquare(0, 1, 4);
  std::vector<Vec2f> uv;
  for (const Vec3f& x : square.positions)
    uv.emplace_back(0.5F + 0.25F * x.x(), 0.5F - 0.25F * x.y());
  const Atlas kept = MakeGivenAtlas(square.positions, square.triangles, uv, {.size = 128});
  EXPECT_EQ(kept.uv_i, uv);
  EXPECT_EQ(kept.triangles, square.triangles);

  std::vector<Vec2f> folded = uv;  // the right half lies on the left
  for (Vec2f& p : folded) p.x() = 0.5F - std::abs(p.x() - 0.5F);
  EXPECT_FALSE(IsUsableParameterization(square.positions, square.triangles, folded, 128));
  std::vector<Vec2f> outside = uv;
  outside[3].x() = 1.2F;
  EXPECT_FALSE(IsUsableParameterization(square.positions, square.triangles, outside, 128));
  const Atlas made = MakeGivenAtlas(square.positions, square.triangles, folded, {.size = 128});
  const AtlasQuality quality = MeasureAtlas(square.positions, made, made.uv_i);
  EXPECT_EQ(quality.flips + quality.overlap, 0);
  EXPECT_NEAR(quality.stretch_l2, 1, 1e-3);  // a plane
  EXPECT_GT(quality.fill, 0.8);
}

TEST(MakeGivenAtlasTest, OptionsOfTheAtlasHold) {
  const TriangleMesh mesh = Wardrobe();
  const auto closest = [&](const Atlas& atlas) {  // texels between two charts, up to 12
    const TexelGrid grid = MakeTexelGrid(atlas);
    const std::vector<int> chart = ChartOfTriangles(atlas);
    int least = 12;
    for (const int pixel : grid.pixel) {
      const int x = pixel % atlas.size;
      const int y = pixel / atlas.size;
      const auto own = static_cast<std::size_t>(grid.texel_at[static_cast<std::size_t>(pixel)]);
      for (int j = 0; j < least && y + j < atlas.size; ++j) {
        for (int i = -least + 1; i < least; ++i) {
          if (x + i < 0 || x + i >= atlas.size) continue;
          const int other = grid.texel_at[static_cast<std::size_t>((y + j) * atlas.size + x + i)];
          if (other < 0 ||
              chart[static_cast<std::size_t>(grid.triangle[static_cast<std::size_t>(other)])] ==
                  chart[static_cast<std::size_t>(grid.triangle[own])]) {
            continue;
          }
          least = std::min(least, std::max(j, std::abs(i)));
        }
      }
    }
    return least;
  };
  const auto make = [&](const AtlasOptions& options) {
    return MakeGivenAtlas(mesh.positions, mesh.triangles, {}, options);
  };
  const auto charts = [](const Atlas& atlas) {
    const std::vector<int> chart = ChartOfTriangles(atlas);
    return *std::max_element(chart.begin(), chart.end()) + 1;
  };
  const Atlas narrow = make({.size = 256, .gutter = 3, .packing_trials = 0});
  const Atlas wide = make({.size = 256, .gutter = 10, .packing_trials = 0});
  EXPECT_LT(closest(narrow), 10);
  EXPECT_GE(closest(narrow), 3);
  EXPECT_GE(closest(wide), 10);
  EXPECT_LE(charts(make({.size = 256, .divide = false, .packing_trials = 0})), charts(narrow));
  EXPECT_THROW(static_cast<void>(make({.size = 8})), Error);
}

TEST(ReadPlyTextureCoordinatesTest, OfAnyNameTurnedOver) {
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("dyxel_uv_" + std::to_string(::getpid()) + ".ply");
  const auto write = [&](const std::string& first, const std::string& second) {
    WriteFile(path,
              "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
              "property float z\nproperty float " +
                  second + "\nproperty float " + first +
                  "\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
                  "0 0 0 0.25 0\n1 0 0 0.25 1\n0 1 0 1 0.5\n3 0 1 2\n");
    return ReadPlyTextureCoordinates(path);
  };
  const std::vector<Vec2f> expected = {{0, 0.75F}, {1, 0.75F}, {0.5F, 0}};
  EXPECT_EQ(write("s", "t"), expected);
  EXPECT_EQ(write("u", "v"), expected);
  EXPECT_EQ(write("texture_u", "texture_v"), expected);
  EXPECT_TRUE(write("s", "v").empty());
  WritePly(path, MakeSquare(0, 1, 2));
  EXPECT_TRUE(ReadPlyTextureCoordinates(path).empty());
  std::filesystem::remove(path);
}

TEST(MakeGivenAtlasTest, SurfaceWithoutAreaIsAnError) {
  const std::vector<Vec3f> positions(3, Vec3f::Zero());
  const std::vector<Triangle> triangles = {{0, 1, 2}};
  EXPECT_THROW(static_cast<void>(MakeGivenAtlas(positions, triangles)), Error);
}

}  // namespace
}  // namespace dyxel
