#include "dyxel/texture/mvv_textures.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "dyxel/base/parallel.h"
#include "dyxel/texture/blend.h"
#include "dyxel/texture/test_tubes.h"

namespace dyxel {
namespace {

Light PointLight(const Vec3d& position) {
  Light light;
  light.type = LightType::kPoint;
  light.position = position;
  light.intensity = Rgb(10, 20, 30);
  return light;
}

class MvvTexturesTest : public testing::Test {
 protected:
  MvvTexturesTest()
      : scene_(MakeTubeScene(256)),
        grid_(MakeTexelGrid(scene_.atlas)),
        surface_(PoseSurface(scene_.atlas, scene_.skin.triangles, scene_.skin.positions)) {}

  // Square pictures of the tubes, `size` pixels a side.
  [[nodiscard]] static std::vector<Picture> TakePictures(const std::vector<Camera>& cameras,
                                                         int size) {
    std::vector<Picture> pictures;
    pictures.reserve(cameras.size());
    for (const Camera& camera : cameras)
      pictures.push_back(TakePicture(camera, {0, 0, size, size}));
    return pictures;
  }
  [[nodiscard]] MvvTextures Make(const std::vector<Camera>& cameras,
                                 const std::vector<Picture>& pictures,
                                 const std::vector<Light>& lights,
                                 const TextureOptions& options = {}) const {
    return MakeMvvTextures(scene_.atlas, grid_, surface_, cameras, pictures, lights, options);
  }
  [[nodiscard]] bool IsThin(std::size_t k) const {
    const Triangle& t = scene_.atlas.triangles[static_cast<std::size_t>(grid_.triangle[k])];
    return scene_.thin[static_cast<std::size_t>(t[0])] != 0;
  }
  // The texel's point on the exact cylinder, and its normal.
  [[nodiscard]] Vec3f Point(std::size_t k, Vec3f* normal) const {
    const Triangle& t = scene_.atlas.triangles[static_cast<std::size_t>(grid_.triangle[k])];
    Vec3f x = Vec3f::Zero();
    for (std::size_t c = 0; c < 3; ++c) {
      x += grid_.bary[k][static_cast<int>(c)] * surface_.positions[static_cast<std::size_t>(t[c])];
    }
    const Cylinder& tube = IsThin(k) ? kThinTube : kBigTube;
    const Vec2f out = (x.head<2>() - tube.centre).normalized();
    *normal = Vec3f(out.x(), out.y(), 0);
    x.head<2>() = tube.centre + tube.radius * out;
    return x;
  }
  // Distance (metres) by which the segment from x to `eye` clears the other tube's outline;
  // negative where that tube blocks it, far positive where it is not near.
  [[nodiscard]] float Clearance(std::size_t k, const Vec3f& x, const Vec3f& eye) const {
    const Cylinder& other = IsThin(k) ? kBigTube : kThinTube;
    const Vec2f from = x.head<2>();
    const Vec2f to = eye.head<2>() - from;
    const float along = (other.centre - from).dot(to) / to.squaredNorm();
    if (along <= 0 || along >= 1) return 1e9F;
    return (from + along * to - other.centre).norm() - other.radius;
  }

