#include "dyxel/pipeline/evaluate.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/error.h"
#include "dyxel/pipeline/evaluate_parts.h"
#include "dyxel/pipeline/smallest_capture.h"

namespace dyxel {
namespace {

namespace fs = std::filesystem;

TEST(Flicker, IsTheSecondDifferenceOverTime) {
  // Texel 0 moves evenly: none. Texel 1 jumps to and fro by d: 2 d each time. Texel 2 does not
  // count.
  constexpr float kJump = 0.01F;
  Flicker flicker;
  const std::vector<char> counted = {1, 1, 0};
  EXPECT_TRUE(std::isnan(flicker.MeanDeg(counted)));
  for (int frame = 0; frame < 5; ++frame) {
    const auto f = static_cast<float>(frame);
    const std::vector<Vec3f> vectors = {
        Vec3f(0.1F * f, 0, 1), Vec3f(0, frame % 2 == 0 ? 0 : kJump, 1), Vec3f(f * f * f, 0, 0)};
    flicker.Add(vectors);
  }
  EXPECT_NEAR(flicker.MeanDeg(counted), 0.5 * 2 * 0.01 * 180 / kPiD, 1e-4);
}

// With the true surfaces as given geometry: what a perfect tracker would be measured as.
class EvaluateTest : public ::testing::Test {
 protected:
  static fs::path Root() { return fs::path(::testing::TempDir()) / "dyxel_evaluate_test"; }
  static void SetUpTestSuite() {
    fs::remove_all(Root());
    WriteStudioCapture(Root() / "capture", SmallestPreset(/*validation=*/true));
  }
  static Project Open() {
    GivenInputs given;
    given.capture = Root() / "capture";
    given.geometry = Root() / "capture/truth/meshes";
    return OpenProject(
        Root() / "project",
        given,
        {"atlas.size=64", "reflectance.materials=2", "render.samples=1", "render.shadow_size=256"});
  }
};

TEST_F(EvaluateTest, MeasuresTheTruthAsTrue) {
  EvaluateRequest request;
  request.truth = Root() / "capture/truth";
  request.output = Root() / "report";
  request.ablations = {"base_normals", "model_phong"};
  const Project project = Open();
  const Metrics m = Evaluate(project, request);
  EXPECT_EQ(m.Get("tracking.dss.surface_mm"), 0);
  EXPECT_EQ(m.Get("tracking.dss.surface_p95_mm"), 0);
  EXPECT_GT(m.Get("tracking.res.iou"), 0.85);  // of 64 pixels
  EXPECT_GT(m.Get("tracking.val.iou"), 0.85);
  EXPECT_LT(m.Get("tracking.dss.flow_px"), 2);  // of textures of 64 texels
  EXPECT_GT(m.Get("recorded.dss.inside_share"), 0.8);
  EXPECT_GT(m.Get("relight.val.psnr_inside"), 10);
  EXPECT_LT(m.Get("normals.dss.base_deg"), 20);
  EXPECT_GT(m.Get("normals.dss.flicker_deg"), 0);
  EXPECT_LT(std::abs(m.Get("video.psnr_loss")), 0.5);
  EXPECT_EQ(m.Get("video.bytes_per_frame"), m.Get("video.bytes") / 3);
  EXPECT_GT(m.Get("coverage.texels"), 0);
  EXPECT_LE(m.Get("coverage.texels"), 1);
  EXPECT_EQ(m.Get("ablation.base_normals.normals.dss.normal_deg"), m.Get("normals.dss.base_deg"));
  EXPECT_GT(m.Get("ablation.model_phong.relight.val.psnr_inside"), 10);
  EXPECT_TRUE(fs::exists(Root() / "report/index.html"));
  EXPECT_TRUE(fs::exists(Root() / "report/metrics.json"));
  EXPECT_FALSE(fs::exists(project.folder / "report/timings.json")) << "only runs record times";
}

TEST_F(EvaluateTest, RefusesWhatItDoesNotKnow) {
  EvaluateRequest request;
  request.output = Root() / "report";
  request.ablations = {"no_sense"};
  EXPECT_THROW((void)Evaluate(Open(), request), Error);
}

}  // namespace
}  // namespace dyxel
