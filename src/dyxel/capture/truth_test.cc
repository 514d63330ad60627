#include "dyxel/capture/truth.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/image/image_io.h"

namespace dyxel {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class TruthTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("dyxel_truth_") +
               ::testing::UnitTest::GetInstance()->current_test_info()->name() + "_" +
               std::to_string(::getpid()));
    Camera camera;
    camera.name = "cam0";
    camera.width = 8;
    camera.height = 6;
    camera.fx = camera.fy = 10;
    capture_.cameras = {camera};
    sequence_.name = "dss";
    sequence_.first = 3;
    sequence_.count = 4;
    half_ = capture_;
    half_.scale = 0.5;
    half_.cameras[0] = camera.Scaled(0.5);
    std::filesystem::create_directories(folder_ / "meshes");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
  Capture capture_;
  Capture half_;  // at half size
  Sequence sequence_;
};

TEST_F(TruthTest, Meshes) {
  const Truth truth = OpenTruth(folder_);
  EXPECT_THAT(truth.MeshPaths(sequence_), IsEmpty());
  for (const char* name : {"0003", "0004", "0006"}) {
    WriteFile(folder_ / "meshes/dss" / (std::string(name) + ".ply"), "ply");
  }
  EXPECT_EQ(truth.MeshPath(sequence_, 1), folder_ / "meshes/dss/0004.ply");
  EXPECT_TRUE(truth.MeshPath(sequence_, 2).empty());
  EXPECT_TRUE(truth.ShiftPath(sequence_, 1).empty());
  try {
    (void)truth.MeshPaths(sequence_);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("frames 5"));
  }
  WriteFile(folder_ / "meshes/dss/0005.ply", "ply");
  EXPECT_EQ(truth.MeshPaths(sequence_).size(), 4U);
  EXPECT_THROW((void)OpenTruth(folder_ / "meshes"), Error);
}

TEST_F(TruthTest, Joints) {
  const Truth truth = OpenTruth(folder_);
  EXPECT_FALSE(truth.Joints(sequence_));
  const auto file = folder_ / "joints/dss.json";
  WriteFile(file, R"({"names": ["root", "hip"], "parents": [-1, 0],
                      "positions": [[[0, 0, 1], [0.5, 0, 1]], [[0, 0, 2], [0.5, 0, 2.5]]]})");
  const std::optional<TruthJoints> joints = truth.Joints(sequence_);
  ASSERT_TRUE(joints);
  EXPECT_THAT(joints->names, ElementsAre("root", "hip"));
  EXPECT_THAT(joints->parents, ElementsAre(-1, 0));
  ASSERT_EQ(joints->positions.size(), 2U);
  EXPECT_EQ(joints->positions[1][1], Vec3d(0.5, 0, 2.5));
  for (const char* bad : {"{}",
                          "[",
                          R"({"names": ["a"], "parents": [0, 1], "positions": []})",
                          R"({"names": ["a"], "parents": [7], "positions": []})",
                          R"({"names": ["a"], "parents": [-1], "positions": [[[0, 0]]]})",
                          R"({"names": ["a"], "parents": [-1], "positions": [[]]})"}) {
    WriteFile(file, bad);
    EXPECT_THROW((void)truth.Joints(sequence_), Error) << bad;
  }
}

TEST_F(TruthTest, Masks) {
  const Truth truth = OpenTruth(folder_);
  EXPECT_TRUE(truth.Mask(capture_, sequence_, 0, 0).empty());
  ImageU8 mask(8, 6, 1);
  mask.At(2, 2) = mask.At(3, 2) = mask.At(2, 3) = 200;  // three quarters of a pixel at half size
  mask.At(6, 4) = 255;                                  // a quarter
  WritePng(folder_ / "masks/dss/cam0/0003.png", mask);
  EXPECT_EQ(truth.Mask(capture_, sequence_, 0, 0).At(3, 2), 255);
  const ImageU8 small = truth.Mask(half_, sequence_, 0, 0);
  EXPECT_EQ(small.width, 4);
  EXPECT_EQ(small.At(1, 1), 255);
  EXPECT_EQ(small.At(3, 2), 0);
  WritePng(folder_ / "masks/dss/cam0/0004.png", ImageU8(9, 6, 1));
  EXPECT_THROW((void)truth.Mask(capture_, sequence_, 0, 1), Error);
}

TEST_F(TruthTest, Passes) {
  const Truth truth = OpenTruth(folder_);
  ImageF normal(8, 6, 3);
  ImageF depth(8, 6, 1, 1e10F);
  for (int x = 0; x < 4; ++x) {
    normal.At(x, 0, 2) = -1;
    normal.At(x, 1, 1) = 1;
    depth.At(x, 0) = 2;
    depth.At(x, 1) = 4;
  }
  depth.At(4, 0) = 3;  // alone in its half-size pixel
  WriteExr(folder_ / "passes/dss/cam0/0004.normal.exr", normal, {"X", "Y", "Z"});
  WriteExr(folder_ / "passes/dss/cam0/0004.depth.exr", depth, {"V"}, ExrType::kFloat);
  WriteExr(folder_ / "passes/dss/cam0/0006.albedo.exr", ImageF(8, 6, 3, 0.25F));
  EXPECT_THAT(truth.PassFrames(capture_, sequence_, 0), ElementsAre(1, 3));

  const TruthPasses full = truth.Passes(capture_, sequence_, 0, 1);
  EXPECT_TRUE(full.albedo.empty());
  EXPECT_EQ(full.normal.At(2, 0, 2), -1);
  EXPECT_EQ(full.normal.At(6, 0, 2), 0);
  EXPECT_EQ(full.depth.At(2, 1), 4);
  EXPECT_EQ(full.depth.At(7, 1), 0);
  EXPECT_EQ(full.depth.channels, 1);

  const TruthPasses small = truth.Passes(half_, sequence_, 0, 1);
  EXPECT_NEAR(small.normal.At(1, 0, 1), std::sqrt(0.5F), 1e-6F);
  EXPECT_NEAR(small.normal.At(1, 0, 2), -std::sqrt(0.5F), 1e-6F);
  EXPECT_EQ(small.depth.At(1, 0), 3);
  EXPECT_EQ(small.depth.At(2, 0), 0);
  EXPECT_EQ(truth.Passes(half_, sequence_, 0, 3).albedo.At(2, 2, 1), 0.25F);
}

}  // namespace
}  // namespace dyxel
