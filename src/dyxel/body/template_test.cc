// The built-in template: topology, triangles, symmetry, sizes, weights, and how it bends.
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/hash.h"
#include "dyxel/base/parallel.h"
#include "dyxel/body/actor.h"
#include "dyxel/body/template_parts.h"

namespace dyxel {
namespace {

std::size_t At(int i) { return static_cast<std::size_t>(i); }

const Actor& Template() {
  static const Actor actor = MakeBuiltInTemplate();
  return actor;
}

double Volume(const std::vector<Vec3f>& positions, const std::vector<Triangle>& triangles) {
  double volume = 0;
  for (const Triangle& t : triangles) {
    const Vec3d a = positions[At(t[0])].cast<double>();
    const Vec3d b = positions[At(t[1])].cast<double>();
    const Vec3d c = positions[At(t[2])].cast<double>();
    volume += a.dot(b.cross(c)) / 6;
  }
  return volume;
}

int DofIndex(const Skeleton& skeleton, const std::string& name) {
  int index = 0;
  for (const Joint& joint : skeleton.joints) {
    for (const Dof& dof : joint.dofs) {
      if (dof.name == name) return index;
      ++index;
    }
  }
  ADD_FAILURE() << name;
  return 0;
}

std::string HashOf(const Actor& actor) {
  Hasher hasher;
  hasher.AddBytes(std::as_bytes(std::span(actor.skin.positions)));
  hasher.AddBytes(std::as_bytes(std::span(actor.skin.triangles)));
  hasher.AddBytes(std::as_bytes(std::span(actor.joint_indices)));
  hasher.AddBytes(std::as_bytes(std::span(actor.joint_weights)));
  return hasher.Digest();
}

TEST(Template, SkinIsOneClosedBall) {
  const TriangleMesh& skin = Template().skin;
  std::map<std::pair<int, int>, int> half_edges;
  std::vector<int> root(skin.positions.size());
  std::iota(root.begin(), root.end(), 0);
  auto find = [&](int v) {
    while (root[At(v)] != v) v = root[At(v)] = root[At(root[At(v)])];
    return v;
  };
  for (const Triangle& t : skin.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      ++half_edges[{t[k], t[(k + 1) % 3]}];
      root[At(find(t[k]))] = find(t[(k + 1) % 3]);
    }
  }
  for (const auto& [edge, count] : half_edges) {
    ASSERT_EQ(count, 1);
    ASSERT_TRUE(half_edges.contains({edge.second, edge.first}));
  }
  std::set<int> pieces;
  for (std::size_t v = 0; v < root.size(); ++v) pieces.insert(find(static_cast<int>(v)));
  EXPECT_EQ(pieces.size(), 1U);
  const auto vertices = static_cast<long>(skin.positions.size());
  const auto edges = static_cast<long>(half_edges.size() / 2);
  EXPECT_EQ(vertices - edges + static_cast<long>(skin.triangles.size()), 2);
  EXPECT_GT(vertices, 15000);
  EXPECT_LT(vertices, 25000);
}

TEST(Template, TrianglesAreNearlyEquilateral) {
  const TriangleMesh& skin = Template().skin;
  std::size_t off = 0;
  double least_angle = kPiD;
  for (const Triangle& t : skin.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3d a = skin.positions[At(t[k])].cast<double>();
      const Vec3d b = skin.positions[At(t[(k + 1) % 3])].cast<double>();
      const Vec3d c = skin.positions[At(t[(k + 2) % 3])].cast<double>();
      const double wanted = TemplateEdgeLength((a + b) / 2);
      const double length = (b - a).norm();
      EXPECT_GT(length, 0.3 * wanted);
      EXPECT_LT(length, 2.0 * wanted);
      off += length < 0.6 * wanted || length > 1.5 * wanted ? 1U : 0U;
      const double cosine = (b - a).normalized().dot((c - a).normalized());
      least_angle = std::min(least_angle, std::acos(cosine));
    }
  }
  EXPECT_LT(static_cast<double>(off), 0.01 * 3 * static_cast<double>(skin.triangles.size()));
  EXPECT_GT(least_angle * 180 / kPiD, 15);
}

