#include <filesystem>
#include <numeric>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/hash.h"
#include "dyxel/base/lanes.h"
#include "dyxel/base/parallel.h"
#include "dyxel/base/random.h"

namespace dyxel {
namespace {

std::filesystem::path Scratch() {
  const auto dir = std::filesystem::path(::testing::TempDir()) / "dyxel_base_test";
  std::filesystem::remove_all(dir);
  return dir;
}

TEST(AtomicFile, LeavesNothingWithoutACommit) {
  const auto dir = Scratch();
  { AtomicFile file(dir / "a.txt"); }
  EXPECT_TRUE(std::filesystem::is_empty(dir));
  WriteFile(dir / "a.txt", "first");
  WriteFile(dir / "a.txt", "second");
  EXPECT_EQ(ReadFile(dir / "a.txt"), "second");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir), {}), 1);
}

TEST(ReadFile, NamesTheFile) {
  try {
    (void)ReadFile("/nowhere/x.bin");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.fault(), Fault::kInput);
    EXPECT_THAT(e.what(), ::testing::HasSubstr("/nowhere/x.bin"));
  }
}

TEST(Hasher, TellsTextFromText) {
  EXPECT_EQ(Hasher().Add("ab").Add("c").Digest(), Hasher().Add("ab").Add("c").Digest());
  EXPECT_NE(Hasher().Add("ab").Add("c").Digest(), Hasher().Add("a").Add("bc").Digest());
  EXPECT_EQ(Hasher().Digest().size(), 32U);
}

TEST(ParallelReduce, DoesNotDependOnThreads) {
  const auto sum = [] {
    return ParallelReduce(
        100000,
        1000,
        0.0F,
        [](std::size_t begin, std::size_t end) {
          float s = 0;
          for (std::size_t i = begin; i < end; ++i) s += 1.0F / static_cast<float>(i + 1);
          return s;
        },
        [](float& total, float part) { total += part; });
  };
  SetJobs(1);
  const float one = sum();
  SetJobs(2);
  const float two = sum();
  SetJobs(0);
  EXPECT_EQ(one, two);
  EXPECT_NEAR(one, 12.0901F, 1e-3F);
}

TEST(Random, IsUniformAndNormal) {
  Random random(1, 7);
  double sum = 0;
  double square = 0;
  for (int i = 0; i < 100000; ++i) {
    const double x = random.Normal();
    sum += x;
    square += x * x;
  }
  EXPECT_NEAR(sum / 1e5, 0, 0.02);
  EXPECT_NEAR(square / 1e5, 1, 0.03);
  EXPECT_NE(Random(1, 7).Next(), Random(1, 8).Next());
}

TEST(Lanes, SelectAndLanesAgreeWithScalars) {
  const auto x = FromLanes<Lanes>([](int i) { return i - 3; });
  const Lanes y = Select(x < Lanes(0.0F), -x, Sqrt(x));
  for (int i = 0; i < kLaneCount<Lanes>; ++i) {
    const float s = static_cast<float>(i - 3);
    EXPECT_FLOAT_EQ(Lane(y, i), s < 0 ? -s : std::sqrt(s));
  }
}

}  // namespace
}  // namespace dyxel
