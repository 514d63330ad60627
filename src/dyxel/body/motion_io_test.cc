#include "dyxel/body/motion_io.h"

#include <cmath>
#include <filesystem>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/random.h"

namespace dyxel {
namespace {

class MotionIo : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
    skeleton_.joints = {{"pelvis", -1, {0, 0, 1}, {}},
                        {"arm",
                         0,
                         {0, 0, 0.3},
                         {{"swing", Vec3d::UnitX(), -1, 1}, {"twist", Vec3d::UnitY(), -1, 1}}}};
    Random random(5);
    auto next = [&] { return static_cast<double>(random.Normal()) / 3; };
    for (int i = 0; i < 4; ++i) {
      Pose pose = skeleton_.RestPose();
      pose.root_translation = {next(), next() * 1e-9, next() * 1e9};
      pose.root_rotation = Quatd(next(), next(), next(), next()).normalized();
      pose.angles = {next(), i == 0 ? 0.0 : next()};
      motion_.poses.push_back(pose);
      motion_.confidence.push_back(static_cast<double>(i) / 3);
    }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // The message of reading `text` as a motion.
  std::string ErrorOf(const std::string& text) const {
    WriteFile(folder_ / "bad.json", text);
    try {
      (void)ReadMotion(folder_ / "bad.json", skeleton_);
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::kInput);
      return error.what();
    }
    return "no error";
  }

  std::filesystem::path folder_;
  Skeleton skeleton_;
  Motion motion_;
};

TEST_F(MotionIo, RoundTripIsExact) {
  motion_.confidence[1] = std::numeric_limits<double>::quiet_NaN();
  WriteMotion(folder_ / "dss.json", skeleton_, motion_);
  const Motion read = ReadMotion(folder_ / "dss.json", skeleton_);
  ASSERT_EQ(read.poses.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(read.poses[i].root_translation, motion_.poses[i].root_translation);
    EXPECT_EQ(read.poses[i].root_rotation.coeffs(), motion_.poses[i].root_rotation.coeffs());
    EXPECT_EQ(read.poses[i].angles, motion_.poses[i].angles);
    if (i != 1) {
      EXPECT_EQ(read.confidence[i], motion_.confidence[i]);
    }
  }
  EXPECT_TRUE(std::isnan(read.confidence[1]));
}

TEST_F(MotionIo, AnEmptyMotionIsOne) {
  WriteMotion(folder_ / "none.json", skeleton_, {});
  EXPECT_TRUE(ReadMotion(folder_ / "none.json", skeleton_).poses.empty());
}

TEST_F(MotionIo, DamageIsNamed) {
  using testing::HasSubstr;
  WriteMotion(folder_ / "good.json", skeleton_, motion_);
  const std::string good = ReadFile(folder_ / "good.json");
  auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  EXPECT_EQ(ErrorOf(good), "no error");
  EXPECT_THAT(ErrorOf(good.substr(0, good.size() / 2)), HasSubstr("cut off"));
  EXPECT_THAT(ErrorOf(with("dyxel-motion", "video")), HasSubstr("not a motion"));
  EXPECT_THAT(ErrorOf(with("\"version\": 1", "\"version\": 7")), HasSubstr("version"));
  EXPECT_THAT(ErrorOf(with("swing", "sway")), HasSubstr("another actor"));
  EXPECT_THAT(ErrorOf(with("\"confidence\": 0.0", "\"confidence\": 2")),
              HasSubstr("frame 0: \"confidence\""));
  EXPECT_THAT(ErrorOf(with("\"angles\": [", "\"angles\": [1.0,")), HasSubstr("\"angles\""));
  motion_.poses[1].root_rotation.coeffs() *= 1.5;
  WriteMotion(folder_ / "long.json", skeleton_, motion_);
  EXPECT_THAT(ErrorOf(ReadFile(folder_ / "long.json")), HasSubstr("frame 1: \"rotation\""));
  EXPECT_THAT(ErrorOf(with("\"translation\": [", "\"translation\": [null,")),
              HasSubstr("\"translation\""));
  EXPECT_THROW((void)ReadMotion(folder_ / "nowhere.json", skeleton_), Error);
}

TEST_F(MotionIo, AnInfinitePoseIsNotWritten) {
  motion_.poses[2].angles[0] = std::numeric_limits<double>::infinity();
  EXPECT_THROW(WriteMotion(folder_ / "x.json", skeleton_, motion_), Error);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x.json"));
}

}  // namespace
}  // namespace dyxel