TEST(Template, VerticesLieOnTheShape) {
  const Shape shape = TemplateShape();
  int off = 0;
  for (const Vec3f& x : Template().skin.positions) {
    const double distance = std::abs(shape.Distance(x.cast<double>()));
    EXPECT_LT(distance, 1.5e-3);
    off += distance > 1e-4 ? 1 : 0;
  }
  EXPECT_LT(off, 300);  // in creases: between fingers, behind ears
}

// Nearby triangles that share no vertex must not cross: each edge against each triangle of a grid.
TEST(Template, SkinDoesNotCrossItself) {
  const TriangleMesh& skin = Template().skin;
  auto cell_of = [](const Vec3f& x) {
    return std::array<int, 3>{static_cast<int>(std::floor(x[0] / 0.02F)),
                              static_cast<int>(std::floor(x[1] / 0.02F)),
                              static_cast<int>(std::floor(x[2] / 0.02F))};
  };
  std::map<std::array<int, 3>, std::vector<int>> grid;
  auto cells = [&](const Triangle& t, auto&& visit) {
    Vec3f low = skin.positions[At(t[0])];
    Vec3f high = low;
    for (const int v : t) {
      low = low.cwiseMin(skin.positions[At(v)]);
      high = high.cwiseMax(skin.positions[At(v)]);
    }
    const std::array<int, 3> a = cell_of(low);
    const std::array<int, 3> b = cell_of(high);
    for (int z = a[2]; z <= b[2]; ++z) {
      for (int y = a[1]; y <= b[1]; ++y) {
        for (int x = a[0]; x <= b[0]; ++x) visit(std::array<int, 3>{x, y, z});
      }
    }
  };
  for (std::size_t f = 0; f < skin.triangles.size(); ++f) {
    cells(skin.triangles[f],
          [&](const std::array<int, 3>& cell) { grid[cell].push_back(static_cast<int>(f)); });
  }
  auto side = [&](const Vec3d& a, const Vec3d& b, const Vec3d& c, const Vec3d& x) {
    return (b - a).cross(c - a).dot(x - a);
  };
  int crossings = 0;
  for (const Triangle& t : skin.triangles) {
    std::set<int> others;
    cells(t, [&](const std::array<int, 3>& cell) {
      const auto found = grid.find(cell);
      others.insert(found->second.begin(), found->second.end());
    });
    for (const int other : others) {
      const Triangle& o = skin.triangles[At(other)];
      bool touches = false;
      for (const int v : t) touches = touches || std::find(o.begin(), o.end(), v) != o.end();
      if (touches) continue;
      const Vec3d a = skin.positions[At(o[0])].cast<double>();
      const Vec3d b = skin.positions[At(o[1])].cast<double>();
      const Vec3d c = skin.positions[At(o[2])].cast<double>();
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3d p = skin.positions[At(t[k])].cast<double>();
        const Vec3d q = skin.positions[At(t[(k + 1) % 3])].cast<double>();
        if (side(a, b, c, p) * side(a, b, c, q) >= 0) continue;
        const double u = side(p, q, a, b);
        const double v = side(p, q, b, c);
        const double w = side(p, q, c, a);
        crossings += (u > 0 && v > 0 && w > 0) || (u < 0 && v < 0 && w < 0) ? 1 : 0;
      }
    }
  }
  EXPECT_EQ(crossings, 0);
}

