#include "dyxel/capture/check.h"

#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/image/image_io.h"
#include "dyxel/image/video.h"

namespace dyxel {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Json = nlohmann::json;

// A camera 3 m from the origin that looks at the point 1 m above it.
Json CameraJson(const std::string& name, double azimuth) {
  const Vec3d centre(3 * std::cos(azimuth), 3 * std::sin(azimuth), 1.4);
  const Vec3d z = (Vec3d(0, 0, 1) - centre).normalized();
  const Vec3d x = z.cross(Vec3d::UnitZ()).normalized();
  Mat3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Vec3d translation = -rotation * centre;
  Json json = {{"name", name},
               {"width", 24},
               {"height", 16},
               {"fx", 20.0},
               {"fy", 20.0},
               {"cx", 12.0},
               {"cy", 8.0}};
  for (int i = 0; i < 9; ++i) json["rotation"].push_back(rotation(i / 3, i % 3));
  for (int i = 0; i < 3; ++i) json["translation"].push_back(translation[i]);
  return json;
}

class Check : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("dyxel_check_") +
               ::testing::UnitTest::GetInstance()->current_test_info()->name() + "_" +
               std::to_string(::getpid()));
    manifest_ = Json::parse(R"({
      "format": "dyxel.capture", "version": 1, "name": "small", "fps": 25, "up": [0, 0, 1],
      "lights": [
        {"name": "key", "type": "spot", "position": [2.5, 2, 2.6], "direction": [-2.5, -2, -1.6],
         "intensity": [40, 40, 40], "cone_inner": 0.3, "cone_outer": 0.4},
        {"name": "fill", "type": "point", "position": [-2, 2, 2], "intensity": [5, 5, 5]}],
      "sequences": [
        {"name": "res", "kind": "reflectance", "first": 2, "count": 3, "lights": ["key", "fill"],
         "images": "res/{camera}/{frame:04}.png", "background": "plates/{camera}.png"},
        {"name": "dss", "kind": "dynamic", "first": 0, "count": 3,
         "environment": {"file": "sky.exr", "rotation": 0.1},
         "images": "dss/{camera}/{frame}.exr", "masks": "dss/{camera}/{frame}.mask.png"}]})");
    manifest_["cameras"] = {CameraJson("cam0", 0.1), CameraJson("cam1", 1.6)};
    for (const std::string camera : {"cam0", "cam1"}) {
      for (int frame = 0; frame < 3; ++frame) {
        ImageU8 image(24, 16, 3);
        ImageF radiance(24, 16, 3);
        for (std::size_t i = 0; i < image.data.size(); ++i) {
          image.data[i] = static_cast<std::uint8_t>(40 + 20 * frame + static_cast<int>(i % 100));
          radiance.data[i] = 0.01F * image.data[i];
        }
        WritePng(folder_ / "res" / camera / ("000" + std::to_string(frame + 2) + ".png"), image);
        WriteExr(folder_ / "dss" / camera / (std::to_string(frame) + ".exr"), radiance);
        ImageU8 mask(24, 16, 1);
        mask.At(5, 5) = 255;
        WritePng(folder_ / "dss" / camera / (std::to_string(frame) + ".mask.png"), mask);
      }
      WritePng(folder_ / "plates" / (camera + ".png"), ImageU8(24, 16, 3, 30));
    }
    WriteExr(folder_ / "sky.exr", ImageF(16, 8, 3, 0.5F));
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  CheckReport Run() {
    WriteFile(folder_ / "capture.json", manifest_.dump());
    return CheckCapture(folder_);
  }
  // Checks that a report names just that fault: one item with these words in it.
  void ExpectItem(const std::string& file,
                  const std::string& what,
                  Severity severity = Severity::kError) {
    const CheckReport report = Run();
    ASSERT_EQ(report.items.size(), 1U) << FormatCheckReport(report);
    EXPECT_EQ(report.items[0].severity, severity);
    EXPECT_THAT(report.items[0].file, HasSubstr(file));
    EXPECT_THAT(report.items[0].what, HasSubstr(what));
    EXPECT_FALSE(report.items[0].mend.empty());
  }

  Json& Camera0() { return manifest_["cameras"][0]; }
  Json& Res() { return manifest_["sequences"][0]; }
  Json& Dss() { return manifest_["sequences"][1]; }

  std::filesystem::path folder_;
  Json manifest_;
};

