#include "dyxel/pipeline/capture_fingerprint.h"

#include <functional>

#include <gtest/gtest.h>

namespace dyxel {
namespace {

Capture MakeCapture() {
  Capture capture;
  capture.cameras.resize(2);
  capture.cameras[0].name = "cam0";
  capture.cameras[1].name = "held";
  capture.cameras[1].holdout = true;
  capture.lights.resize(2);
  capture.lights[0].name = "spot0";
  capture.lights[1].name = "spot1";
  Sequence sequence;
  sequence.name = "res";
  sequence.count = 2;
  sequence.frame_lights = {{"spot0"}, {"spot1"}};
  capture.sequences = {sequence};
  return capture;
}

// Which of pictures, rig, light of frame 0, light of frame 1 a change of the manifest shows in.
std::string Changed(const std::function<void(Capture&)>& change) {
  const auto prints = [](const Capture& c) {
    const Sequence& s = c.sequences[0];
    return std::vector{PictureFingerprint(c, s),
                       RigFingerprint(c),
                       LightFingerprint(c, s, 0, 1),
                       LightFingerprint(c, s, 1, 2)};
  };
  Capture capture = MakeCapture();
  const std::vector<std::string> before = prints(capture);
  change(capture);
  const std::vector<std::string> after = prints(capture);
  std::string changed;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i] != after[i]) changed += "pr01"[i];
  }
  return changed;
}

TEST(CaptureFingerprint, ShowsEveryChangeWhereItMatters) {
  EXPECT_EQ(Changed([](Capture&) {}), "");
  EXPECT_EQ(Changed([](Capture& c) { c.scale = 0.5; }), "p");
  EXPECT_EQ(Changed([](Capture& c) { c.sequences[0].white_level = 4095; }), "p");
  EXPECT_EQ(Changed([](Capture& c) { c.sequences[0].srgb = true; }), "p");
  EXPECT_EQ(Changed([](Capture& c) { c.cameras[0].color_matrix(0, 2) = 0.1; }), "p");
  EXPECT_EQ(Changed([](Capture& c) { c.cameras[0].distortion[4] = 0.1; }), "r");
  EXPECT_EQ(Changed([](Capture& c) { c.cameras[0].cam_from_world.translation.z() = 1; }), "r");
  EXPECT_EQ(Changed([](Capture& c) { c.up = Vec3d::UnitY(); }), "r");
  EXPECT_EQ(Changed([](Capture& c) { c.lights[1].intensity[2] = 5; }), "1");
  EXPECT_EQ(Changed([](Capture& c) { c.sequences[0].frame_lights[0].push_back("spot1"); }), "0");
  EXPECT_EQ(Changed([](Capture& c) { c.cameras[1].fx = 7; }), "") << "it is held out";
  EXPECT_EQ(Changed([](Capture& c) { c.name = "other"; }), "");
}

}  // namespace
}  // namespace dyxel
