#include "dyxel/mesh/closed_atlas.h"

#include <cmath>
#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/parallel.h"
#include "dyxel/mesh/half_edges.h"
#include "dyxel/mesh/test_meshes.h"
#include "dyxel/mesh/test_person.h"

namespace dyxel {
namespace {

using ::testing::HasSubstr;

// What every atlas of a closed skin promises.
void ExpectSound(const TriangleMesh& skin, const Atlas& atlas) {
  const std::size_t num_cut = atlas.skin_vertex.size();
  ASSERT_EQ(atlas.triangles.size(), skin.triangles.size());
  ASSERT_EQ(atlas.uv_i.size(), num_cut);
  ASSERT_EQ(atlas.uv_ii.size(), num_cut);
  ASSERT_GT(num_cut, skin.positions.size());
  for (std::size_t v = 0; v < skin.positions.size(); ++v) {
    ASSERT_EQ(atlas.skin_vertex[v], static_cast<int>(v));
  }
  for (std::size_t f = 0; f < skin.triangles.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      ASSERT_EQ(atlas.skin_vertex[atlas.triangles[f][k]], skin.triangles[f][k]);
    }
  }
  for (const Vec2f& uv : atlas.uv_i) {
    ASSERT_GE(uv.minCoeff() * static_cast<float>(atlas.size), 1.9F);
    ASSERT_LE(uv.maxCoeff() * static_cast<float>(atlas.size),
              static_cast<float>(atlas.size) - 1.9F);
  }
  for (const auto* uv : {&atlas.uv_i, &atlas.uv_ii}) {
    const AtlasQuality quality = MeasureAtlas(skin.positions, atlas, *uv);
    EXPECT_EQ(quality.flips, 0);
    EXPECT_EQ(quality.overlap, 0);
    // Seen from outside it is not mirrored in an image whose v points down.
    const Triangle& t = atlas.triangles[0];
    const Vec2f a = (*uv)[t[1]] - (*uv)[t[0]], b = (*uv)[t[2]] - (*uv)[t[0]];
    EXPECT_LT(a.x() * b.y() - a.y() * b.x(), 0);
  }
  EXPECT_GT(MeasureAtlas(skin.positions, atlas, atlas.uv_ii).fill, 0.9999);