TEST_F(Check, AGoodCaptureHasNothingWrong) {
  double last = 0;
  WriteFile(folder_ / "capture.json", manifest_.dump());
  const CheckReport report =
      CheckCapture(folder_, [&](double share) { last = std::max(last, share); });
  EXPECT_THAT(report.items, IsEmpty()) << FormatCheckReport(report);
  EXPECT_EQ(last, 1);
  EXPECT_LT((report.centre - Vec3d(0, 0, 1)).norm(), 1e-9);
  ASSERT_EQ(report.sequences.size(), 2U);
  EXPECT_EQ(report.sequences[0].pictures, 6);
  EXPECT_EQ(report.sequences[0].lighting, "key, fill");
  EXPECT_EQ(report.sequences[0].silhouette, "plate");
  EXPECT_EQ(report.sequences[1].silhouette, "masks");
  // Values 60 … 159 of the middle frame: the 99.5th percentile is near 159 / 255.
  EXPECT_NEAR(report.sequences[0].exposure, 159.0 / 255, 0.01);
  EXPECT_NEAR(report.sequences[1].exposure_max, 1.79, 0.02);
  EXPECT_EQ(report.sequences[0].saturated, 0);
  const std::string text = FormatCheckReport(report);
  EXPECT_THAT(text, HasSubstr("Nothing is wrong"));
  EXPECT_THAT(text, HasSubstr("cam1"));
  const Json json = Json::parse(CheckReportJson(report));
  EXPECT_EQ(json["errors"], 0);
  EXPECT_EQ(json["cameras"].size(), 2U);
  EXPECT_EQ(json["sequences"][1]["pictures"], 6);
}

TEST_F(Check, MissingAndSurplusFrames) {
  std::filesystem::remove(folder_ / "res/cam1/0003.png");
  ExpectItem("res/cam1/{frame:04}.png", "1 of 3 frames are missing: 3");
  Res()["allow_missing"] = true;
  EXPECT_THAT(Run().items, IsEmpty());
  Res()["allow_missing"] = false;
  std::filesystem::remove_all(folder_ / "res/cam1");
  ExpectItem("res/cam1", "not one of the 3 frames");
}

TEST_F(Check, FirstAndCountAgainstTheFiles) {
  Res()["first"] = 3;
  Res()["count"] = 1;
  const CheckReport report = Run();
  ASSERT_EQ(report.items.size(), 2U);  // both cameras
  EXPECT_EQ(report.items[0].severity, Severity::kWarning);
  EXPECT_THAT(report.items[0].what, HasSubstr("2 more frames are there"));
  Res()["count"] = 999999;
  EXPECT_THAT(Run().items.at(0).what, HasSubstr("999997 of 999999 frames are missing: 5-1000001"));
}

TEST_F(Check, TruncatedPicture) {
  std::filesystem::resize_file(folder_ / "res/cam0/0004.png", 60);
  ExpectItem("res/cam0/0004.png", "no readable PNG");
}

TEST_F(Check, TruncatedExr) {
  const auto file = folder_ / "dss/cam0/1.exr";
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 40);
  ExpectItem("dss/cam0/1.exr", "damaged or incomplete");
}

