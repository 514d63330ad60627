#include "dyxel/capture/capture.h"

#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/capture/manifest.h"
#include "dyxel/image/image_io.h"
#include "dyxel/image/sampling.h"
#include "dyxel/image/video.h"

namespace dyxel {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The example of capture-format.md, for 40x30 pictures.
constexpr const char* kManifest = R"({
  "format": "dyxel.capture", "version": 1,
  "name": "actor-a", "fps": 25, "up": [0, 0, 1],
  "cameras": [
    {"name": "cam0", "width": 40, "height": 30,
     "fx": 50.0, "fy": 50.0, "cx": 20.0, "cy": 15.0,
     "distortion": [0, 0, 0, 0, 0],
     "rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "translation": [0, 0, 3],
     "color_matrix": [1, 0, 0, 0, 2, 0, 0.5, 0, 1],
     "holdout": false},
    {"name": "cam1", "width": 40, "height": 30,
     "fx": 50.0, "fy": 50.0, "cx": 20.0, "cy": 15.0,
     "rotation": [0, 0, 1, 0, 1, 0, -1, 0, 0], "translation": [0, 0, 3], "holdout": true}
  ],
  "lights": [
    {"name": "spot0", "type": "spot", "position": [2.5, 2.5, 2.6], "direction": [-0.6, -0.6, -0.5],
     "intensity": [90, 88, 84], "cone_inner": 0.30, "cone_outer": 0.42},
    {"name": "bulb", "type": "point", "position": [0, 0, 3], "intensity": [9, 8, 7]},
    {"name": "sun", "type": "directional", "direction": [0, 0, -2], "irradiance": [3, 2, 1]}
  ],
  "sequences": [
    {"name": "res", "kind": "reflectance", "lights": ["spot0", "sun"],
     "first": 5, "count": 3, "white_level": 4095,
     "images": "res/{camera}/{frame:04}.png",
     "background": "background/res/{camera}_{frame}.png", "background_count": 2,
     "masks": "res/{camera}/{frame:04}.mask.png"},
    {"name": "dss", "kind": "dynamic", "count": 2, "allow_missing": true,
     "frame_lights": [["bulb"], ["bulb", "sun"]], "images": "dss/{camera}/{frame}.exr"},
    {"name": "env", "kind": "validation", "count": 1, "transfer": "srgb",
     "environment": {"file": "env/lobby.exr", "rotation": 0.5}, "images": "env/{camera}.png"}
  ]
})";

class CaptureTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("dyxel_capture_") +
               ::testing::UnitTest::GetInstance()->current_test_info()->name() + "_" +
               std::to_string(::getpid()));
    WriteFile(folder_ / "capture.json", kManifest);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
};

ImageU16 Codes(int width, int height, unsigned seed) {
  ImageU16 image(width, height, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = static_cast<std::uint16_t>((i * 97 + seed) % 4096);
  }
  return image;
}

TEST_F(CaptureTest, ReadsTheManifest) {
  const Capture capture = LoadCapture(folder_);
  EXPECT_EQ(capture.name, "actor-a");
  ASSERT_EQ(capture.cameras.size(), 2U);
  EXPECT_EQ(capture.cameras[1].cam_from_world.rotation(0, 2), 1);
  EXPECT_EQ(capture.cameras[0].color_matrix(2, 0), 0.5);
  EXPECT_EQ(capture.FindCamera("cam1"), 1);
  EXPECT_THAT(capture.EstimationCameras(), ElementsAre(0));
  ASSERT_EQ(capture.lights.size(), 3U);
  EXPECT_NEAR(capture.lights[0].direction.norm(), 1, 1e-15);
  EXPECT_EQ(capture.lights[2].direction, Vec3d(0, 0, -1));
  const Sequence& res = capture.FindSequence("res");
  EXPECT_EQ(res.kind, SequenceKind::kReflectance);
  EXPECT_EQ(res.first, 5);
  EXPECT_EQ(capture.LightsOf(res, 2).size(), 2U);
  const Sequence& dss = capture.FindSequence("dss");
  EXPECT_EQ(capture.LightsOf(dss, 0).size(), 1U);
  EXPECT_EQ(capture.LightsOf(dss, 1).at(1).name, "sun");
  EXPECT_EQ(capture.FindSequence("env").environment->rotation, 0.5);
  EXPECT_TRUE(capture.LightsOf(capture.FindSequence("env"), 0).empty());
  try {
    (void)capture.FindSequence("nil");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::kUsage);
    EXPECT_THAT(error.what(), HasSubstr("res, dss, env"));
  }
  EXPECT_THROW((void)capture.FindCamera("nil"), Error);
  // The manifest itself may be named; a missing one is bad input.
  EXPECT_EQ(LoadCapture(folder_ / "capture.json").folder, folder_);
  EXPECT_THROW((void)LoadCapture(folder_ / "nowhere"), Error);
  EXPECT_THROW((void)LoadCapture(folder_, 0), Error);
}

