// The stages on a virtual capture so small that all of them take seconds, with given surfaces.
#include "dyxel/pipeline/run.h"

#include <chrono>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/interrupt.h"
#include "dyxel/capture/manifest.h"
#include "dyxel/image/image_io.h"
#include "dyxel/pipeline/smallest_capture.h"

namespace dyxel {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class RunTest : public ::testing::Test {
 protected:
  static fs::path Root() { return fs::path(::testing::TempDir()) / "dyxel_run_test"; }
  static void SetUpTestSuite() {
    fs::remove_all(Root());
    WriteStudioCapture(Root() / "capture", SmallestPreset());
  }
  RunTest() {
    fs::remove_all(project_);
    fs::remove_all(capture_);
    fs::copy(Root() / "capture", capture_, fs::copy_options::recursive);
    given_.capture = capture_;
    given_.geometry = capture_ / "truth" / "meshes";
  }
  ~RunTest() override { internal::SetInterrupted(false); }

  // Names of the stages that had something to do.
  std::vector<std::string> Run(const RunSelection& selection = {},
                               const std::vector<std::string>& settings = {}) {
    std::vector<std::string> all = {"atlas.size=64", "reflectance.materials=2"};
    all.insert(all.end(), settings.begin(), settings.end());
    const Project project = OpenProject(project_, given_, all);
    Workspace workspace(project);
    std::vector<std::string> stages;
    for (const StageTiming& t : RunStages(ProjectJob(workspace), selection)) {
      stages.push_back(t.stage);
    }
    // Past the tick of the file system's clock.
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return stages;
  }
  StageStatus Status(const std::string& stage) {
    const Project project = LoadProject(project_);
    Workspace workspace(project);
    for (StageStatus& status : ProjectStatus(ProjectJob(workspace))) {
      if (status.stage == stage) return std::move(status);
    }
    return {};
  }
  void ChangeManifest(const std::function<void(Capture&)>& change) {
    Capture capture = LoadCapture(capture_);
    change(capture);
    WriteManifest(capture_, capture);
  }
  nlohmann::json Times() {
    return nlohmann::json::parse(ReadFile(project_ / "report/timings.json"));
  }

  fs::path project_ = Root() / "project";
  fs::path capture_ = Root() / "copy";
  GivenInputs given_;
};

TEST_F(RunTest, RunsOnceAndAgainWhereSomethingChanged) {
  EXPECT_THAT(Run(), ElementsAre("atlas", "textures", "reflectance", "normals", "video"));
  EXPECT_THAT(Run(), ElementsAre());
  given_.scale = 0.5;
  EXPECT_THAT(Run({.until = "textures"}), ElementsAre("textures"));
  given_.scale = 1;
  (void)Run();
  ChangeManifest([](Capture& c) { c.lights[0].intensity *= 1.1F; });
  EXPECT_THAT(Run(), ElementsAre("textures", "reflectance", "normals", "video"));
  ChangeManifest([](Capture& c) { c.fps += 1; });
  EXPECT_THAT(Run(), ElementsAre("video"));
  // A moved capture is the same capture.
  const fs::path moved = Root() / "moved";
  fs::remove_all(moved);
  fs::rename(capture_, moved);
  given_.capture = moved;
  given_.geometry = moved / "truth" / "meshes";
  EXPECT_THAT(Run(), ElementsAre());
  fs::remove_all(moved);
}

TEST_F(RunTest, UnitsAreNumberedWithinAStage) {
  (void)Run({.until = "atlas"});
  EXPECT_THAT(Run({.stage = "textures", .units = std::pair(1, 2)}), ElementsAre("textures"));
  EXPECT_EQ(Status("textures").done, 2);
  EXPECT_EQ(Status("textures").units, 4);
  EXPECT_THROW(Run({.stage = "textures", .units = std::pair(3, 4)}), Error);
  EXPECT_THROW(Run({.units = std::pair(0, 1)}), Error);
  EXPECT_THROW(Run({.until = "nonsense"}), Error);
}

TEST_F(RunTest, AStageAloneSaysWhatItMisses) {
  try {
    (void)Run({.stage = "reflectance"});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::kInput);
    EXPECT_THAT(error.what(), HasSubstr("is missing, and stage reflectance needs it"));
  }
}

