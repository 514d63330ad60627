#include "dyxel/pipeline/metrics_file.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "dyxel/base/atomic_file.h"

namespace dyxel {
namespace {

TEST(Series, MeanWorstAndPercentiles) {
  Series s;
  EXPECT_TRUE(std::isnan(s.Mean()));
  for (const double v : {5.0, 1.0, 4.0, 2.0, 3.0}) s.Add(v);
  EXPECT_DOUBLE_EQ(s.Mean(), 3);
  EXPECT_DOUBLE_EQ(s.Min(), 1);
  EXPECT_DOUBLE_EQ(s.Percentile(0.5), 3);
  EXPECT_DOUBLE_EQ(s.Percentile(1), 5);
  EXPECT_DOUBLE_EQ(s.ShareBelow(2.5), 0.4);
}

TEST(Metrics, LeavesOutWhatCouldNotBeMeasured) {
  Metrics m;
  m.Set("a.b", 1.5);
  m.Set("a.c", std::numeric_limits<double>::quiet_NaN());
  m.SetPrefix("fit.x.");
  m.Set("a.b", 2);
  EXPECT_DOUBLE_EQ(m.Get("a.b"), 2);
  const auto file = std::filesystem::path(::testing::TempDir()) / "dyxel_metrics_test.json";
  m.Write(file);
  EXPECT_EQ(ReadFile(file), "{\n \"a.b\": 1.5,\n \"fit.x.a.b\": 2.0\n}\n");
}

}  // namespace
}  // namespace dyxel