TEST_F(CaptureTest, ManifestRoundTrip) {
  const Capture capture = LoadCapture(folder_);
  WriteManifest(folder_ / "copy", capture);
  const Capture copy = LoadCapture(folder_ / "copy");
  EXPECT_EQ(copy.cameras[0].color_matrix, capture.cameras[0].color_matrix);
  EXPECT_EQ(copy.cameras[1].cam_from_world.rotation, capture.cameras[1].cam_from_world.rotation);
  EXPECT_EQ(copy.lights[0].cone_outer, capture.lights[0].cone_outer);
  EXPECT_TRUE((copy.lights[0].intensity == capture.lights[0].intensity).all());
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(copy.sequences[i].images, capture.sequences[i].images);
    EXPECT_EQ(copy.sequences[i].kind, capture.sequences[i].kind);
    EXPECT_EQ(copy.sequences[i].lights, capture.sequences[i].lights);
    EXPECT_EQ(copy.sequences[i].frame_lights, capture.sequences[i].frame_lights);
    EXPECT_EQ(copy.sequences[i].first, capture.sequences[i].first);
    EXPECT_EQ(copy.sequences[i].white_level, capture.sequences[i].white_level);
    EXPECT_EQ(copy.sequences[i].srgb, capture.sequences[i].srgb);
  }
  EXPECT_EQ(copy.sequences[2].environment->file, "env/lobby.exr");
}

TEST_F(CaptureTest, PicturesBecomeRadiance) {
  const Capture capture = LoadCapture(folder_);
  const Sequence& res = capture.FindSequence("res");
  const ImageU16 codes = Codes(40, 30, 3);
  WritePng(folder_ / "res/cam0/0006.png", codes);
  WritePng(folder_ / "res/cam1/0006.png", codes);
  EXPECT_TRUE(HasFrame(capture, res, 0, 1));
  EXPECT_FALSE(HasFrame(capture, res, 0, 0));
  const Picture plain = ReadFrame(capture, res, 1, 1);
  const Picture picture = ReadFrame(capture, res, 0, 1);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      Vec3f camera_rgb;
      for (int c = 0; c < 3; ++c) {
        camera_rgb[c] = static_cast<float>(codes.At(x, y, c)) / 4095;
        ASSERT_FLOAT_EQ(plain.image.At(x, y, c), camera_rgb[c]);
      }
      ASSERT_FLOAT_EQ(picture.image.At(x, y, 1), 2 * camera_rgb[1]);
      ASSERT_FLOAT_EQ(picture.image.At(x, y, 2), 0.5F * camera_rgb[0] + camera_rgb[2]);
    }
  }
  // A window is a crop.
  const Picture part = ReadFrame(capture, res, 0, 1, Rect{30, -4, 20, 10});
  EXPECT_EQ(part.window, (Rect{30, 0, 10, 6}));
  EXPECT_EQ(part.image.data, Crop(picture.image, part.window).data);
  EXPECT_TRUE(ReadFrame(capture, res, 0, 1, Rect{90, 0, 5, 5}).image.empty());
  // A frame that is not there is an error here, and an empty picture where it is allowed.
  EXPECT_THROW((void)ReadFrame(capture, res, 0, 0), Error);
  EXPECT_TRUE(ReadFrame(capture, capture.FindSequence("dss"), 0, 0).image.empty());
}

TEST_F(CaptureTest, ScaledPicturesAreMeans) {
  const Capture full = LoadCapture(folder_);
  const Capture half = LoadCapture(folder_, 0.5);
  EXPECT_EQ(half.cameras[0].width, 20);
  EXPECT_EQ(half.cameras[0].fx, 25);
  const ImageU16 codes = Codes(40, 30, 3);
  WritePng(folder_ / "res/cam0/0005.png", codes);
  const Sequence& res = full.FindSequence("res");
  const Picture large = ReadFrame(full, res, 0, 0);
  const Picture small = ReadFrame(half, res, 0, 0);
  EXPECT_EQ(small.image.width, 20);
  EXPECT_NEAR(small.image.At(4, 7, 1),
              0.25F * (large.image.At(8, 14, 1) + large.image.At(9, 14, 1) +
                       large.image.At(8, 15, 1) + large.image.At(9, 15, 1)),
              1e-6F);
  const Picture part = ReadFrame(half, res, 0, 0, Rect{3, 2, 5, 4});
  EXPECT_EQ(part.image.data, Crop(small.image, {3, 2, 5, 4}).data);
}