  TubeScene scene_;
  TexelGrid grid_;
  PosedSurface surface_;
};

void CheckCamera(const Camera& camera,
                 const MvvTextures& textures,
                 std::size_t c,
                 const TexelGrid& grid,
                 float pixel,
                 const std::function<Vec3f(std::size_t, Vec3f*)>& point,
                 const std::function<bool(std::size_t)>& is_thin,
                 const std::function<float(std::size_t, const Vec3f&, const Vec3f&)>& clearance) {
  const Vec3f eye = camera.Center().cast<float>();
  int seen = 0;
  int must = 0;
  for (std::size_t k = 0; k < grid.count(); ++k) {
    Vec3f n;
    const Vec3f x = point(k, &n);
    const float facing = n.dot((eye - x).normalized());
    const float clear = clearance(k, x, eye);
    const float weight = textures.weight[c][k];
    if (weight > 0) {
      ++seen;
      ASSERT_GT(facing, 0.19F);
      ASSERT_GT(clear, 0) << x.transpose();
      const Rgb expected = TubeColour(x, is_thin(k));
      for (int i = 0; i < 3; ++i) {
        ASSERT_NEAR(textures.radiance[c][3 * k + static_cast<std::size_t>(i)], expected[i], 0.01F)
            << x.transpose() << ", facing " << facing << ", clearance " << clear;
      }
      ASSERT_NEAR(weight, std::min(1.0F, (facing - 0.2F) / 0.3F), 0.02F);
    } else if (facing > 0.7F && clear > 10 * pixel && x.z() > 10 * pixel &&
               x.z() < kTubeHeight - 10 * pixel) {
      ADD_FAILURE() << "not seen: " << x.transpose() << ", facing " << facing;
      ++must;
      ASSERT_LT(must, 5);
    }
  }
  EXPECT_GT(seen, static_cast<int>(grid.count()) / 8);
}

TEST_F(MvvTexturesTest, TexelsTakeTheirOwnColourAndNothingElse) {
  std::vector<Camera> cameras = {MakeTubeCamera({4, 0.2, 1.0}, 600),
                                 MakeTubeCamera({1.5, -4, 0.7}, 600),
                                 MakeTubeCamera({-3.5, 1.5, 0.8}, 600)};
  cameras[1].distortion = {-0.2, 0.05, 0.003, -0.002, 0.01};
  const std::vector<Picture> pictures = TakePictures(cameras, 600);
  const MvvTextures textures = Make(cameras, pictures, {});
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    SCOPED_TRACE(c);
    CheckCamera(
        cameras[c],
        textures,
        c,
        grid_,
        4.0F / 900,
        [&](std::size_t k, Vec3f* n) { return Point(k, n); },
        [&](std::size_t k) { return IsThin(k); },
        [&](std::size_t k, const Vec3f& x, const Vec3f& eye) { return Clearance(k, x, eye); });
  }

