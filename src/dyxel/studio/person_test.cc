#include "dyxel/studio/person.h"

#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "dyxel/studio/surface_nets.h"

namespace dyxel::studio {
namespace {

// Every edge once in each direction.
bool IsClosed(const std::vector<Triangle>& triangles) {
  std::map<std::pair<int, int>, int> edges;
  for (const Triangle& t : triangles) {
    for (std::size_t c = 0; c < 3; ++c) ++edges[{t[c], t[(c + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    if (back == edges.end() || back->second != count) return false;
  }
  return true;
}

bool OutermostIsSkin(const CoverDistances& d) {
  for (std::size_t c = 1; c < kNumCovers; ++c) {
    if (d[c] < d[kSkin]) return false;
  }
  return true;
}

double Volume(const std::vector<Vec3f>& p, const std::vector<Triangle>& triangles) {
  double volume = 0;
  for (const Triangle& t : triangles) {
    const auto at = [&](std::size_t c) {
      return Vec3d(p[static_cast<std::size_t>(t[c])].cast<double>());
    };
    volume += at(0).dot(at(1).cross(at(2))) / 6;
  }
  return volume;
}

TEST(SurfaceNets, MeshesABallClosedAndTrue) {
  const GridLines lines = MakeGridLines(-1.3F, 1.3F, 0.08F);
  const TriangleMesh mesh =
      MeshDistance([](const Vec3f& x) { return x.norm() - 1; }, lines, lines, lines);
  EXPECT_TRUE(IsClosed(mesh.triangles));
  for (const Vec3f& p : mesh.positions) EXPECT_NEAR(p.norm(), 1, 1e-4F);
  EXPECT_NEAR(Volume(mesh.positions, mesh.triangles), 4 * kPiD / 3, 0.02);
}

class StudioPerson : public testing::Test {
 protected:
  static void SetUpTestSuite() { person_ = new PersonMesh(BuildPerson(0.016F)); }
  static void TearDownTestSuite() { delete person_; }
  static PersonMesh* person_;
};
PersonMesh* StudioPerson::person_ = nullptr;

TEST_F(StudioPerson, IsClosedAndOfHumanSize) {
  EXPECT_TRUE(IsClosed(person_->rest.triangles));
  const double litres = 1000 * Volume(person_->rest.positions, person_->rest.triangles);
  EXPECT_GT(litres, 60);
  EXPECT_LT(litres, 120);
  for (const auto& weights : person_->weights) {
    float sum = 0;
    for (const float w : weights) sum += w;
    EXPECT_NEAR(sum, 1, 1e-4F);
  }
}

TEST_F(StudioPerson, StaysAtRestInTheRestPosture) {
  Posture rest;
  rest.arm[0].raise = rest.arm[1].raise = kPi / 4;
  const PosedPerson posed = PosePerson(*person_, rest, 0, 0);
  for (std::size_t v = 0; v < posed.positions.size(); ++v) {
    EXPECT_LT((posed.positions[v] - person_->rest.positions[v]).norm(), 1e-4F);
  }
}

TEST_F(StudioPerson, StandsOnTheFloorAndMovesSmoothly) {
  std::vector<Vec3f> last;
  float fastest = 0;
  for (int f = 0; f < 40; ++f) {
    const Posture posture = PostureAt(MotionKind::kLively, f / 40.0, 2.1, 0);
    const PosedPerson posed = PosePerson(*person_, posture, 1, 0);
    float lowest = 1;
    for (std::size_t v = 0; v < posed.positions.size(); ++v) {
      ASSERT_TRUE(posed.positions[v].allFinite());
      ASSERT_NEAR(posed.normals[v].norm(), 1, 1e-3F);
      lowest = std::min(lowest, posed.positions[v].z());
      if (!last.empty()) {
        fastest = std::max(fastest, (posed.positions[v] - last[v]).norm());
      }
    }
    EXPECT_NEAR(lowest, posture.jump, 0.04F) << f;
    last = posed.positions;
  }
  EXPECT_GT(fastest, 0.05F);  // lively,
  EXPECT_LT(fastest, 0.45F);  // but no leap from frame to frame (19 frames a second)
}

TEST_F(StudioPerson, TurnIsCounterClockwiseFromAbove) {
  const auto facing = [](double share) {
    const auto joints = MoveJoints(PostureAt(MotionKind::kTurn, share, 1, 0));
    return Vec3f(joints[kPelvis].rotation * Vec3f::UnitX());
  };
  EXPECT_GT(facing(0).cross(facing(0.2)).z(), 0.8F);
  EXPECT_GT(facing(0).dot(facing(0.98)), 0.9F);
}

// Wrinkles deepen where a joint bends, and only on cloth.
TEST_F(StudioPerson, FoldsComeWithTheBendAndStayOnTheCloth) {
  Posture straight;
  straight.arm[0].raise = straight.arm[1].raise = kPi / 4;
  Posture bent = straight;
  bent.squat = 0.8F;
  const auto knee_roughness = [&](const Posture& posture) {
    const PosedPerson with = PosePerson(*person_, posture, 1, 0);
    const PosedPerson without = PosePerson(*person_, posture, 0, 0);
    double sum = 0;
    for (std::size_t v = 0; v < with.positions.size(); ++v) {
      const double moved = (with.positions[v] - without.positions[v]).norm();
      if (OutermostIsSkin(person_->covers[v])) {
        EXPECT_LT(moved, 1e-6);
      }
      const Vec3f to_knee = person_->rest.positions[v] - RestSkeleton()[kLeftShank].position;
      if (to_knee.norm() < 0.12F && to_knee.x() < 0) sum += moved * moved;
    }
    return std::sqrt(sum);
  };
  EXPECT_GT(knee_roughness(bent), 1.5 * knee_roughness(straight));
}

TEST_F(StudioPerson, PatternSlidesAtConstantShape) {
  const Posture posture = PostureAt(MotionKind::kLively, 0.3, 2.1, 0);
  const PosedPerson still = PosePerson(*person_, posture, 1, 0);
  const PosedPerson slid = PosePerson(*person_, posture, 1, 0.03F);
  int moved = 0;
  for (std::size_t v = 0; v < still.positions.size(); ++v) {
    EXPECT_EQ(still.positions[v], slid.positions[v]);
    EXPECT_LE(slid.shift[v].norm(), 0.0301F);
    EXPECT_NEAR(slid.shift[v].dot(slid.normals[v]), 0, 1e-4F);
    EXPECT_EQ(still.shift[v], Vec3f(Vec3f::Zero()));
    moved += slid.shift[v].norm() > 0.02F ? 1 : 0;
  }
  EXPECT_GT(moved, 500);
}

}  // namespace
}  // namespace dyxel::studio