TEST_F(Check, WrongSizes) {
  WritePng(folder_ / "res/cam0/0003.png", ImageU8(16, 24, 3, 9));
  ExpectItem("res/cam0/0003.png", "is 16x24 pixels, the camera cam0 24x16");
}
TEST_F(Check, PlateOfAnotherSize) {
  WritePng(folder_ / "plates/cam1.png", ImageU8(16, 24, 3, 9));
  ExpectItem("plates/cam1.png", "is 16x24 pixels");
}
TEST_F(Check, PlateMissing) {
  std::filesystem::remove(folder_ / "plates/cam1.png");
  ExpectItem("plates/cam1.png", "no such file");
}
TEST_F(Check, MaskOfAnotherSize) {
  WritePng(folder_ / "dss/cam1/0.mask.png", ImageU8(16, 24, 1, 255));
  ExpectItem("dss/cam1/0.mask.png", "is 16x24 pixels");
}
TEST_F(Check, MaskMissing) {
  std::filesystem::remove(folder_ / "dss/cam1/0.mask.png");
  ExpectItem("dss/cam1/{frame}.mask.png", "1 frames have no mask: 0");
}
TEST_F(Check, MaskEmpty) {
  WritePng(folder_ / "dss/cam1/0.mask.png", ImageU8(24, 16, 1, 0));
  ExpectItem("dss/cam1/0.mask.png", "no pixel", Severity::kWarning);
}
TEST_F(Check, EnvironmentMissing) {
  std::filesystem::remove(folder_ / "sky.exr");
  ExpectItem("sky.exr", "no such file");
}

TEST_F(Check, EnvironmentWithoutNumbers) {
  ImageF sky(16, 8, 3, 0.5F);
  sky.At(3, 3, 1) = std::numeric_limits<float>::quiet_NaN();
  sky.At(4, 3, 1) = std::numeric_limits<float>::infinity();
  WriteExr(folder_ / "sky.exr", sky, {}, ExrType::kFloat);
  ExpectItem("sky.exr", "0.521 % of its values are not finite");
}

TEST_F(Check, ReflectanceWithoutLamps) {
  Res()["lights"] = Json::array();
  ExpectItem("capture.json", "\"res\" names neither lights nor", Severity::kWarning);
  Res().erase("lights");
  Res()["frame_lights"] = {Json::array(), Json::array(), Json::array()};
  ExpectItem("capture.json", "\"res\" names neither lights nor", Severity::kWarning);
  Res().erase("frame_lights");
  Res()["environment"] = {{"file", "sky.exr"}};
  ExpectItem("capture.json", "\"reflectance\" and lit by an environment", Severity::kWarning);
  Res()["kind"] = "validation";
  ExpectItem("capture.json", "no sequence is of kind \"reflectance\"", Severity::kWarning);
  EXPECT_EQ(Run().items[0].mend, "Without one it can be tracked, and no more");
}

TEST_F(Check, NotFinite) {
  ImageF image(24, 16, 3, 0.5F);
  image.At(3, 3, 1) = std::numeric_limits<float>::quiet_NaN();
  image.At(4, 3, 1) = std::numeric_limits<float>::infinity();
  WriteExr(folder_ / "dss/cam0/2.exr", image, {}, ExrType::kFloat);
  ExpectItem("dss/cam0/2.exr", "0.521 % of its pixels");
}

TEST_F(Check, Saturated) {
  ImageU8 image(24, 16, 3, 100);
  std::fill_n(image.data.begin(), 3 * 24 * 4, std::uint8_t{255});
  WritePng(folder_ / "res/cam0/0003.png", image);
  ExpectItem("res/cam0", "8.3 % of the pixels are saturated", Severity::kWarning);
  EXPECT_NEAR(Run().sequences[0].saturated, 0.25 / 6, 1e-6);
}

