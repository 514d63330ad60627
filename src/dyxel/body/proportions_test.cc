#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/base/error.h"
#include "dyxel/body/actor.h"

namespace dyxel {
namespace {

const Actor& Template() {
  static const Actor actor = MakeBuiltInTemplate();
  return actor;
}

std::size_t Kind(std::string_view name) {
  const std::span<const std::string_view> kinds = SegmentKinds();
  return static_cast<std::size_t>(std::find(kinds.begin(), kinds.end(), name) - kinds.begin());
}

double Bone(const Actor& actor, const std::string& child) {
  const Skeleton& s = actor.skeleton;
  return s.joints[static_cast<std::size_t>(s.FindJoint(child))].offset.norm();
}

float Lowest(const Actor& actor) {
  float lowest = 1e9F;
  for (const Vec3f& x : actor.skin.positions) lowest = std::min(lowest, x[2]);
  return lowest;
}

TEST(Proportions, OnesGiveTheTemplateExactly) {
  const Actor same = ApplyProportions(Template(), TemplateProportions());
  for (std::size_t v = 0; v < same.skin.positions.size(); ++v) {
    ASSERT_EQ(same.skin.positions[v], Template().skin.positions[v]);
  }
  for (std::size_t j = 0; j < same.skeleton.joints.size(); ++j) {
    EXPECT_EQ(same.skeleton.joints[j].offset, Template().skeleton.joints[j].offset);
  }
}

TEST(Proportions, LengthsScaleBonesExactlyAndGirthsDoNot) {
  Proportions p = TemplateProportions();
  p.lengths[Kind("upper_arm")] = 1.2;
  p.lengths[Kind("lower_arm")] = 0.9;
  p.lengths[Kind("thigh")] = 1.1;
  p.lengths[Kind("shank")] = 0.8;
  p.lengths[Kind("abdomen")] = 1.3;
  p.girths[Kind("thigh")] = 1.4;
  p.girths[Kind("upper_arm")] = 0.7;
  const Actor body = ApplyProportions(Template(), p);
  for (const char* side : {"l_", "r_"}) {
    const std::string s = side;
    EXPECT_NEAR(Bone(body, s + "lower_arm"), 1.2 * Bone(Template(), s + "lower_arm"), 1e-12);
    EXPECT_NEAR(Bone(body, s + "hand"), 0.9 * Bone(Template(), s + "hand"), 1e-12);
    EXPECT_NEAR(Bone(body, s + "shank"), 1.1 * Bone(Template(), s + "shank"), 1e-12);
    EXPECT_NEAR(Bone(body, s + "foot"), 0.8 * Bone(Template(), s + "foot"), 1e-12);
  }
  const int chest = body.skeleton.FindJoint("chest");
  EXPECT_NEAR(body.skeleton.joints[static_cast<std::size_t>(chest)].offset[2],
              1.3 * Template().skeleton.joints[static_cast<std::size_t>(chest)].offset[2],
              1e-12);
  EXPECT_NEAR(Lowest(body), Lowest(Template()), 1e-6F);
}

TEST(Proportions, GirthScalesAcrossTheBone) {
  Proportions p = TemplateProportions();
  p.girths[Kind("shank")] = 1.25;
  const Actor body = ApplyProportions(Template(), p);
  const int shank = Template().skeleton.FindJoint("l_shank");
  const std::vector<Vec3d> rest = Template().skeleton.RestPositions();
  const auto s = static_cast<std::size_t>(shank);
  const Vec3d bone = (rest[s + 1] - rest[s]).normalized();
  int checked = 0;
  for (std::size_t v = 0; v < body.skin.positions.size(); ++v) {
    if (Template().joint_indices[v][0] != shank || Template().joint_weights[v][0] < 1) continue;
    const Vec3d before = Template().skin.positions[v].cast<double>() - rest[s];
    const Vec3d after = body.skin.positions[v].cast<double>() - body.skeleton.RestPositions()[s];
    EXPECT_NEAR(before.dot(bone), after.dot(bone), 1e-6);
    EXPECT_NEAR(before.cross(bone).norm() * 1.25, after.cross(bone).norm(), 1e-6);
    ++checked;
  }
  EXPECT_GT(checked, 100);
}

TEST(Proportions, HeightScalesEverything) {
  Proportions p = TemplateProportions();
  p.height = 1.1;
  const Actor body = ApplyProportions(Template(), p);
  for (std::size_t v = 0; v < body.skin.positions.size(); v += 97) {
    EXPECT_LT((body.skin.positions[v] - 1.1F * Template().skin.positions[v]).norm(), 1e-6F);
  }
  EXPECT_NEAR(Bone(body, "l_foot"), 1.1 * Bone(Template(), "l_foot"), 1e-12);
}

// No crack and no fold: every triangle keeps its side and a sensible size.
TEST(Proportions, SkinStaysWhole) {
  for (const double scale : {0.75, 1.3}) {
    for (std::size_t kind = 0; kind < SegmentKinds().size(); ++kind) {
      for (const bool length : {true, false}) {
        Proportions p = TemplateProportions();
        (length ? p.lengths : p.girths)[kind] = scale;
        const Actor body = ApplyProportions(Template(), p);
        int folded = 0;
        for (const Triangle& t : body.skin.triangles) {
          auto normal = [&](const std::vector<Vec3f>& x) {
            const Vec3f& a = x[static_cast<std::size_t>(t[0])];
            return Vec3f((x[static_cast<std::size_t>(t[1])] - a)
                             .cross(x[static_cast<std::size_t>(t[2])] - a));
          };
          const Vec3f before = normal(Template().skin.positions);
          const Vec3f after = normal(body.skin.positions);
          folded += before.dot(after) <= 0.25F * before.norm() * after.norm() ||
                            after.norm() < 0.3F * before.norm() || after.norm() > 3 * before.norm()
                        ? 1
                        : 0;
        }
        EXPECT_EQ(folded, 0) << SegmentKinds()[kind] << (length ? " length " : " girth ") << scale;
      }
    }
  }
}

TEST(Proportions, WrongSizesAreRefused) {
  Proportions p = TemplateProportions();
  p.girths.pop_back();
  EXPECT_THROW((void)ApplyProportions(Template(), p), Error);
  p = TemplateProportions();
  p.lengths[0] = 0;
  EXPECT_THROW((void)ApplyProportions(Template(), p), Error);
}

}  // namespace
}  // namespace dyxel