  // II by its own topology: cut vertices that share a skin vertex and uv_ii are one. It is a disk
  // whose border lies on the square's, in order.
  std::vector<int> one_of(num_cut);
  std::vector<int> names;
  for (std::size_t c = 0; c < num_cut; ++c) {
    one_of[c] = static_cast<int>(c);
    for (std::size_t d = skin.positions.size(); d < c; ++d) {
      if (atlas.skin_vertex[d] == atlas.skin_vertex[c] && atlas.uv_ii[d] == atlas.uv_ii[c]) {
        one_of[c] = one_of[d];
      }
    }
    const int first = atlas.skin_vertex[c];
    if (c >= skin.positions.size() && atlas.uv_ii[first] == atlas.uv_ii[c]) one_of[c] = first;
  }
  std::vector<int> index(num_cut, -1);
  std::vector<Vec2f> uv;
  std::vector<Triangle> triangles = atlas.triangles;
  for (Triangle& t : triangles) {
    for (int& c : t) {
      int& name = index[one_of[c]];
      if (name < 0) {
        name = static_cast<int>(uv.size());
        uv.push_back(atlas.uv_ii[c]);
      }
      c = name;
    }
  }
  double way_round = 0;
  int wraps = 0;
  const std::vector<int> border = internal::DiskBoundary(triangles, static_cast<int>(uv.size()));
  const auto way = [&](const Vec2f& p) {
    const double x = p.x(), y = 1.0 - p.y();
    EXPECT_EQ(std::min({x, y, 1 - x, 1 - y}), 0);
    return y == 0 ? x : (x == 1 ? 1 + y : (y == 1 ? 3 - x : 4 - y));
  };
  for (std::size_t i = 0; i < border.size(); ++i) {
    const double step = way(uv[border[(i + 1) % border.size()]]) - way(uv[border[i]]);
    wraps += step > 0 ? 0 : 1;
    way_round += std::abs(step);
  }
  EXPECT_EQ(wraps, 1);
  EXPECT_NEAR(way_round, 8, 0.5);  // 4 and the wrap
}

std::string MessageOf(const std::function<void()>& f) {
  try {
    f();
  } catch (const Error& e) {
    EXPECT_EQ(e.fault(), Fault::kInput);
    return e.what();
  }
  return "nothing was thrown";
}

TEST(MakeClosedAtlas, MapsASphere) {
  const TriangleMesh sphere = MakeSphere(Vec3f(0, 1, 0), 0.4F, 30);
  const Atlas atlas = MakeClosedAtlas(sphere.positions, sphere.triangles, {.size = 256});
  ExpectSound(sphere, atlas);
}

TEST(MakeClosedAtlas, ReachesTheBarsOnAPerson) {
  const TriangleMesh person = MakeTestPerson(0.02F);
  const Atlas atlas = MakeClosedAtlas(person.positions, person.triangles);
  ExpectSound(person, atlas);
  const AtlasQuality quality = MeasureAtlas(person.positions, atlas, atlas.uv_i);
  EXPECT_LT(quality.stretch_l2, 1.1);
  EXPECT_GT(quality.fill, 0.55);
}

TEST(MakeClosedAtlas, MapsAPersonAsOneChartWherePossible) {
  const TriangleMesh person = MakeTestPerson(0.03F);
  ExpectSound(person, MakeClosedAtlas(person.positions, person.triangles, {.divide = false}));
}

TEST(MakeClosedAtlas, DoesNotDependOnThreads) {
  const TriangleMesh person = MakeTestPerson(0.03F);
  const Atlas many = MakeClosedAtlas(person.positions, person.triangles);
  SetJobs(1);
  const Atlas one = MakeClosedAtlas(person.positions, person.triangles);
  SetJobs(0);
  EXPECT_EQ(many.skin_vertex, one.skin_vertex);
  EXPECT_EQ(many.uv_i, one.uv_i);
  EXPECT_EQ(many.uv_ii, one.uv_ii);
}

TEST(MakeClosedAtlas, RefusesOtherSurfaces) {
  // A torus.
  constexpr int kN = 20;
  TriangleMesh torus;
  for (int i = 0; i < kN * kN; ++i) {
    const float a = 2 * kPi * static_cast<float>(i / kN) / kN;
    const float b = 2 * kPi * static_cast<float>(i % kN) / kN;
    const float r = 1 + 0.3F * std::cos(b);
    torus.positions.emplace_back(r * std::cos(a), r * std::sin(a), 0.3F * std::sin(b));
    const auto at = [&](int di, int dj) { return (i / kN + di) % kN * kN + (i % kN + dj) % kN; };
    torus.triangles.push_back({at(0, 0), at(1, 0), at(1, 1)});
    torus.triangles.push_back({at(0, 0), at(1, 1), at(0, 1)});
  }
  EXPECT_THAT(MessageOf([&] { (void)MakeClosedAtlas(torus.positions, torus.triangles); }),
              HasSubstr("1 handles"));

  TriangleMesh sphere = MakeSphere(Vec3f::Zero(), 1, 8);
  const Triangle last = sphere.triangles.back();
  sphere.triangles.pop_back();
  EXPECT_THAT(MessageOf([&] { (void)MakeClosedAtlas(sphere.positions, sphere.triangles); }),
              HasSubstr("open: 3 of its edges"));
  sphere.triangles.push_back({last[0], last[2], last[1]});
  EXPECT_THAT(MessageOf([&] { (void)MakeClosedAtlas(sphere.positions, sphere.triangles); }),
              HasSubstr("disagree about the outside"));
  sphere.triangles.back() = last;
  sphere.positions.emplace_back(5, 5, 5);
  EXPECT_THAT(MessageOf([&] { (void)MakeClosedAtlas(sphere.positions, sphere.triangles); }),
              HasSubstr("unused"));
  sphere.positions.pop_back();
  const std::size_t num_vertices = sphere.positions.size(), num_triangles = sphere.triangles.size();
  for (std::size_t v = 0; v < num_vertices; ++v) {
    sphere.positions.emplace_back(sphere.positions[v] + Vec3f(3, 0, 0));
  }
  for (std::size_t f = 0; f < num_triangles; ++f) {
    Triangle t = sphere.triangles[f];
    for (int& v : t) v += static_cast<int>(num_vertices);
    sphere.triangles.push_back(t);
  }
  EXPECT_THAT(MessageOf([&] { (void)MakeClosedAtlas(sphere.positions, sphere.triangles); }),
              HasSubstr("2 pieces"));
}

// A unit square of two triangles and a map of it.
AtlasQuality MeasureSquare(const std::vector<Vec2f>& uv, std::vector<Triangle> triangles) {
  const std::vector<Vec3f> positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  Atlas atlas;
  atlas.skin_vertex = {0, 1, 2, 3};
  atlas.triangles = std::move(triangles);
  atlas.uv_i = uv;
  atlas.size = 64;
  return MeasureAtlas(positions, atlas, uv);
}

TEST(MeasureAtlas, MeasuresAKnownStretch) {
  // By 1/2 and 1/4: singular values 2 and 4, so L2² = 10, times the area 1/8.
  const AtlasQuality q =
      MeasureSquare({{0, 0}, {0.5F, 0}, {0.5F, 0.25F}, {0, 0.25F}}, {{0, 1, 2}, {0, 2, 3}});
  EXPECT_EQ(q.flips, 0);
  EXPECT_EQ(q.overlap, 0);
  EXPECT_NEAR(q.stretch_l2, std::sqrt(10.0 / 8), 1e-9);
  EXPECT_NEAR(q.stretch_linf, 4 * std::sqrt(1.0 / 8), 1e-9);
  EXPECT_NEAR(q.fill, 0.125, 1e-9);
}

TEST(MeasureAtlas, IsOneForASimilarity) {
  const Eigen::Rotation2Df turn(0.3F);
  std::vector<Vec2f> uv;
  for (const Vec2f& p : {Vec2f(0, 0), Vec2f(1, 0), Vec2f(1, 1), Vec2f(0, 1)}) {
    uv.emplace_back(turn * p * 0.4F + Vec2f(0.4F, 0.2F));
  }
  const AtlasQuality q = MeasureSquare(uv, {{0, 1, 2}, {0, 2, 3}});
  EXPECT_NEAR(q.stretch_l2, 1, 1e-6);
  EXPECT_NEAR(q.stretch_linf, 1, 1e-6);
}

TEST(MeasureAtlas, CountsFlipsAndOverlaps) {
  // The second triangle folded over onto the first.
  const AtlasQuality q =
      MeasureSquare({{0, 0}, {0.5F, 0}, {0.5F, 0.5F}, {0.5F, 0.1F}}, {{0, 1, 2}, {0, 2, 3}});
  EXPECT_EQ(q.flips, 1);
  EXPECT_GT(q.overlap, 300);
  EXPECT_EQ(MeasureSquare({{0, 0}, {1, 0}, {1, 1}, {0.5F, 0.5F}}, {{0, 1, 2}, {0, 2, 3}}).flips, 1);
}

}  // namespace
}  // namespace dyxel
