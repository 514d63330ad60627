#include "dyxel/pipeline/stamps.h"

#include <chrono>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/atomic_file.h"

namespace dyxel {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

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
    Wait();
  }
  static void Wait() { std::this_thread::sleep_for(std::chrono::milliseconds(20)); }
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
  EXPECT_EQ(StampBook(project_, {}).Examine(unit_).edited, unit_.outputs);
}

TEST_F(StampsTest, AUnitThatWasBegunAgainAndKilledIsNotTakenAsEdited) {
  unit_.options = "a=2\n";
  StampBook(project_, {}).Begin(unit_);
  WriteFile(project_ / "out.txt", "output of a=2");
  EXPECT_EQ(State(), UnitState::kMissing);
  EXPECT_THAT(StampBook(project_, {}).Examine(unit_).edited, IsEmpty());
  StampBook again(project_, {});
  again.Begin(unit_);
  again.Finish(unit_);
  EXPECT_EQ(State(), UnitState::kDone);
}

class TwoOutputsTest : public StampsTest {
 protected:
  TwoOutputsTest() {
    WriteFile(project_ / "b.txt", "b1");
    unit_.outputs.push_back(project_ / "b.txt");
    StampBook(project_, {}).Stamp(unit_);
    Wait();
    WriteFile(project_ / "out.txt", "painted");
  }
  // What unit.run would do.
  void Compute(const std::string& text) {
    WriteFile(project_ / "out.txt", "computed");
    WriteFile(project_ / "b.txt", text);
  }
};

TEST_F(TwoOutputsTest, OneEditedIsKeptWhileTheOtherIsMadeAgain) {
  EXPECT_EQ(State(), UnitState::kEdited);
  WriteFile(project_ / "in.txt", "other");
  EXPECT_EQ(State(), UnitState::kStale);
  StampBook book(project_, {});
  book.Begin(unit_);
  Compute("b2");
  book.Finish(unit_);
  EXPECT_EQ(ReadFile(project_ / "out.txt"), "painted");
  EXPECT_EQ(ReadFile(project_ / "b.txt"), "b2");
  Wait();
  EXPECT_EQ(State(), UnitState::kEdited);
  EXPECT_THAT(StampBook(project_, {}).Examine(unit_).edited, ElementsAre(project_ / "out.txt"));
  // A person who puts back what was computed has edited nothing.
  WriteFile(project_ / "out.txt", "computed");
  EXPECT_EQ(State(), UnitState::kDone);
}

TEST_F(TwoOutputsTest, OneEditedIsKeptWhereTheOtherIsGone) {
  fs::remove(project_ / "b.txt");
  const UnitReport report = StampBook(project_, {}).Examine(unit_);
  EXPECT_EQ(report.state, UnitState::kMissing);
  EXPECT_THAT(report.edited, ElementsAre(project_ / "out.txt"));
}

TEST_F(TwoOutputsTest, WhatWasEditedSurvivesTwoKills) {
  WriteFile(project_ / "in.txt", "other");
  for (int kill = 0; kill < 2; ++kill) {
    StampBook(project_, {}).Begin(unit_);
    WriteFile(project_ / "out.txt", "half of it");
    EXPECT_THAT(StampBook(project_, {}).Examine(unit_).edited, ElementsAre(project_ / "out.txt"));
  }
  StampBook book(project_, {});
  book.Begin(unit_);
  Compute("b2");
  book.Finish(unit_);
  EXPECT_EQ(ReadFile(project_ / "out.txt"), "painted");
  EXPECT_FALSE(fs::exists(project_ / "state/stage/seq.0000.edited"));
}

TEST_F(TwoOutputsTest, AbandoningBringsBackWhatWasEdited) {
  WriteFile(project_ / "in.txt", "other");
  StampBook book(project_, {});
  book.Begin(unit_);
  Compute("b2");
  book.Abandon(unit_);
  EXPECT_EQ(ReadFile(project_ / "out.txt"), "painted");
  EXPECT_EQ(State(), UnitState::kMissing);
}