  // The same from pictures that show the tubes alone, and for any number of threads.
  std::vector<Picture> crops = {TakePicture(cameras[0], {150, 50, 330, 520}),
                                TakePicture(cameras[1], {100, 60, 400, 500}),
                                TakePicture(cameras[2], {120, 40, 400, 530})};
  SetJobs(1);
  const MvvTextures cropped = Make(cameras, crops, {});
  SetJobs(0);
  EXPECT_EQ(cropped.weight, textures.weight);
  EXPECT_EQ(cropped.radiance, textures.radiance);
}

TEST_F(MvvTexturesTest, MissingCutOffAndBrokenPixelsGiveNoSamples) {
  const std::vector<Camera> cameras(4, MakeTubeCamera({4, 0.2, 1.0}, 400));
  std::vector<Picture> pictures(4, TakePicture(cameras[0], {0, 0, 400, 400}));
  pictures[0] = {};
  pictures[1] = TakePicture(cameras[1], {0, 0, 400, 200});
  for (int x = 0; x < 400; ++x) pictures[2].image.At(x, 200, 1) = std::nanf("");
  const MvvTextures textures = Make(cameras, pictures, {});
  const auto count = [&](std::size_t c) {
    return std::count_if(
        textures.weight[c].begin(), textures.weight[c].end(), [](float w) { return w > 0; });
  };
  EXPECT_EQ(count(0), 0);
  EXPECT_LT(count(1), count(3) * 3 / 4);
  EXPECT_GT(count(1), count(3) / 4);
  EXPECT_LT(count(2), count(3));
}

TEST_F(MvvTexturesTest, LampsThrowShadowsAndTheirEdgesAreNotTrusted) {
  const std::vector<Camera> cameras = {MakeTubeCamera({4, 0.2, 1.0}, 400)};
  const std::vector<Picture> pictures = {TakePicture(cameras[0], {0, 0, 400, 400})};
  const Vec3f lamp(5, 1.2F, 0.8F);
  const MvvTextures dark = Make(cameras, pictures, {});
  TextureOptions options;
  options.shadow_size = 512;  // wide penumbrae
  const MvvTextures textures = Make(cameras, pictures, {PointLight(lamp.cast<double>())}, options);
  int shadowed = 0;
  int dropped = 0;
  for (std::size_t k = 0; k < grid_.count(); ++k) {
    Vec3f n;
    const Vec3f x = Point(k, &n);
    const float facing = n.dot((lamp - x).normalized());
    const float clear = Clearance(k, x, lamp);
    const float visible = textures.light_visibility[0][k];
    if (facing < -0.02F) {
      ASSERT_EQ(visible, 0);
    }
    if (textures.weight[0][k] > 0) {
      ASSERT_TRUE(visible == 0 || visible == 1);
    }
    dropped += dark.weight[0][k] > 0 && textures.weight[0][k] == 0 ? 1 : 0;
    if (facing < 0.1F || std::abs(clear) < 0.03F) continue;
    ASSERT_EQ(visible, clear > 0 ? 1.0F : 0.0F) << x.transpose() << ", clearance " << clear;
    shadowed += clear < 0 ? 1 : 0;
  }
  EXPECT_GT(shadowed, 100);
  EXPECT_GT(dropped, 5);

  Light spot = PointLight(lamp.cast<double>());
  spot.type = LightType::kSpot;
  spot.direction = (Vec3d(0, 0, 0.8) - spot.position).normalized();
  spot.cone_inner = 0.06;
  spot.cone_outer = 0.1;
  const MvvTextures coned = Make(cameras, pictures, {spot});
  for (std::size_t k = 0; k < grid_.count(); ++k) {
    Vec3f n;
    const float cone = Illuminate(spot, Point(k, &n)).cone;
    if (cone > 0.03F && cone < 0.97F && coned.light_visibility[0][k] > 0) {
      ASSERT_EQ(coned.weight[0][k], 0);
    }
    if (cone == 0) {
      ASSERT_EQ(coned.light_visibility[0][k], 0);
    }
  }
}

TEST_F(MvvTexturesTest, DyxelsHoldTheExactGeometryOfTheirSamples) {
  const std::vector<Camera> cameras = {MakeTubeCamera({4, 0.2, 1.0}, 300),
                                       MakeTubeCamera({1.5, -4, 0.7}, 300)};
  const std::vector<Picture> pictures = TakePictures(cameras, 300);
  Light sun;
  sun.type = LightType::kDirectional;
  sun.direction = Vec3d(-1, -0.2, -0.1).normalized();
  sun.irradiance = Rgb(3, 2, 1);
  const std::vector<Light> lights = {PointLight({3, 2, 1}), sun};
  const MvvTextures textures = Make(cameras, pictures, lights);
  DyxelTile tile;
  tile.first_texel = 1000;
  tile.Resize(500, 2, 2, 2);
  tile.first_texel = 1000;
  FillDyxelFrame(scene_.atlas, grid_, surface_, cameras, lights, textures, 0, 1, tile);
  int samples = 0;
  for (int t = 0; t < 500; ++t) {
    const std::size_t k = 1000 + static_cast<std::size_t>(t);
    Vec3f n;
    const Vec3f x = Point(k, &n);
    // Tangent frame of an unmirrored tube: around, up, outwards.
    const Vec3f around(-n.y(), n.x(), 0);
    const auto in_frame = [&](const Vec3f& d) { return Vec3f(d.dot(around), d.z(), d.dot(n)); };
    for (int c = 0; c < 2; ++c) {
      const Vec3f view(
          tile.ViewDir(1, c, 0)[t], tile.ViewDir(1, c, 1)[t], tile.ViewDir(1, c, 2)[t]);
      const float weight = textures.weight[static_cast<std::size_t>(c)][k];
      ASSERT_EQ(tile.Weight(1, c)[t], weight);
      if (weight == 0) {
        ASSERT_EQ(view, Vec3f::UnitZ());
        continue;
      }
      ++samples;
      const Vec3f expected =
          in_frame((cameras[static_cast<std::size_t>(c)].Center().cast<float>() - x).normalized());
      ASSERT_LT((view - expected).norm(), 0.01F);
      for (int i = 0; i < 3; ++i) {
        ASSERT_EQ(
            tile.Radiance(1, c, i)[t],
            textures.radiance[static_cast<std::size_t>(c)][3 * k + static_cast<std::size_t>(i)]);
      }
    }
    const Vec3f to_lamp = Vec3f(3, 2, 1) - x;
    const Vec3f lamp(
        tile.LightDir(1, 0, 0)[t], tile.LightDir(1, 0, 1)[t], tile.LightDir(1, 0, 2)[t]);
    ASSERT_LT((lamp - in_frame(to_lamp.normalized())).norm(), 0.01F);
    const Vec3f day(
        tile.LightDir(1, 1, 0)[t], tile.LightDir(1, 1, 1)[t], tile.LightDir(1, 1, 2)[t]);
    ASSERT_LT((day - in_frame(-sun.direction.cast<float>())).norm(), 0.01F);
    for (int i = 0; i < 3; ++i) {
      const float at_lamp = static_cast<float>(10 * (i + 1)) / to_lamp.squaredNorm();
      ASSERT_NEAR(
          tile.Irradiance(1, 0, i)[t], at_lamp * textures.light_visibility[0][k], 2e-3F * at_lamp);
      ASSERT_EQ(tile.Irradiance(1, 1, i)[t],
                static_cast<float>(3 - i) * textures.light_visibility[1][k]);
    }
  }
  EXPECT_GT(samples, 100);
  EXPECT_EQ(tile.Weight(0, 0)[0], 0);  // the other frame is untouched
}

TEST_F(MvvTexturesTest, BlendShowsEachTexelAsItsCamerasDo) {
  const std::vector<Camera> cameras = {MakeTubeCamera({4, 0.2, 1.0}, 600),
                                       MakeTubeCamera({1.5, -4, 0.7}, 600)};
  const std::vector<Picture> pictures = TakePictures(cameras, 600);
  const MvvTextures textures = Make(cameras, pictures, {});
  const std::vector<std::vector<float>> weights =
      BlendWeights(scene_.atlas, grid_, surface_, cameras, textures);
  const BlendedTexture blend = BlendTexture(textures, weights);
  const BlendedTexture first = BlendTexture(textures, weights, /*left_out=*/1);
  int both = 0;
  for (std::size_t k = 0; k < grid_.count(); ++k) {
    const bool seen = textures.weight[0][k] > 0 || textures.weight[1][k] > 0;
    ASSERT_EQ(blend.weight[k] > 0, seen);
    ASSERT_EQ(first.weight[k], weights[0][k]);
    both += textures.weight[0][k] > 0 && textures.weight[1][k] > 0 ? 1 : 0;
    if (!seen) continue;
    Vec3f n;
    const Rgb expected = TubeColour(Point(k, &n), IsThin(k));
    for (int i = 0; i < 3; ++i) {
      ASSERT_NEAR(blend.radiance[3 * k + static_cast<std::size_t>(i)], expected[i], 0.01F);
    }
  }
  EXPECT_GT(both, 100);
  const ImageF map = TexelImage(grid_, blend.weight, 1);
  EXPECT_EQ(map.data[static_cast<std::size_t>(grid_.pixel[77])], blend.weight[77]);
}

}  // namespace
}  // namespace dyxel
