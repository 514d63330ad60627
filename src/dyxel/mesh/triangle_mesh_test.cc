#include "dyxel/mesh/triangle_mesh.h"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/mesh/adjacency.h"
#include "dyxel/mesh/surface.h"
#include "dyxel/mesh/test_meshes.h"

namespace dyxel {
namespace {

TEST(VertexNormalsTest, PointOutwardsOnASphere) {
  const TriangleMesh sphere = MakeSphere({1, 2, 3}, 0.5F, 32);
  const std::vector<Vec3f> normals = VertexNormals(sphere.positions, sphere.triangles);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    EXPECT_GT(normals[v].dot(sphere.positions[v] - Vec3f(1, 2, 3)) / 0.5F, 0.999F);
    EXPECT_NEAR(normals[v].norm(), 1, 1e-5);
  }
}

TEST(SmoothPositionsTest, HalvesTheWayToTheMeanOfTheNeighbours) {
  // A hexagonal fan whose centre stands out by 1: after a round by 1/2.
  TriangleMesh fan;
  fan.positions.emplace_back(0.0F, 0.0F, 1.0F);
  for (int i = 0; i < 6; ++i) {
    const float angle = kPi / 3 * static_cast<float>(i);
    fan.positions.emplace_back(std::cos(angle), std::sin(angle), 0.0F);
    fan.triangles.push_back({0, 1 + i, 1 + (i + 1) % 6});
  }
  const std::vector<Vec3f> smooth = SmoothPositions(fan.positions, fan.triangles, 1);
  EXPECT_NEAR(smooth[0].z(), 0.5F, 1e-6);
  EXPECT_NEAR(smooth[1].z(), 0.5F / 3, 1e-6);  // two neighbours on the rim, and the centre
  const std::vector<Vec3f> same = SmoothPositions(fan.positions, fan.triangles, 0);
  EXPECT_EQ(same[0], fan.positions[0]);
}

TEST(AdjacencyTest, HalfEdgesOfAClosedSurfaceAreMutual) {
  const TriangleMesh sphere = MakeSphere(Vec3f::Zero(), 1, 8);
  const auto opposite =
      OppositeHalfEdges(sphere.triangles, static_cast<int>(sphere.positions.size()));
  for (std::size_t f = 0; f < opposite.size(); ++f) {
    for (std::size_t e = 0; e < 3; ++e) {
      const int other = opposite[f][e];
      ASSERT_GE(other, 0);
      const auto g = static_cast<std::size_t>(other / 3);
      const auto h = static_cast<std::size_t>(other % 3);
      EXPECT_EQ(opposite[g][h], static_cast<int>(3 * f + e));
      EXPECT_EQ(sphere.triangles[f][e], sphere.triangles[g][(h + 1) % 3]);
    }
  }
  const TriangleMesh square = MakeSquare(0, 1, 1);
  EXPECT_THAT(OppositeHalfEdges(square.triangles, 4),
              testing::ElementsAre(std::array{-1, -1, 3}, std::array{2, -1, -1}));
}

TEST(PoseSurfaceTest, TubeHasItsTangentsAroundAndItsBitangentsUp) {
  const Tube tube = MakeTube(64, 8, 64);
  const PosedSurface surface = PoseSurface(tube.atlas, tube.skin.triangles, tube.skin.positions);
  ASSERT_EQ(surface.positions.size(), tube.atlas.skin_vertex.size());
  for (std::size_t c = 0; c < surface.positions.size(); ++c) {
    const Vec3f radial(surface.positions[c].x(), surface.positions[c].y(), 0);
    const Vec3f around(-radial.y(), radial.x(), 0);
    EXPECT_GT(surface.normals[c].dot(radial), 0.999F);
    EXPECT_GT(surface.tangents[c].dot(around), 0.998F);
    EXPECT_EQ(surface.handedness[c], 1.0F);
  }
  const Mat3f frame = TangentFrame(surface, tube.atlas.triangles[5], {0.2F, 0.3F, 0.5F});
  EXPECT_TRUE((frame.transpose() * frame).isIdentity(1e-5F));
  EXPECT_GT(frame(2, 1), 0.99F);
  EXPECT_NEAR(frame.determinant(), 1, 1e-5);
}

TEST(PoseSurfaceTest, MirroredAtlasHasTheOtherHand) {
  Tube tube = MakeTube(16, 4, 64);
  for (Vec2f& uv : tube.atlas.uv_i) uv.x() = 1 - uv.x();
  const PosedSurface surface = PoseSurface(tube.atlas, tube.skin.triangles, tube.skin.positions);
  const Mat3f frame = TangentFrame(surface, tube.atlas.triangles[5], {0.2F, 0.3F, 0.5F});
  EXPECT_GT(frame(2, 1), 0.99F);  // still up
  EXPECT_NEAR(frame.determinant(), -1, 1e-5);
}

class PlyTest : public testing::Test {
 protected:
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() /
      (std::string("dyxel_ply_") + testing::UnitTest::GetInstance()->current_test_info()->name() +
       ".ply");
  ~PlyTest() override { std::filesystem::remove(path_); }
};

TEST_F(PlyTest, ComesBackAsWritten) {
  const TriangleMesh mesh = MakeSphere({1, 2, 3}, 0.5F, 6);
  WritePly(path_, mesh);
  const TriangleMesh back = ReadPly(path_);
  EXPECT_EQ(back.triangles, mesh.triangles);
  EXPECT_EQ(back.positions, mesh.positions);
}

TEST_F(PlyTest, ReadsAsciiQuadsAndFurtherProperties) {
  WriteFile(path_,
            "ply\r\nformat ascii 1.0\r\ncomment hello\nelement vertex 4\nproperty double x\n"
            "property float s\nproperty float y\nproperty float z\nproperty uchar red\n"
            "element face 1\nproperty list uchar uint vertex_index\nend_header\n"
            "0 0.5 0 0 255\n1 0.25 0 0 1\n1 0 1e0 0 2\n0 1 +1 -0.5 3\n4 0 1 2 3\n");
  const TriangleMesh mesh = ReadPly(path_);
  EXPECT_THAT(mesh.triangles, testing::ElementsAre(Triangle{0, 1, 2}, Triangle{0, 2, 3}));
  EXPECT_EQ(mesh.positions[3], Vec3f(0, 1, -0.5F));
  const std::vector<std::string> names = {"red", "s"};
  const auto values = ReadPlyVertexProperties(path_, names);
  ASSERT_EQ(values.size(), 2U);
  EXPECT_THAT(values[0], testing::ElementsAre(255, 1, 2, 3));
  EXPECT_THAT(values[1], testing::ElementsAre(0.5, 0.25, 0, 1));
  const std::vector<std::string> absent = {"s", "t"};
  EXPECT_TRUE(ReadPlyVertexProperties(path_, absent).empty());
}

TEST_F(PlyTest, EveryTruncationIsAnErrorThatNamesTheFile) {
  WritePly(path_, MakeSquare(0, 1, 2));
  const std::string bytes = ReadFile(path_);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    WriteFile(path_, bytes.substr(0, length));
    try {
      static_cast<void>(ReadPly(path_));
      ADD_FAILURE() << "read " << length << " of " << bytes.size() << " bytes";
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::kInput);
      EXPECT_THAT(error.what(), testing::HasSubstr(path_.filename().string()));
    }
  }
}

TEST_F(PlyTest, FlippedBytesNeverCrash) {
  WritePly(path_, MakeSquare(0, 1, 2));
  const std::string bytes = ReadFile(path_);
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (const int flip : {0x01, 0x80, 0xff}) {
      std::string damaged = bytes;
      damaged[at] = static_cast<char>(damaged[at] ^ flip);
      WriteFile(path_, damaged);
      try {
        const TriangleMesh mesh = ReadPly(path_);
        for (const Triangle& t : mesh.triangles) {
          for (const int v : t) {
            ASSERT_GE(v, 0);
            ASSERT_LT(v, static_cast<int>(mesh.positions.size()));
          }
        }
      } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::kInput);
      }
    }
  }
}

}  // namespace
}  // namespace dyxel