TEST_F(Check, Videos) {
  if (std::system("ffmpeg -version >/dev/null 2>&1") != 0) GTEST_SKIP() << "no ffmpeg";
  for (const std::string camera : {"cam0", "cam1"}) {
    VideoWriter writer(folder_ / (camera + ".mp4"), 24, 16, 25);
    for (int i = 0; i < 4; ++i) {
      writer.Add(ImageU8(24, 16, 3, static_cast<std::uint8_t>(60 + 40 * i)));
    }
    writer.Finish();
  }
  Res()["images"] = "{camera}.mp4";
  Res()["first"] = 1;
  const CheckReport report = Run();
  EXPECT_THAT(report.items, IsEmpty()) << FormatCheckReport(report);
  EXPECT_EQ(report.sequences[0].pictures, 6);
  EXPECT_NEAR(report.sequences[0].exposure, 140.0 / 255, 0.02);
  Res()["count"] = 2;
  EXPECT_THAT(Run().items.at(0).what, HasSubstr("1 more frames are there"));
  EXPECT_EQ(Run().items.at(0).severity, Severity::kWarning);
  Res()["count"] = 3;
  Res()["first"] = 2;
  EXPECT_THAT(Run().items.at(0).what, HasSubstr("has 4 frames; first = 2 and count = 3 need 5"));
  Res()["first"] = 1;
  Camera0()["width"] = 25;
  EXPECT_THAT(FormatCheckReport(Run()), HasSubstr("cam0.mp4: is 24x16 pixels, the camera cam0 25"));
  Camera0()["width"] = 24;
  std::filesystem::remove(folder_ / "cam1.mp4");
  ExpectItem("cam1.mp4", "no such file");
  CloseVideos();
}

TEST_F(Check, TheSameFrameTwiceAndBlackFrames) {
  std::filesystem::copy_file(folder_ / "res/cam0/0003.png",
                             folder_ / "res/cam0/0004.png",
                             std::filesystem::copy_options::overwrite_existing);
  ExpectItem("res/cam0", "1 frames are the same", Severity::kWarning);
  WritePng(folder_ / "res/cam0/0004.png", ImageU8(24, 16, 3, 0));
  ExpectItem("res/cam0", "1 frames are black", Severity::kWarning);
}

TEST_F(Check, Rotations) {
  Json& rotation = Camera0()["rotation"];
  const Json good = rotation;
  rotation[0] = rotation[0].get<double>() + 0.1;
  ExpectItem("capture.json", "is no rotation");
  rotation = good;
  for (int i = 0; i < 3; ++i) rotation[i] = -rotation[i].get<double>();
  ExpectItem("capture.json", "determinant is -1");
}

TEST_F(Check, LightsAndCamerasInsideThePerson) {
  manifest_["lights"][1]["position"] = {0.2, 0.3, 1.5};
  ExpectItem("capture.json", "the light fill is inside the person");
  manifest_["lights"][1]["position"] = {0.2, 0.3, 2.5};  // above
  EXPECT_THAT(Run().items, IsEmpty());
  manifest_["lights"][0]["direction"] = {1, 0, 0};
  ExpectItem("capture.json", "the cone of key misses the person", Severity::kWarning);
}

// One bad entry does not hide what is wrong with the others.
TEST_F(Check, AllMistakesAtOnce) {
  manifest_["cameras"].push_back(CameraJson("cam2", 2));
  manifest_["cameras"][2]["rotation"][0] = 1.9;
  manifest_["cameras"][2]["hold_out"] = true;
  manifest_["lights"][1]["position"] = {0.2, 0.3, 1.5};
  manifest_["lights"][0]["intensity"] = "bright";
  manifest_["fsp"] = 25;
  const CheckReport report = Run();
  EXPECT_LT((report.centre - Vec3d(0, 0, 1)).norm(), 1e-9);
  const std::string text = FormatCheckReport(report);
  for (const char* words : {"is no rotation",
                            "cam2).hold_out is no known key",
                            "the light fill is inside the person",
                            "intensity is \"bright\"",
                            "fsp is no known key"}) {
    EXPECT_THAT(text, HasSubstr(words));
  }
}

TEST_F(Check, UnitsAndCopies) {
  for (Json& camera : manifest_["cameras"]) {
    for (Json& value : camera["translation"]) value = 1000 * value.get<double>();
  }
  EXPECT_THAT(Run().items.at(0).mend, HasSubstr("not millimetres"));
  manifest_["cameras"] = {CameraJson("cam0", 0.1), CameraJson("cam1", 0.1), CameraJson("cam2", 2)};
  const std::string text = FormatCheckReport(Run());
  EXPECT_THAT(text, HasSubstr("cameras cam0 and cam1 stand at the same place"));
}