TEST(Template, LeftAndRightAreMirrored) {
  const Actor& actor = Template();
  std::map<std::array<float, 3>, std::size_t> at;
  for (std::size_t v = 0; v < actor.skin.positions.size(); ++v) {
    const Vec3f& x = actor.skin.positions[v];
    at[{x[0], x[1], x[2]}] = v;
  }
  for (std::size_t v = 0; v < actor.skin.positions.size(); ++v) {
    const Vec3f& x = actor.skin.positions[v];
    const auto found = at.find({x[0], x[1] == 0 ? x[1] : -x[1], x[2]});
    ASSERT_NE(found, at.end());
    EXPECT_EQ(actor.joint_weights[v], actor.joint_weights[found->second]);
  }
  const std::vector<Vec3d> rest = actor.skeleton.RestPositions();
  for (int j = 0; j < kNumSegments; ++j) {
    const Vec3d image = rest[At(MirrorSegment(j))];
    EXPECT_LT((rest[At(j)] - Vec3d(image[0], -image[1], image[2])).norm(), 1e-12);
  }
}

TEST(Template, SizesAreThoseOfTheTables) {
  const Actor& actor = Template();
  const std::vector<Joint>& joints = actor.skeleton.joints;
  constexpr double kStature = 1.75;
  auto length = [&](const std::string& name) {
    return joints[At(actor.skeleton.FindJoint(name))].offset.norm();
  };
  EXPECT_NEAR(length("l_lower_arm"), 0.186 * kStature, 1e-9);
  EXPECT_NEAR(length("r_hand"), 0.146 * kStature, 1e-9);
  EXPECT_NEAR(length("r_shank"), 0.245 * kStature, 1e-9);
  EXPECT_NEAR(length("l_foot"), 0.246 * kStature, 1e-9);
  Vec3f low = actor.skin.positions[0];
  Vec3f high = low;
  double foot_front = -1;
  double foot_back = 1;
  double hand = 0;
  const std::vector<Vec3d> rest = actor.skeleton.RestPositions();
  for (const Vec3f& x : actor.skin.positions) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
    const Vec3d y = x.cast<double>();
    if (y[2] < 0.04) {
      foot_front = std::max(foot_front, y[0]);
      foot_back = std::min(foot_back, y[0]);
    }
    if (y[1] > 0.5) hand = std::max(hand, (y - rest[kLeftHand]).dot(BoneDirection(kLeftHand)));
  }
  EXPECT_NEAR(static_cast<double>(high[2]), kStature, 0.01);
  EXPECT_NEAR(static_cast<double>(low[2]), 0, 0.002);
  EXPECT_NEAR(hand, 0.108 * kStature, 0.01);
  EXPECT_NEAR(foot_front - foot_back, 0.152 * kStature + 0.015, 0.015);  // a shoe
  const double litres = 1000 * Volume(actor.skin.positions, actor.skin.triangles);
  EXPECT_GT(litres, 60);
  EXPECT_LT(litres, 85);
}

TEST(Template, DofsHaveRangesAroundTheRestPose) {
  const Skeleton& skeleton = Template().skeleton;
  EXPECT_EQ(skeleton.joints.size(), 16U);
  EXPECT_EQ(skeleton.NumDofs(), 35);
  std::set<std::string> names;
  for (const Joint& joint : skeleton.joints) {
    for (const Dof& dof : joint.dofs) {
      names.insert(dof.name);
      EXPECT_NEAR(dof.axis.norm(), 1, 1e-12) << dof.name;
      EXPECT_LT(dof.min, 0) << dof.name;
      EXPECT_GT(dof.max, 0) << dof.name;
    }
  }
  EXPECT_EQ(names.size(), 35U);
}

