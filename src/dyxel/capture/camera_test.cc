#include "dyxel/capture/camera.h"

#include <cmath>

#include <gtest/gtest.h>

namespace dyxel {
namespace {

Camera MakeCamera(bool distorted) {
  Camera camera;
  camera.width = 1004;
  camera.height = 804;
  camera.fx = 1320;
  camera.fy = 1310;
  camera.cx = 511;
  camera.cy = 395;
  if (distorted) camera.distortion = {-0.21, 0.08, 0.0013, -0.0021, -0.01};
  camera.cam_from_world = {
      Eigen::AngleAxisd(0.8, Vec3d(0.2, -1, 0.4).normalized()).toRotationMatrix(),
      Vec3d(0.1, -0.3, 3.2)};
  return camera;
}

// The formula of OpenCV's documentation, written out for one point.
TEST(Camera, ProjectsAsOpenCvDocuments) {
  Camera camera = MakeCamera(true);
  camera.cam_from_world = {};
  const double x = 0.3;
  const double y = -0.2;
  const auto [k1, k2, p1, p2, k3] = camera.distortion;
  const double r2 = x * x + y * y;
  const double radial = 1 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
  const double xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  const double yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  const Vec2d pixel = camera.Project(Vec3d(2 * x, 2 * y, 2));
  EXPECT_NEAR(pixel.x(), 1320 * xd + 511, 1e-10);
  EXPECT_NEAR(pixel.y(), 1310 * yd + 395, 1e-10);
  // The axis meets the principal point.
  EXPECT_EQ(camera.Project(Vec3d(0, 0, 5)), Vec2d(511, 395));
}

TEST(Camera, RayGoesBackToThePoint) {
  for (const bool distorted : {false, true}) {
    const Camera camera = MakeCamera(distorted);
    for (double u = 0; u <= camera.width; u += 50.2) {
      for (double v = 0; v <= camera.height; v += 40.2) {
        const Vec3d ray = camera.Ray({u, v});
        EXPECT_NEAR(ray.norm(), 1, 1e-14);
        const Vec3d x = camera.Center() + 2.7 * ray;
        EXPECT_GT(camera.Depth(x), 0);
        EXPECT_LT((camera.Project(x) - Vec2d(u, v)).norm(), 1e-9);
      }
    }
  }
}

TEST(Camera, JacobianAgreesWithDifferences) {
  for (const bool distorted : {false, true}) {
    const Camera camera = MakeCamera(distorted);
    const Vec3d x = camera.Center() + 3.1 * camera.Ray({900, 80});
    const Eigen::Matrix<double, 2, 3> jacobian = camera.ProjectJacobian(x);
    const double h = 1e-6;
    for (int i = 0; i < 3; ++i) {
      const Vec3d step = h * Vec3d::Unit(i);
      const Vec2d difference = (camera.Project(x + step) - camera.Project(x - step)) / (2 * h);
      EXPECT_LT((jacobian.col(i) - difference).norm(), 1e-6 * jacobian.norm());
    }
  }
}

TEST(Camera, ScaledKeepsTheExtent) {
  const Camera camera = MakeCamera(true);
  const Camera half = camera.Scaled(0.37);
  EXPECT_EQ(half.width, 371);
  EXPECT_EQ(half.height, 297);
  const Vec3d x = camera.Center() + 3.1 * camera.Ray({900, 80});
  const Vec2d pixel = half.Project(x);
  EXPECT_NEAR(pixel.x() / half.width, 900.0 / camera.width, 1e-12);
  EXPECT_NEAR(pixel.y() / half.height, 80.0 / camera.height, 1e-12);
}

}  // namespace
}  // namespace dyxel
