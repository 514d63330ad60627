#include "dyxel/tracking/registration.h"

#include <gtest/gtest.h>

#include "dyxel/tracking/synthetic_rig.h"

namespace dyxel {
namespace {

using internal::DrawSilhouettes;
using internal::RingOfCameras;
using internal::SmallNodedBody;

// A blotched pattern that sticks to the skin, drawn without shading.
PredictedPicture DrawPattern(const Camera& camera,
                             std::span<const Vec3f> positions,
                             float contrast) {
  const std::vector<ScreenVertex> vertices = internal::ToScreen(camera, positions);
  const auto& triangles = SmallNodedBody().skin.triangles;
  const VisibilityBuffer buffer = Rasterize(vertices, triangles, camera.width, camera.height);
  PredictedPicture picture{ImageF(camera.width, camera.height, 4),
                           ImageF(camera.width, camera.height, 1)};
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width) +
                     static_cast<std::size_t>(x);
      const int f = buffer.triangle[i];
      if (f < 0) continue;
      const Triangle& t = triangles[static_cast<std::size_t>(f)];
      const auto corner = [&](std::size_t k) { return static_cast<std::size_t>(t[k]); };
      const Vec3f b = PerspectiveBarycentrics(vertices[corner(0)],
                                              vertices[corner(1)],
                                              vertices[corner(2)],
                                              static_cast<float>(x) + 0.5F,
                                              static_cast<float>(y) + 0.5F);
      Vec3f rest = Vec3f::Zero();
      for (std::size_t k = 0; k < 3; ++k) {
        rest += b[static_cast<int>(k)] * SmallNodedBody().skin.positions[corner(k)];
      }
      const float value = 0.4F + contrast * std::sin(30 * rest.z() + 2 * std::sin(17 * rest.y())) *
                                     std::cos(26 * rest.y() + 11 * rest.x());
      for (int c = 0; c < 3; ++c) picture.radiance.At(x, y, c) = value;
      picture.radiance.At(x, y, 3) = 1;
      picture.depth.At(x, y) = 1 / buffer.inverse_depth[i];
    }
  }
  return picture;
}

struct Scene {
  SilhouetteSet silhouettes;
  Motion tracked;
  Pose truth;
  float contrast = 0.3F;

  [[nodiscard]] std::vector<PredictedPicture> Draw(std::span<const Vec3f> positions) const {
    std::vector<PredictedPicture> pictures;
    for (const Camera& camera : silhouettes.cameras) {
      pictures.push_back(DrawPattern(camera, positions, contrast));
    }
    return pictures;
  }
  [[nodiscard]] Motion Register(const RegistrationOptions& options) const {
    std::vector<Picture> recorded;
    for (const PredictedPicture& drawn : Draw(SkinPositions(SmallNodedBody(), truth))) {
      Picture picture{ImageF(drawn.depth.width, drawn.depth.height, 3),
                      {0, 0, drawn.depth.width, drawn.depth.height}};
      for (std::size_t i = 0; i < drawn.depth.data.size(); ++i) {
        // Another exposure, which the contrast's normalisation takes away.
        for (std::size_t c = 0; c < 3; ++c) {
          picture.image.data[3 * i + c] = 0.7F * drawn.radiance.data[4 * i + c];
        }
      }
      recorded.push_back(std::move(picture));
    }
    return RegisterMotion(
        silhouettes,
        SmallNodedBody(),
        tracked,
        [&](std::size_t, std::span<const Vec3f> positions) { return Draw(positions); },
        [&](std::size_t, std::span<const Vec3f>) { return recorded; },
        options);
  }
};

// The cloth of the trunk has slid up by `slide` metres.
Scene Slid(double slide) {
  Scene scene;
  Pose pose = SmallNodedBody().skeleton.RestPose();
  pose.root_rotation = Quatd(Eigen::AngleAxisd(0.7, Vec3d::UnitZ()));
  scene.tracked = {{pose}, {1}};
  scene.truth = pose;
  const std::vector<Vec3d> rest = SmallNodedBody().skeleton.RestPositions();
  for (std::size_t j = 0; j < rest.size(); ++j) {
    if (!SmallNodedBody().skeleton.joints[j].IsNode()) continue;
    const double z = (rest[j].z() - 0.8) / 0.5;
    const bool trunk = z > 0 && z < 1 && std::abs(rest[j].y()) < 0.25;
    scene.truth.shifts.push_back(trunk ? Vec3d(0, 0, slide * std::sin(kPiD * z)) : Vec3d::Zero());
  }
  scene.silhouettes = DrawSilhouettes(RingOfCameras(8, 500), SmallNodedBody(), {scene.truth});
  return scene;
}

// Mean distance of the same skin points, metres.
double Distance(const Pose& a, const Pose& b) {
  const std::vector<Vec3f> x = SkinPositions(SmallNodedBody(), a);
  const std::vector<Vec3f> y = SkinPositions(SmallNodedBody(), b);
  double sum = 0;
  for (std::size_t v = 0; v < x.size(); ++v) sum += static_cast<double>((x[v] - y[v]).norm());
  return sum / static_cast<double>(x.size());
}

TEST(RegisterMotion, FollowsClothThatSlidesInItsSurface) {
  const Scene scene = Slid(0.05);
  const Motion registered = scene.Register({.rounds = 2});
  EXPECT_LT(Distance(registered.poses[0], scene.truth),
            0.6 * Distance(scene.tracked.poses[0], scene.truth));
}

TEST(RegisterMotion, LeavesPlainClothToTheSilhouettes) {
  Scene scene = Slid(0);
  scene.contrast = 0.004F;
  const Motion registered = scene.Register({.rounds = 2});
  EXPECT_LT(Distance(registered.poses[0], scene.truth), 0.002);
}

}  // namespace
}  // namespace dyxel