// Every change to the manifest below gives at least one item with these words, and no crash.
TEST_F(Check, HostileManifests) {
  const Json good = manifest_;
  struct Case {
    const char* pointer;
    Json value;
    const char* words;
  };
  const std::vector<Case> cases = {
      {"/format", "dyxel.project", "format is"},
      {"/version", 2, "version is 2"},
      {"/version", 1.5, "not a whole number"},
      {"/cameras", Json::array(), "cameras is empty"},
      {"/cameras", 7, "cameras is 7"},
      {"/cameras/0", "cam", "not an object"},
      {"/cameras/0/name", 3, "name is 3, not a text"},
      {"/cameras/0/name", "a/b", "can't be a name"},
      {"/cameras/0/name", "cam1", "given twice"},
      {"/cameras/0/width", 1e18, "is not in"},
      {"/cameras/0/width", -5, "is not in"},
      {"/cameras/0/fx", "wide", "not a number"},
      {"/cameras/0/rotation", {1, 2, 3}, "not a list of 9 numbers"},
      {"/cameras/0/rotation", {1, 0, 0, 0, 1, 0, 0, 0, "1"}, "rotation[8]"},
      {"/cameras/0/distortion", {1, 2}, "not a list of 5"},
      {"/cameras/0/color_matrix", {0, 0, 0, 0, 0, 0, 0, 0, 0}, "can't be inverted"},
      {"/cameras/0/hold_out", true, "Write \"holdout\""},
      {"/cameras/0/serial_number", "x", "left out"},
      {"/up", {0, 0, 0}, "no length"},
      {"/fps", -3, "is not in"},
      {"/lights/0/type", "laser", "laser"},
      {"/lights/0/intensity", {1, -1, 1}, "intensity[1] is -1"},
      {"/lights/0/intensity", {0, 0, 0}, "is black"},
      {"/lights/0/direction", {0, 0, 0}, "no length"},
      {"/lights/0/cone_inner", 0.5, "is wider than cone_outer"},
      {"/lights/1/name", "key", "given twice"},
      {"/sequences/0/lights", {"kex"}, "Write \"key\""},
      {"/sequences/0/lights", {5}, "not a text"},
      {"/sequences/0/lights", "key", "not a list"},
      {"/sequences/0/lights", Json::array(), "neither lights nor an environment"},
      {"/sequences/0/kind", "reflection", "write reflectance, dynamic or validation"},
      {"/sequences/0/count", 0, "is not in"},
      {"/sequences/0/count", 1e300, "is not in"},
      {"/sequences/0/count", "three", "not a number"},
      {"/sequences/0/images", "res/{frame:04}.png", "same for all cameras"},
      {"/sequences/0/images", "res/{cam}/{frame}.png", "field {cam}"},
      {"/sequences/0/images", "res/{camera", "has a field"},
      {"/sequences/0/images", "res/{camera}/one.png", "one picture for 3 frames"},
      {"/sequences/0/images", 12, "not a text"},
      {"/sequences/0/background", "", "neither background nor masks"},
      {"/sequences/0/background_count", 4, "background_count = 4"},
      {"/sequences/0/frame_lights", {{"key"}, {"key"}}, "not a list of 3"},
      {"/sequences/0/frame_lights", {{"key"}, {"kez"}, {"key"}}, "frame_lights[1]"},
      {"/sequences/0/environment", {{"file", "sky.exr"}}, "stands beside lights"},
      {"/sequences/1/environment", {{"flie", "sky.exr"}}, "Write \"file\""},
      {"/sequences/1/environment", {{"file", 3}}, "not a text"},
      {"/sequences/0/transfer", "gamma", "linear or srgb"},
      {"/sequences/0/white_level", 0, "is not in"},
      {"/sequences/0/allow_missing", 1, "not true or false"},
      {"/sequences/1/name", "res", "given twice"},
      {"/sequences", nullptr, "sequences is null"},
  };
  for (const Case& c : cases) {
    manifest_ = good;
    manifest_[Json::json_pointer(c.pointer)] = c.value;
    const CheckReport report = Run();
    std::string all;
    for (const CheckItem& item : report.items) all += item.what + " " + item.mend + "\n";
    // The words may begin a sentence.
    std::string words = c.words;
    const bool found = all.find(words) != std::string::npos ||
                       all.find(std::string(1, static_cast<char>(std::toupper(words[0]))) +
                                words.substr(1)) != std::string::npos;
    EXPECT_TRUE(found) << c.pointer << " = " << c.value << " gives:\n" << all;
    EXPECT_FALSE(FormatCheckReport(report).empty());
    EXPECT_TRUE(Json::accept(CheckReportJson(report)));
  }
  // Every required key removed, at any depth: an item each, no crash.
  const Json leaves = good.flatten();
  for (const auto& flat : leaves.items()) {
    manifest_ = good;
    const Json::json_pointer pointer(flat.key());
    Json& parent = manifest_[pointer.parent_pointer()];
    if (parent.is_object()) parent.erase(pointer.back());
    EXPECT_NO_THROW((void)FormatCheckReport(Run())) << flat.key();
  }
}