// The matrix halves red and doubles green: neither it nor shrinking hides what was clipped, nor
// makes clipped what was not.
TEST_F(CaptureTest, ClippedPixelsAreKnownBeforeMatrixAndScale) {
  ImageU16 codes(40, 30, 3);
  std::fill(
      codes.data.begin(), codes.data.end(), std::uint16_t{3000});  // green: 1.47 by the matrix
  codes.At(7, 5, 0) = 4095;
  codes.At(8, 5, 1) = 4000;
  WritePng(folder_ / "res/cam0/0005.png", codes);
  Capture capture = LoadCapture(folder_);
  capture.cameras[0].color_matrix(0, 0) = 0.5;
  const Sequence& res = capture.FindSequence("res");
  const Picture stored = ReadFrame(capture, res, 0, 0);
  EXPECT_FLOAT_EQ(stored.image.At(7, 5, 0), 0.5F);
  const Picture marked = ReadFrame(capture, res, 0, 0, Rect{5, 4, 10, 10}, Clipped::kNoValue);
  for (int y = 4; y < 14; ++y) {
    for (int x = 5; x < 15; ++x) {
      for (int c = 0; c < 3; ++c) {
        const float value = marked.image.At(x - 5, y - 4, c);
        if (x == 7 && y == 5) {
          EXPECT_TRUE(std::isnan(value));
        } else {
          EXPECT_EQ(value, stored.image.At(x, y, c));
        }
      }
    }
  }
  const Capture half = LoadCapture(folder_, 0.5);
  const Picture small = ReadFrame(half, res, 0, 0, std::nullopt, Clipped::kNoValue);
  for (int y = 0; y < 15; ++y) {
    for (int x = 0; x < 20; ++x) {
      ASSERT_EQ(std::isnan(small.image.At(x, y, 1)), x == 3 && y == 2) << x << ", " << y;
    }
  }
}

// 8 bits with a smaller white level end at 255; floats have no end.
TEST_F(CaptureTest, WhereClippingBegins) {
  Capture capture = LoadCapture(folder_);
  Sequence sequence = capture.FindSequence("env");
  sequence.white_level = 200;
  ImageU8 codes(40, 30, 3, 210);
  codes.At(1, 1, 0) = 255;
  WritePng(folder_ / "env/cam1.png", codes);
  for (const bool srgb : {false, true}) {
    sequence.srgb = srgb;
    const Picture picture = ReadFrame(capture, sequence, 1, 0, std::nullopt, Clipped::kNoValue);
    EXPECT_TRUE(std::isnan(picture.image.At(1, 1, 2)));
    EXPECT_GT(picture.image.At(0, 1, 0), 1);
  }
  WriteExr(folder_ / "dss/cam1/0.exr", ImageF(40, 30, 3, 9.0F));
  EXPECT_EQ(ReadFrame(capture, capture.FindSequence("dss"), 1, 0, std::nullopt, Clipped::kNoValue)
                .image.At(5, 5),
            9);
}

TEST_F(CaptureTest, SizeMustBeTheCameras) {
  const Capture capture = LoadCapture(folder_);
  WritePng(folder_ / "res/cam0/0005.png", Codes(30, 40, 3));
  for (const double scale : {1.0, 0.5}) {
    try {
      (void)ReadFrame(LoadCapture(folder_, scale), capture.FindSequence("res"), 0, 0);
      FAIL();
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr("0005.png"));
      EXPECT_THAT(error.what(), HasSubstr("is 30x40 pixels, the camera cam0 40x30"));
    }
  }
}