TEST_F(TwoOutputsTest, AnotherVersionOfTheCodeLosesNoEdit) {
  const fs::path stamp = project_ / "state/stage/seq.0000.json";
  std::string text = ReadFile(stamp);
  text.replace(text.find("\"version\": 1"), 12, "\"version\": 0");
  WriteFile(stamp, text);
  WriteFile(project_ / "out.txt", "painted later than the stamp");
  const UnitReport report = StampBook(project_, {}).Examine(unit_);
  EXPECT_EQ(report.state, UnitState::kStale);
  EXPECT_THAT(report.edited, ElementsAre(project_ / "out.txt"));
}

// A file of the capture, whose stamp is written after it.
class RootsTest : public StampsTest {
 protected:
  RootsTest() : a_(project_ / "../dyxel_stamps_a"), b_(project_ / "../dyxel_stamps_b") {
    for (fs::path* folder : {&a_, &b_}) {
      *folder = folder->lexically_normal();
      fs::remove_all(*folder);
      WriteFile(*folder / "res/0.txt", folder == &a_ ? "a" : "b");
    }
    Use(a_);
    Wait();
    StampBook book = Book(a_);
    book.Begin(unit_);
    Wait();
    book.Finish(unit_);
    Wait();
  }
  static StampBook::Roots Capture(const fs::path& capture) { return {{"capture", capture}}; }
  StampBook Book(const fs::path& capture) { return {project_, Capture(capture)}; }
  void Use(const fs::path& capture) { unit_.inputs = {capture / "res/0.txt"}; }

  fs::path a_, b_;
};

TEST_F(RootsTest, TrustsACaptureThatIsInItsPlace) {
  const UnitReport report = Book(a_).Examine(unit_);
  EXPECT_EQ(report.state, UnitState::kDone);
  EXPECT_FALSE(report.reread);
}

TEST_F(RootsTest, SeesAnotherCaptureWhoseFilesAreOlderThanTheStamp) {
  Use(b_);
  EXPECT_EQ(Book(b_).State(unit_), UnitState::kStale);
}

TEST_F(RootsTest, SeesAnotherCaptureInTheSamePlace) {
  fs::remove_all(a_);
  fs::rename(b_, a_);
  EXPECT_EQ(Book(a_).State(unit_), UnitState::kStale);
}

TEST_F(RootsTest, SeesAnotherFolderInTheSamePlace) {
  fs::rename(a_ / "res", a_ / "old");
  fs::rename(b_ / "res", a_ / "res");
  EXPECT_EQ(Book(a_).State(unit_), UnitState::kStale);
}

TEST_F(RootsTest, AMovedCaptureIsReadOnceAndThenTrusted) {
  fs::remove_all(b_);
  fs::rename(a_, b_);
  Use(b_);
  {
    StampBook book = Book(b_);
    const UnitReport report = book.Examine(unit_);
    EXPECT_EQ(report.state, UnitState::kDone);
    EXPECT_TRUE(report.reread);
    book.Begin(unit_);  // any unit's Begin() notes the new place
    Wait();
    book.Finish(unit_);
  }
  Wait();
  StampBook book = Book(b_);
  EXPECT_EQ(book.State(unit_), UnitState::kDone);
  EXPECT_FALSE(book.Examine(unit_).reread);
}

TEST_F(RootsTest, ConfirmSavesReadingAgain) {
  WriteFile(a_ / "notes.txt", "changes the folder's inode");
  Wait();
  ASSERT_TRUE(Book(a_).Examine(unit_).reread);
  Book(a_).Confirm(unit_);
  EXPECT_FALSE(Book(a_).Examine(unit_).reread);
}

TEST_F(StampsTest, ADamagedStampIsNoStamp) {
  WriteFile(project_ / "state" / "stage" / "seq.0000.json", "{\"version\": 1, \"inputs\": 3}");
  EXPECT_EQ(State(), UnitState::kMissing);
}

TEST_F(StampsTest, NoTwoIdsShareAStamp) {
  Unit other = unit_;
  other.id = "seq.0000";
  EXPECT_EQ(StampBook(project_, {}).State(other), UnitState::kMissing);
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
