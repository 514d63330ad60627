#include "dyxel/pipeline/stamps.h"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "dyxel/base/atomic_file.h"

namespace dyxel {
namespace {

namespace fs = std::filesystem;

class StampsTest : public ::testing::Test {
 protected:
  StampsTest() : project_(fs::path(::testing::TempDir()) / "dyxel_stamps_test") {
    fs::remove_all(project_);
    WriteFile(project_ / "in.txt", "input");
    WriteFile(project_ / "out.txt", "output");
    unit_.stage = "stage";
    unit_.id = "seq/0000";
    unit_.options = "a=1\n";
    unit_.inputs = {project_ / "in.txt"};
    unit_.outputs = {project_ / "out.txt"};
    StampBook(project_, {}).Stamp(unit_);
    // A change within one tick of the file system's clock is seen by content; let the tick pass so
    // that the tests also take the short way.
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  UnitState State() { return StampBook(project_, {}).State(unit_); }

  fs::path project_;
  Unit unit_;
};

TEST_F(StampsTest, IsDoneWhereNothingChanged) { EXPECT_EQ(State(), UnitState::kDone); }

TEST_F(StampsTest, RewritingTheSameContentChangesNothing) {
  WriteFile(project_ / "in.txt", "input");
  WriteFile(project_ / "out.txt", "output");
  EXPECT_EQ(State(), UnitState::kDone);
}

TEST_F(StampsTest, SeesAnotherInput) {
  WriteFile(project_ / "in.txt", "other");
  EXPECT_EQ(State(), UnitState::kStale);
}

TEST_F(StampsTest, SeesAnotherOption) {
  unit_.options = "a=2\n";
  EXPECT_EQ(State(), UnitState::kStale);
}

TEST_F(StampsTest, SeesAnInputMore) {
  WriteFile(project_ / "more.txt", "");
  unit_.inputs.push_back(project_ / "more.txt");
  EXPECT_EQ(State(), UnitState::kStale);
}

TEST_F(StampsTest, SeesAMissingOutput) {
  fs::remove(project_ / "out.txt");
  EXPECT_EQ(State(), UnitState::kMissing);
}

TEST_F(StampsTest, KeepsAnEditedOutputAlsoWhenAnInputChanged) {
  WriteFile(project_ / "out.txt", "painted");
  EXPECT_EQ(State(), UnitState::kEdited);
  WriteFile(project_ / "in.txt", "other");
  EXPECT_EQ(State(), UnitState::kEdited);
  EXPECT_EQ(StampBook(project_, {}).EditedOutputs(unit_), unit_.outputs);
}

TEST_F(StampsTest, ADamagedStampIsNoStamp) {
  WriteFile(project_ / "state" / "stage" / "seq.0000.json", "{\"version\": 1, \"inputs\": 3}");
  EXPECT_EQ(State(), UnitState::kMissing);
}

TEST_F(StampsTest, StampsOfEqualProjectsAreEqual) {
  const fs::path other = fs::path(::testing::TempDir()) / "dyxel_stamps_test_other";
  fs::remove_all(other);
  WriteFile(other / "in.txt", "input");
  WriteFile(other / "out.txt", "output");
  Unit unit = unit_;
  unit.inputs = {other / "in.txt"};
  unit.outputs = {other / "out.txt"};
  StampBook(other, {}).Stamp(unit);
  EXPECT_EQ(ReadFile(other / "state/stage/seq.0000.json"),
            ReadFile(project_ / "state/stage/seq.0000.json"));
}

}  // namespace
}  // namespace dyxel
