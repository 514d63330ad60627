#include "dyxel/texture/texture_files.h"

#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "dyxel/base/error.h"
#include "dyxel/base/random.h"
#include "dyxel/texture/test_tubes.h"

namespace dyxel {
namespace {

class TextureFilesTest : public testing::Test {
 protected:
  TextureFilesTest() : scene_(MakeTubeScene(256)), grid_(MakeTexelGrid(scene_.atlas)) {
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("dyxel_textures_") +
               testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
  }
  ~TextureFilesTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] MvvTextures Noise(std::uint64_t seed, std::size_t lights) const {
    Random random(seed);
    MvvTextures textures;
    textures.radiance.assign(2, std::vector<float>(3 * grid_.count()));
    textures.weight.assign(2, std::vector<float>(grid_.count()));
    textures.light_visibility.assign(lights, std::vector<float>(grid_.count()));
    for (auto* group : {&textures.radiance, &textures.weight, &textures.light_visibility}) {
      for (std::vector<float>& values : *group) {
        for (float& v : values) v = random.Uniform();
        for (std::size_t i = 0; i < values.size(); i += 3) values[i] = 0;
      }
    }
    return textures;
  }

  std::filesystem::path folder_;
  TubeScene scene_;
  TexelGrid grid_;
  std::vector<std::string> names_ = {"cam0", "cam1"};
};

constexpr float kHalf = 1.0F / 2048;  // relative precision

TEST_F(TextureFilesTest, AnyRunOfTexelsComesBack) {
  const MvvTextures textures = Noise(1, 3);
  WriteMvvTextures(folder_, names_, grid_, textures);
  for (const auto& file : MvvTextureFiles(folder_, names_)) {
    EXPECT_TRUE(std::filesystem::exists(file)) << file;
  }
  const int count = static_cast<int>(grid_.count());
  for (const auto& [begin, end] :
       std::vector<std::array<int, 2>>{{0, count}, {1234, 5678}, {count - 1, count}, {7, 7}}) {
    const MvvTextures back = ReadMvvTextures(folder_, names_, 3, grid_, begin, end);
    for (int k = begin; k < end; ++k) {
      const auto from = static_cast<std::size_t>(k);
      const auto to = static_cast<std::size_t>(k - begin);
      for (std::size_t c = 0; c < 2; ++c) {
        ASSERT_NEAR(back.weight[c][to], textures.weight[c][from], kHalf);
        ASSERT_NEAR(back.radiance[c][3 * to + 2], textures.radiance[c][3 * from + 2], kHalf);
      }
      ASSERT_NEAR(back.light_visibility[2][to], textures.light_visibility[2][from], kHalf);
    }
  }
}

TEST_F(TextureFilesTest, MissingFileOrOtherSizeIsAnErrorThatNamesIt) {
  EXPECT_THROW(static_cast<void>(ReadMvvTextures(folder_, names_, 1, grid_, 0, 9)), Error);
  WriteMvvTextures(folder_, names_, grid_, Noise(1, 1));
  Atlas other = scene_.atlas;
  other.size = 128;
  const TexelGrid small = MakeTexelGrid(other);
  EXPECT_THROW(static_cast<void>(ReadMvvTextures(folder_, names_, 1, small, 0, 9)), Error);
}

TEST_F(TextureFilesTest, SourceGivesEveryTexelOnceWithTheSamplesOfAllSteps) {
  std::vector<Camera> cameras = {MakeTubeCamera({4, 0, 1}, 100), MakeTubeCamera({0, 4, 1}, 100)};
  cameras[0].name = "cam0";
  cameras[1].name = "cam1";
  Light lamp;
  lamp.position = {3, 3, 3};
  lamp.intensity = Rgb::Constant(5);
  std::vector<DyxelStep> steps;
  std::vector<MvvTextures> textures;
  for (int f = 0; f < 2; ++f) {
    DyxelStep step;
    step.folder = folder_ / std::to_string(f);
    std::vector<Vec3f> turned = scene_.skin.positions;
    for (Vec3f& x : turned) x = Vec3f(x.y(), -x.x(), x.z() + static_cast<float>(f));
    step.surface = PoseSurface(scene_.atlas, scene_.skin.triangles, turned);
    step.lights.assign(static_cast<std::size_t>(f + 1), lamp);  // one, then two
    textures.push_back(Noise(static_cast<std::uint64_t>(f), step.lights.size()));
    WriteMvvTextures(step.folder, names_, grid_, textures.back());
    steps.push_back(step);
  }
  const DyxelSource source = MakeDyxelSource(scene_.atlas, grid_, cameras, steps);
  ASSERT_GT(source.num_tiles(), 1);
  EXPECT_EQ(source.num_texels, static_cast<int>(grid_.count()));
  EXPECT_EQ(source.tile_begin.front(), 0);
  EXPECT_EQ(source.tile_begin.back(), source.num_texels);
  for (int i = 0; i < source.num_tiles(); ++i) {
    const DyxelTile tile = source.load(i);
    ASSERT_EQ(tile.first_texel, source.tile_begin[static_cast<std::size_t>(i)]);
    ASSERT_EQ(tile.texels, source.tile_begin[static_cast<std::size_t>(i) + 1] - tile.first_texel);
    ASSERT_EQ(tile.frames, 2);
    ASSERT_EQ(tile.lights, 2);
    DyxelTile expected;
    expected.Resize(tile.texels, 2, 2, 2);
    expected.first_texel = tile.first_texel;
    for (int f = 0; f < 2; ++f) {
      const auto at = static_cast<std::size_t>(f);
      FillDyxelFrame(scene_.atlas,
                     grid_,
                     steps[at].surface,
                     cameras,
                     steps[at].lights,
                     textures[at],
                     0,
                     f,
                     expected);
    }
    ASSERT_EQ(tile.view_dir, expected.view_dir);
    ASSERT_EQ(tile.light_dir, expected.light_dir);
    for (std::size_t s = 0; s < tile.radiance.size(); ++s) {
      ASSERT_NEAR(tile.radiance[s], expected.radiance[s], kHalf);
    }
    for (std::size_t s = 0; s < tile.weight.size(); ++s) {
      ASSERT_NEAR(tile.weight[s], expected.weight[s], kHalf);
    }
    for (std::size_t s = 0; s < tile.irradiance.size(); ++s) {
      ASSERT_NEAR(tile.irradiance[s], expected.irradiance[s], 5 * kHalf);
    }
    // The second time from memory: the same, also without the files.
    if (i == 0) std::filesystem::rename(folder_, folder_.string() + "_gone");
    const DyxelTile again = source.load(i);
    if (i == 0) std::filesystem::rename(folder_.string() + "_gone", folder_);
    ASSERT_EQ(again.radiance, tile.radiance);
    ASSERT_EQ(again.weight, tile.weight);
    ASSERT_EQ(again.irradiance, tile.irradiance);
    ASSERT_EQ(again.view_dir, tile.view_dir);
  }
}

// A tile is held by every thread: its size does not grow with the sequence.
TEST_F(TextureFilesTest, LongSequencesComeInSmallerTiles) {
  const std::vector<Camera> cameras(8);
  const auto largest = [&](std::size_t frames) {
    DyxelStep step;
    step.lights.resize(2);
    const DyxelSource source =
        MakeDyxelSource(scene_.atlas, grid_, cameras, std::vector<DyxelStep>(frames, step));
    EXPECT_EQ(source.tile_begin.back(), source.num_texels);
    int texels = 0;
    for (std::size_t i = 1; i < source.tile_begin.size(); ++i) {
      texels = std::max(texels, source.tile_begin[i] - source.tile_begin[i - 1]);
    }
    return texels;
  };
  const std::size_t sample_floats = 2 * 6 + 8 * 7;
  EXPECT_GE(largest(36), 16384);
  EXPECT_LE(largest(36), 16384 + 256);
  for (const std::size_t frames : {150U, 600U}) {
    const std::size_t full = (std::size_t{192} << 20U) / (frames * sample_floats * sizeof(float));
    EXPECT_LE(largest(frames), static_cast<int>(full) + 256);  // whole rows
    EXPECT_GE(largest(frames), static_cast<int>(full));
  }
}

}  // namespace
}  // namespace dyxel