TEST_F(RunTest, AnEditedMapIsKeptAndWhatFollowsIsDoneAgain) {
  (void)Run();
  const fs::path map = project_ / "reflectance" / "material.png";
  ImageU8 labels = ReadPngMask(map);
  std::fill(labels.data.begin(), labels.data.end(), std::uint8_t{0});
  WritePng(map, labels);
  const std::string painted = ReadFile(map);
  const std::string normals = ReadFile(project_ / "normals/dss/0000.exr");
  EXPECT_THAT(Status("reflectance").edited_files, ElementsAre("reflectance/material.png"));
  EXPECT_THAT(Run(), ElementsAre("normals", "video"));
  EXPECT_NE(ReadFile(project_ / "normals/dss/0000.exr"), normals);
  // Done again for another reason, the stage leaves the edited map as it is.
  EXPECT_THAT(Run({}, {"reflectance.alpha=0.5"}), ElementsAre("reflectance", "normals", "video"));
  EXPECT_EQ(ReadFile(map), painted);
  EXPECT_THAT(Status("reflectance").edited_files, ElementsAre("reflectance/material.png"));
}

TEST_F(RunTest, AKilledRedoEndsInTheSameFiles) {
  (void)Run();
  (void)Run({.until = "textures"}, {"textures.rim=1"});
  const fs::path texture = project_ / "textures/res/0000/cam0.exr";
  const std::string whole = ReadFile(texture);
  (void)Run({.until = "textures"}, {"textures.rim=2"});
  ASSERT_NE(ReadFile(texture), whole);
  {
    // As if killed when one output was written.
    const Project project = OpenProject(project_, given_, {"textures.rim=1"});
    Workspace workspace(project);
    const Job job = ProjectJob(workspace);
    const std::vector<Unit> units = FindStage("textures").units(job);
    StampBook book(project_, {{"capture", capture_}, {"geometry", *given_.geometry}});
    book.Begin(units[0]);
    WriteFile(units[0].outputs[0], "another state of it");
  }
  EXPECT_THAT(Run({.until = "textures"}, {"textures.rim=1"}), ElementsAre("textures"));
  EXPECT_EQ(ReadFile(texture), whole);
  EXPECT_EQ(Status("textures").edited, 0);
}

TEST_F(RunTest, AFitHasStampsOfItsOwn) {
  (void)Run();
  const Project project = LoadProject(project_);
  Workspace workspace(project);
  Job fit = ProjectJob(workspace);
  fit.fit = "res";
  const std::vector<StageTiming> timings = RunStages(fit);
  ASSERT_EQ(timings.size(), 2U);
  EXPECT_EQ(timings[0].stage, "reflectance");
  EXPECT_EQ(timings[1].stage, "normals");
  EXPECT_THAT(RunStages(ProjectJob(workspace)), ::testing::IsEmpty());
  EXPECT_THAT(RunStages(fit), ::testing::IsEmpty());
}

TEST_F(RunTest, AFrameThatACameraDidNotSeeIsAllowed) {
  ChangeManifest([](Capture& c) { c.sequences[0].allow_missing = true; });
  fs::remove(FramePath(LoadCapture(capture_), LoadCapture(capture_).sequences[0], 1, 1));
  EXPECT_THAT(Run(), ElementsAre("atlas", "textures", "reflectance", "normals", "video"));
}

TEST_F(RunTest, WithoutLampsOnTheResThereIsNoReflectance) {
  ChangeManifest([](Capture& c) { c.sequences[0].lights.clear(); });
  EXPECT_THAT(Run(), ElementsAre("atlas", "textures"));
  EXPECT_EQ(Status("reflectance").units, 0);
  EXPECT_EQ(Status("video").units, 0);
}

TEST_F(RunTest, TimesOfAResumedStageAddUp) {
  (void)Run({.until = "atlas", .record_times = true});
  (void)Run({.stage = "textures", .units = std::pair(0, 1), .record_times = true});
  const double first = Times()["textures"]["wall_s"];
  // --units counts the units that were asked for: what is recorded is of those.
  (void)Run({.record_times = true});
  EXPECT_EQ(Times()["textures"]["units"], 4);
  EXPECT_GT(Times()["textures"]["wall_s"].get<double>(), first);
  const double wall = Times()["atlas"]["wall_s"];
  (void)Run();  // nothing to do, and nothing recorded
  (void)Run({.until = "textures"}, {"textures.rim=1"});
  EXPECT_EQ(Times()["atlas"]["wall_s"], wall);
  (void)Run({.until = "textures", .record_times = true}, {"textures.rim=3"});
  EXPECT_EQ(Times()["textures"]["units"], 4);
}

TEST_F(RunTest, AnInterruptStopsAndKeepsWhatIsDone) {
  (void)Run({.until = "atlas"});
  internal::SetInterrupted(true);
  try {
    (void)Run();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::kInterrupted);
    EXPECT_THAT(error.what(), HasSubstr("run the same command"));
  }
  internal::SetInterrupted(false);
  EXPECT_EQ(Status("atlas").done, 1);
}

}  // namespace
}  // namespace dyxel