// Where a joint's three hinges are nearly dependent, an increment in one direction needs a large
// step: the axes' volume is the sine of the angle to that.
TEST(Template, NoGimbalLockInOrdinaryMotion) {
  const Skeleton& skeleton = Template().skeleton;
  auto volume_of_axes = [&](const std::vector<std::pair<std::string, double>>& angles_deg,
                            int joint) {
    Pose pose = skeleton.RestPose();
    for (const auto& [name, angle] : angles_deg) {
      pose.angles[At(DofIndex(skeleton, name))] = angle * kPiD / 180;
    }
    const PoseDerivatives derivatives = ComputePoseDerivatives(skeleton, pose);
    const int first = skeleton.FirstDof()[At(joint)];
    Mat3d axes;
    for (int k = 0; k < 3; ++k) axes.col(k) = derivatives.axes[At(first + k)];
    return std::abs(axes.determinant());
  };
  for (const double elevation : {-80.0, -30.0, 0.0, 50.0, 100.0, 150.0}) {
    for (const double swing : {-40.0, 0.0, 40.0, 80.0}) {
      EXPECT_GT(volume_of_axes({{"l_shoulder_elevation", elevation}, {"l_shoulder_swing", swing}},
                               kLeftUpperArm),
                0.25);
    }
  }
  for (const double flexion : {-20.0, 40.0, 110.0}) {
    for (const double abduction : {-20.0, 20.0, 50.0}) {
      EXPECT_GT(
          volume_of_axes({{"l_hip_flexion", flexion}, {"l_hip_abduction", abduction}}, kLeftThigh),
          0.25);
    }
  }
}

// What each positive angle does, seen at the hand or the foot.
TEST(Template, HingesTurnAsTheirNamesSay) {
  const Skeleton& skeleton = Template().skeleton;
  auto moved = [&](const std::string& dof, double degrees, int joint) {
    Pose pose = skeleton.RestPose();
    pose.angles[At(DofIndex(skeleton, dof))] = degrees * kPiD / 180;
    return Vec3d(skeleton.Forward(pose)[At(joint)].translation -
                 skeleton.RestPositions()[At(joint)]);
  };
  for (const bool left : {true, false}) {
    const std::string side = left ? "l_" : "r_";
    const double out = left ? 1 : -1;
    const int hand = left ? kLeftHand : kRightHand;
    const int foot = left ? kLeftFoot : kRightFoot;
    EXPECT_GT(moved(side + "shoulder_elevation", 90, hand)[2], 0.4);
    EXPECT_GT(moved(side + "shoulder_swing", 30, hand)[0], 0.1);
    EXPECT_GT(moved(side + "elbow_flexion", 90, hand)[0], 0.2);
    EXPECT_GT(moved(side + "hip_flexion", 60, foot)[0], 0.5);
    EXPECT_GT(moved(side + "hip_abduction", 30, foot)[1] * out, 0.3);
    EXPECT_LT(moved(side + "knee_flexion", 90, foot)[0], -0.4);
  }
  EXPECT_GT(moved("chest_flexion", 30, kHead)[0], 0.1);
  EXPECT_GT(moved("abdomen_lateral", 20, kHead)[1], 0.1);
  EXPECT_LT(moved("chest_twist", 30, kLeftUpperArm)[0], -0.05);
}

TEST(Template, WeightsAreConvexAndSmooth) {
  const Actor& actor = Template();
  ASSERT_EQ(actor.joint_indices.size(), actor.skin.positions.size());
  std::vector<double> per_joint(16, 0.0);
  for (std::size_t v = 0; v < actor.joint_weights.size(); ++v) {
    float sum = 0;
    float last = 1;
    for (std::size_t k = 0; k < 4; ++k) {
      const float w = actor.joint_weights[v][k];
      EXPECT_GE(w, 0);
      EXPECT_LE(w, last);
      last = w;
      sum += w;
      ASSERT_GE(actor.joint_indices[v][k], 0);
      ASSERT_LT(actor.joint_indices[v][k], 16);
      per_joint[At(actor.joint_indices[v][k])] += static_cast<double>(w);
    }
    EXPECT_NEAR(sum, 1, 1e-6);
  }
  for (const double total : per_joint) EXPECT_GT(total, 300);
  // Along an edge no weight may jump.
  double largest_jump = 0;
  for (const Triangle& t : actor.skin.triangles) {
    std::array<double, 16> difference{};
    for (std::size_t k = 0; k < 4; ++k) {
      difference[At(actor.joint_indices[At(t[0])][k])] +=
          static_cast<double>(actor.joint_weights[At(t[0])][k]);
      difference[At(actor.joint_indices[At(t[1])][k])] -=
          static_cast<double>(actor.joint_weights[At(t[1])][k]);
    }
    for (const double d : difference) largest_jump = std::max(largest_jump, std::abs(d));
  }
  EXPECT_LT(largest_jump, 0.40);
}