TEST_F(Check, NoManifestAtAll) {
  std::filesystem::remove_all(folder_ / "capture.json");
  EXPECT_THAT(CheckCapture(folder_).items.at(0).what, HasSubstr("no such file"));
  for (const std::string& text : {std::string("{\"format\": "),
                                  std::string(""),
                                  std::string("[[["),
                                  std::string("\xff\xfe{}"),
                                  std::string("{\"fps\": 1e999}"),
                                  std::string(200000, '[')}) {
    WriteFile(folder_ / "capture.json", text);
    EXPECT_THAT(CheckCapture(folder_).items.at(0).what, HasSubstr("no JSON"));
  }
  // Well-formed, and nested a hundred thousand deep where a number belongs.
  manifest_["fps"] = "DEEP";
  std::string text = manifest_.dump();
  text.replace(text.find("\"DEEP\""), 6, std::string(100000, '[') + "1" + std::string(100000, ']'));
  WriteFile(folder_ / "capture.json", text);
  EXPECT_THAT(CheckCapture(folder_).items.at(0).what, HasSubstr("fps is a list of 1"));
}

TEST(CheckInternals, RangesAndGaps) {
  EXPECT_EQ(internal::Ranges({3, 7, 8, 9}), "3, 7-9");
  EXPECT_EQ(internal::Gaps({1, 2, 5}, 10, 8), "10, 13-14, 16-17");
  EXPECT_EQ(internal::Gaps({}, 10, 3), "10-12");
  EXPECT_EQ(internal::Gaps({0, 1}, 0, 2), "");
}

TEST(CheckInternals, AxesMeet) {
  // Three cameras whose axes go through (1, 2, 3).
  std::vector<Camera> cameras(3);
  for (int i = 0; i < 3; ++i) {
    const Mat3d rotation =
        Eigen::AngleAxisd(0.9 * i + 0.2, Vec3d(1, i, 0.3).normalized()).toRotationMatrix();
    cameras[static_cast<std::size_t>(i)].cam_from_world = {
        rotation, Vec3d(0, 0, 2.0 + i) - rotation * Vec3d(1, 2, 3)};
  }
  Vec3d point;
  ASSERT_TRUE(internal::MeetingPoint(cameras, point));
  EXPECT_LT((point - Vec3d(1, 2, 3)).norm(), 1e-9);
  cameras.resize(1);
  EXPECT_FALSE(internal::MeetingPoint(cameras, point));
}

}  // namespace
}  // namespace dyxel
