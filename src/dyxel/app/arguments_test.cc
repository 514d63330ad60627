// What a person types: ranges, lights, environments.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/app/lighting_arguments.h"
#include "dyxel/app/ranges.h"
#include "dyxel/base/error.h"
#include "dyxel/image/exr.h"

namespace dyxel {
namespace {

using ::testing::HasSubstr;

// What f() is refused with as wrong usage.
template <class F>
std::string Refusal(F&& f) {
  try {
    f();
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::kUsage);
    return error.what();
  }
  return "";
}

TEST(ParseRange, TakesOneOrTwoNumbers) {
  EXPECT_EQ(ParseRange("--frames", "3-7"), std::pair(3, 7));
  EXPECT_EQ(ParseRange("--frames", "5"), std::pair(5, 5));
  EXPECT_EQ(ParseRange("--frames", "0-0"), std::pair(0, 0));
  for (const char* text : {"", "-", "7-3", "-3", "3-", "a-b", "1-2-3", "1 - 2", "99999999999"}) {
    EXPECT_THAT(Refusal([&] { (void)ParseRange("--frames", text); }), HasSubstr("--frames"))
        << text;
  }
}

TEST(ParseLight, KnowsThreeKinds) {
  const Light point = ParseLight("point:1,2,3:4,5,6");
  EXPECT_EQ(point.type, LightType::kPoint);
  EXPECT_EQ(point.position, Vec3d(1, 2, 3));
  EXPECT_EQ(point.intensity[2], 6);
  const Light directional = ParseLight("directional:0,0,-2:1,1,0.5");
  EXPECT_EQ(directional.type, LightType::kDirectional);
  EXPECT_EQ(directional.direction, Vec3d(0, 0, -1));
  EXPECT_EQ(directional.irradiance[2], 0.5F);
  const Light spot = ParseLight("spot:0,0,2:0,0,-1:9,9,9:0.2,0.4");
  EXPECT_EQ(spot.type, LightType::kSpot);
  EXPECT_EQ(spot.direction, Vec3d(0, 0, -1));
  EXPECT_EQ(spot.cone_inner, 0.2);
  EXPECT_EQ(spot.cone_outer, 0.4);
}

TEST(ParseLight, SaysWhatIsWrong) {
  const auto refusal = [](const std::string& text) {
    return Refusal([&] { (void)ParseLight(text); });
  };
  EXPECT_THAT(refusal("sun:1,2,3"), HasSubstr("must be point:"));
  EXPECT_THAT(refusal("point:1,2:4,5,6"), HasSubstr("must be 3 numbers"));
  EXPECT_THAT(refusal("point:1,2,x:4,5,6"), HasSubstr("\"x\" is no number"));
  EXPECT_THAT(refusal("directional:0,0,0:1,1,1"), HasSubstr("must not be zero"));
  EXPECT_THAT(refusal("spot:0,0,2:0,0,-1:9,9,9:0.4,0.2"), HasSubstr("INNER < OUTER"));
}

TEST(ParseEnvironment, TakesARotation) {
  const std::filesystem::path file =
      std::filesystem::path(::testing::TempDir()) / "dyxel_arguments_test.exr";
  WriteExr(file, ImageF(8, 4, 3, 1.0F), {"R", "G", "B"});
  EXPECT_EQ(ParseEnvironment(file.string(), Vec3d::UnitZ()).rotation, 0);
  const Environment turned = ParseEnvironment(file.string() + "@-1.5", Vec3d::UnitY());
  EXPECT_EQ(turned.rotation, -1.5);
  EXPECT_EQ(turned.up, Vec3d::UnitY());
  EXPECT_EQ(turned.radiance.width, 8);
  EXPECT_THAT(Refusal([&] { (void)ParseEnvironment(file.string() + "@quarter", Vec3d::UnitZ()); }),
              HasSubstr("an angle in radians"));
  std::filesystem::remove(file);
}

TEST(DefaultLights, ComeFromAboveForAnyUp) {
  for (const Vec3d& up : {Vec3d(0, 0, 1), Vec3d(0, 1, 0)}) {
    for (const Light& light : DefaultLights(up)) EXPECT_LT(light.direction.dot(up), 0);
  }
}

}  // namespace
}  // namespace dyxel