// A limb's volume: of the triangles that one segment or another moves most, closed by their
// boundaries' cones to the joint between (the same at rest and bent).
double LimbVolume(const Actor& actor,
                  const std::vector<Vec3f>& positions,
                  const Vec3d& apex,
                  std::initializer_list<int> segments) {
  double volume = 0;
  for (const Triangle& t : actor.skin.triangles) {
    bool inside = true;
    for (const int v : t) {
      inside =
          inside && std::find(segments.begin(), segments.end(), actor.joint_indices[At(v)][0]) !=
                        segments.end();
    }
    if (!inside) continue;
    const Vec3d a = positions[At(t[0])].cast<double>() - apex;
    const Vec3d b = positions[At(t[1])].cast<double>() - apex;
    const Vec3d c = positions[At(t[2])].cast<double>() - apex;
    volume += a.dot(b.cross(c)) / 6;
  }
  return volume;
}

TEST(Template, BendingKeepsTheVolume) {
  const Actor& actor = Template();
  const Skeleton& skeleton = actor.skeleton;
  const std::vector<Vec3f> at_rest = SkinPositions(actor, skeleton.RestPose());
  struct Case {
    std::string dof;
    double degrees;
    int joint;
    std::array<int, 2> segments;
  };
  for (const Case& c :
       {Case{"l_elbow_flexion", 90, kLeftLowerArm, {kLeftUpperArm, kLeftLowerArm}},
        Case{"r_knee_flexion", 90, kRightShank, {kRightThigh, kRightShank}},
        Case{"l_knee_flexion", 140, kLeftShank, {kLeftThigh, kLeftShank}},
        Case{"r_elbow_flexion", 140, kRightLowerArm, {kRightUpperArm, kRightLowerArm}}}) {
    Pose pose = skeleton.RestPose();
    pose.angles[At(DofIndex(skeleton, c.dof))] = c.degrees * kPiD / 180;
    const std::vector<Vec3f> bent = SkinPositions(actor, pose);
    const std::vector<Vec3d> rest = skeleton.RestPositions();
    const double before =
        LimbVolume(actor, at_rest, rest[At(c.joint)], {c.segments[0], c.segments[1]});
    const double after = LimbVolume(actor, bent, rest[At(c.joint)], {c.segments[0], c.segments[1]});
    EXPECT_GT(after, 0.88 * before) << c.dof << " " << c.degrees;
    EXPECT_LT(after, 1.12 * before) << c.dof << " " << c.degrees;
  }
  // Arms raised, knees to the chest: of the whole.
  const double whole = Volume(at_rest, actor.skin.triangles);
  for (const auto& [dof, degrees] : {std::pair{"shoulder_elevation", 120.0},
                                     std::pair{"shoulder_elevation", -30.0},
                                     std::pair{"hip_flexion", 90.0},
                                     std::pair{"hip_abduction", 40.0}}) {
    Pose pose = skeleton.RestPose();
    for (const char* side : {"l_", "r_"}) {
      pose.angles[At(DofIndex(skeleton, std::string(side) + dof))] = degrees * kPiD / 180;
    }
    const double after = Volume(SkinPositions(actor, pose), actor.skin.triangles);
    EXPECT_NEAR(after / whole, 1, 0.04) << dof << " " << degrees;
  }
}

TEST(Template, IsTheSameForAnyNumberOfThreads) {
  const std::string hash = HashOf(Template());
  SetJobs(1);
  EXPECT_EQ(HashOf(MakeBuiltInTemplate()), hash);
  SetJobs(0);
}

}  // namespace
}  // namespace dyxel
