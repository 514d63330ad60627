#include "dyxel/base/interrupt.h"

#include <csignal>

#include <gtest/gtest.h>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/base/progress.h"

namespace dyxel {
namespace {

class InterruptTest : public ::testing::Test {
 protected:
  ~InterruptTest() override {
    internal::SetInterrupted(false);
    std::signal(SIGINT, SIG_DFL);
    std::signal(SIGTERM, SIG_DFL);
  }
};

TEST_F(InterruptTest, ASignalStopsWorkAtItsNextStep) {
  HandleInterrupts();
  EXPECT_NO_THROW(ThrowIfInterrupted());
  ::testing::internal::CaptureStderr();
  ASSERT_EQ(std::raise(SIGINT), 0);
  EXPECT_NE(::testing::internal::GetCapturedStderr(), "");
  try {
    ThrowIfInterrupted();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::kInterrupted);
  }
}

TEST_F(InterruptTest, ProgressOutOfAParallelLoopStopsIt) {
  internal::SetInterrupted(true);
  ProgressBar bar("test");
  EXPECT_THROW(ParallelFor(100, [&](std::size_t) { bar.Callback()(0.5); }), Error);
}

TEST_F(InterruptTest, TheSecondSignalEndsTheProgram) {
  EXPECT_EXIT(
      {
        HandleInterrupts();
        (void)std::raise(SIGTERM);
        (void)std::raise(SIGTERM);
      },
      ::testing::ExitedWithCode(128 + SIGTERM),
      "Stopping");
}

}  // namespace
}  // namespace dyxel
