#include "dyxel/pipeline/project.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/capture/manifest.h"

namespace dyxel {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A manifest without pictures: a project is opened before any is looked at.
class ProjectTest : public ::testing::Test {
 protected:
  ProjectTest() : root_(fs::path(::testing::TempDir()) / "dyxel_project_test") {
    fs::remove_all(root_);
    capture_.name = "test";
    Camera camera;
    camera.name = "cam0";
    camera.width = camera.height = 64;
    camera.fx = camera.fy = 80;
    camera.cx = camera.cy = 32;
    camera.cam_from_world.translation = Vec3d(0, 0, 3);
    capture_.cameras = {camera};
    Light light;
    light.name = "lamp";
    light.position = Vec3d(1, 1, 2);
    light.intensity = Rgb(1, 1, 1);
    capture_.lights = {light};
    Add("res", SequenceKind::kReflectance, {"lamp"});
    Add("dss", SequenceKind::kDynamic, {"lamp"});
  }
  void Add(const std::string& name, SequenceKind kind, const std::vector<std::string>& lights) {
    Sequence s;
    s.name = name;
    s.kind = kind;
    s.count = 10;
    s.lights = lights;
    s.images = name + "/{camera}/{frame:04}.exr";
    s.background = name + "/{camera}.exr";
    capture_.sequences.push_back(s);
  }
  Project Open(GivenInputs given = {}, const std::vector<std::string>& settings = {}) {
    WriteManifest(root_ / "capture", capture_);
    if (!fs::exists(root_ / "project" / "dyxel.toml")) given.capture = root_ / "capture";
    return OpenProject(root_ / "project", given, settings);
  }
  void AppendToToml(const std::string& from, const std::string& to) {
    const fs::path file = root_ / "project" / "dyxel.toml";
    std::string text = ReadFile(file);
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << text;
    WriteFile(file, text.replace(at, from.size(), to));
  }
  std::string Refusal() {
    try {
      (void)LoadProject(root_ / "project");
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  fs::path root_;
  Capture capture_;
};

TEST_F(ProjectTest, OpensAgainAsItWas) {
  fs::create_directories(root_ / "meshes");
  GivenInputs given;
  given.geometry = root_ / "meshes";
  given.smooth_normals = 3;
  given.scale = 0.5;
  given.frames = std::pair(2, 5);
  (void)Open(given, {"motion.max_iterations=7"});
  const Project project = LoadProject(root_ / "project");
  EXPECT_EQ(project.inputs.capture, root_ / "capture");
  EXPECT_EQ(project.inputs.geometry, root_ / "meshes");
  EXPECT_EQ(project.inputs.smooth_normals, 3);
  EXPECT_EQ(project.inputs.scale, 0.5);
  EXPECT_EQ(project.inputs.frames, std::pair(2, 5));
  EXPECT_EQ(project.options.motion.max_iterations, 7);
  EXPECT_EQ(project.capture.cameras[0].width, 32);
  EXPECT_EQ(project.capture.FindSequence("dss").count, 4);
  EXPECT_EQ(project.capture.FindSequence("res").count, 10);
}

TEST_F(ProjectTest, TheCommandLineOverridesOnlyWhatItNames) {
  GivenInputs given;
  given.scale = 0.5;
  given.frames = std::pair(2, 5);
  (void)Open(given);
  given = {};
  given.capture = root_ / "capture";
  EXPECT_EQ(Open(given).inputs.scale, 0.5);
  EXPECT_EQ(Open(given).inputs.frames, std::pair(2, 5));
  given.scale = 1;
  given.frames.emplace(std::nullopt);
  (void)Open(given);
  const Project project = LoadProject(root_ / "project");
  EXPECT_EQ(project.inputs.scale, 1);
  EXPECT_FALSE(project.inputs.frames);
}

TEST_F(ProjectTest, WhatAPersonWritesUnderCaptureIsChecked) {
  (void)Open();
  AppendToToml("scale = 1.0", "scale = 0.5\nframes = [1, 3]");
  EXPECT_EQ(Open().inputs.frames, std::pair(1, 3));
  EXPECT_EQ(Open().inputs.scale, 0.5);
  AppendToToml("scale = 0.5", "scale = 2");
  EXPECT_THAT(Refusal(), AllOf(HasSubstr("dyxel.toml"), HasSubstr("must be in [0.05, 1]")));
  AppendToToml("scale = 2", "scala = 1.0");
  EXPECT_THAT(Refusal(), HasSubstr("Did you mean capture.scale"));
  AppendToToml("scala = 1.0", "scale = \"half\"");
  EXPECT_THAT(Refusal(), HasSubstr("wrong kind"));
  AppendToToml("scale = \"half\"", "scale = 1.0");
  AppendToToml("[1, 3]", "[3, 1]");
  EXPECT_THAT(Refusal(), HasSubstr("frames must be [A, B]"));
}

TEST_F(ProjectTest, ARelativePathIsBelowTheProject) {
  (void)Open();
  AppendToToml((root_ / "capture").string(), "../capture");
  EXPECT_EQ(LoadProject(root_ / "project").inputs.capture, root_ / "capture");
}

TEST_F(ProjectTest, ACaptureWithoutResCanStillBeTracked) {
  capture_.sequences.erase(capture_.sequences.begin());
  const Project project = Open();
  EXPECT_THAT(project.ReflectanceSequences(), IsEmpty());
  EXPECT_THAT(project.WhyNoReflectance(), HasSubstr("no sequence is of kind"));
  EXPECT_EQ(project.ActorSequence().name, "dss");
}

TEST_F(ProjectTest, AnUnlitResIsTrackedAndNoMore) {
  capture_.sequences[0].lights.clear();
  const Project project = Open();
  EXPECT_THAT(project.ReflectanceSequences(), IsEmpty());
  EXPECT_THAT(project.WhyNoReflectance(), HasSubstr("sequence res names no lights"));
  EXPECT_EQ(project.ActorSequence().name, "res");
}

TEST_F(ProjectTest, TheOptionNamesTheSequences) {
  const Project project = Open({}, {"reflectance.sequence=[dss]"});
  EXPECT_THAT(project.ReflectanceSequences(), ElementsAre("dss"));
  EXPECT_EQ(project.WhyNoReflectance(), "");
}

}  // namespace
}  // namespace dyxel