TEST_F(CaptureTest, PlatesMasksTransferAndEnvironment) {
  const Capture capture = LoadCapture(folder_);
  const Sequence& res = capture.FindSequence("res");
  WritePng(folder_ / "background/res/cam1_0.png", Codes(40, 30, 1));
  WritePng(folder_ / "background/res/cam1_1.png", Codes(40, 30, 2));
  const std::vector<ImageF> plates = ReadPlates(capture, res, 1);
  ASSERT_EQ(plates.size(), 2U);
  EXPECT_FLOAT_EQ(plates[1].At(0, 0), 2.0F / 4095);
  EXPECT_TRUE(ReadPlates(capture, capture.FindSequence("dss"), 1).empty());

  ImageU8 mask(40, 30, 1);
  mask.At(3, 4) = 255;
  WritePng(folder_ / "res/cam1/0007.mask.png", mask);
  EXPECT_EQ(ReadGivenMask(capture, res, 1, 2).data, mask.data);
  EXPECT_THROW((void)ReadGivenMask(capture, res, 1, 1), Error);
  EXPECT_TRUE(ReadGivenMask(capture, capture.FindSequence("env"), 1, 0).empty());

  const Sequence& env = capture.FindSequence("env");
  WritePng(folder_ / "env/cam1.png", ImageU8(40, 30, 3, 188));
  EXPECT_NEAR(ReadFrame(capture, env, 1, 0).image.At(7, 7), 0.5028865F, 1e-6F);

  ImageF sky(64, 32, 3, 0.5F);
  sky.At(32, 16, 0) = -1;
  WriteExr(folder_ / "env/lobby.exr", sky);
  const Environment environment = LoadEnvironment(capture, *env.environment);
  EXPECT_EQ(environment.rotation, 0.5);
  EXPECT_EQ(environment.radiance.At(32, 16, 0), 0);
  EXPECT_EQ(environment.radiance.At(31, 16, 0), 0.5F);
}

TEST_F(CaptureTest, ExrFramesFromManyThreads) {
  const Capture capture = LoadCapture(folder_);
  const Sequence& dss = capture.FindSequence("dss");
  ImageF image(40, 30, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = static_cast<float>(i % 2048);
  }
  WriteExr(folder_ / "dss/cam1/0.exr", image);
  WriteExr(folder_ / "dss/cam1/1.exr", image);
  std::vector<int> good(64);
  ParallelFor(good.size(), [&](std::size_t i) {
    good[i] = ReadFrame(capture, dss, 1, static_cast<int>(i % 2)).image.data == image.data;
  });
  EXPECT_THAT(good, ::testing::Each(1));
}

// One video a camera: frames by number from `first`, sRGB undone, and shrunk like any picture.
TEST_F(CaptureTest, Videos) {
  if (std::system("ffmpeg -version >/dev/null 2>&1") != 0) GTEST_SKIP() << "no ffmpeg";
  Capture capture = LoadCapture(folder_);
  Sequence sequence;
  sequence.name = "dss";
  sequence.first = 2;
  sequence.count = 3;
  sequence.images = "{camera}.mp4";
  sequence.srgb = true;
  {
    VideoWriter writer(folder_ / "cam1.mp4", 40, 30, 25);
    for (int i = 0; i < 5; ++i) {
      writer.Add(ImageU8(40, 30, 3, static_cast<std::uint8_t>(60 + 20 * i)));
    }
    writer.Finish();
  }
  EXPECT_TRUE(IsVideo(sequence));
  EXPECT_TRUE(HasFrame(capture, sequence, 1, 0));
  for (const int frame : {2, 0, 1}) {
    const float expected = LinearFromSrgb(static_cast<float>(100 + 20 * frame) / 255);
    EXPECT_NEAR(ReadFrame(capture, sequence, 1, frame).image.At(20, 15, 1), expected, 0.02F);
    const Capture half = LoadCapture(folder_, 0.5);
    const Picture part = ReadFrame(half, sequence, 1, frame, Rect{4, 5, 6, 7});
    EXPECT_EQ(part.window, (Rect{4, 5, 6, 7}));
    EXPECT_NEAR(part.image.At(3, 3, 1), expected, 0.02F);
  }
  // A white level of 8 bits counts in 8 bits.
  sequence.white_level = 127.5;
  sequence.srgb = false;
  EXPECT_NEAR(ReadFrame(capture, sequence, 1, 0).image.At(20, 15, 1), 200.0F / 255, 0.03F);
  EXPECT_THROW((void)ReadFrame(capture, sequence, 1, 3), Error);
  EXPECT_THROW((void)ReadFrame(capture, sequence, 0, 0), Error);
  CloseVideos();
}

TEST_F(CaptureTest, TheFirstMistakeIsThrown) {
  std::string text = kManifest;
  text.replace(text.find("holdout"), 7, "holdot ");
  WriteFile(folder_ / "capture.json", text);
  try {
    (void)LoadCapture(folder_);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::kInput);
    EXPECT_THAT(error.what(), HasSubstr("cameras[0] (cam0).holdot"));
    EXPECT_THAT(error.what(), HasSubstr("\"holdout\""));
  }
}

}  // namespace
}  // namespace dyxel
