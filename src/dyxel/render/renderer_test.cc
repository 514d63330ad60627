#include "dyxel/render/renderer.h"

#include <cmath>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "dyxel/base/error.h"
#include "dyxel/base/lanes.h"
#include "dyxel/base/random.h"
#include "dyxel/render/orbit.h"
#include "dyxel/render/render_scene.h"
#include "dyxel/render/shade.h"
#include "dyxel/render/surface_samples.h"

namespace dyxel {
namespace {

using test_scene::AddQuad;
using test_scene::CameraAbove;
using test_scene::DirectionalLight;
using test_scene::MakeSphere;
using test_scene::PointLight;
using test_scene::Scene;
using test_scene::SetMaps;

// The plane z = 0, 2 m wide.
Scene Plane(const Rgb& diffuse) {
  Scene scene;
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  SetMaps(scene, "phong", diffuse, {0.0F, 10.0F});
  return scene;
}

// World point on z = 0 under the centre of a pixel of CameraAbove(height, size, focal).
Vec3d OnPlane(double height, int size, double focal, int x, int y) {
  return {(x + 0.5 - 0.5 * size) / focal * height, -(y + 0.5 - 0.5 * size) / focal * height, 0};
}

TEST(RendererTest, LambertianPlaneUnderPointLightIsClosedForm) {
  const Rgb albedo(0.5F, 0.25F, 0.1F);
  const Scene scene = Plane(albedo);
  const Vec3d lamp(0.4, -0.3, 1.5);
  const Rgb intensity(10, 20, 30);
  const ImageF picture =
      Render(scene.surface(), CameraAbove(2, 64, 80), {{PointLight(lamp, intensity)}, {}});
  for (int y = 4; y < 64; y += 11) {
    for (int x = 4; x < 64; x += 11) {
      const Vec3d to_light = lamp - OnPlane(2, 64, 80, x, y);
      const double d2 = to_light.squaredNorm();
      const double cosine = to_light.z() / std::sqrt(d2);
      for (int c = 0; c < 3; ++c) {
        const double expected =
            static_cast<double>(albedo[c]) / kPiD * static_cast<double>(intensity[c]) / d2 * cosine;
        EXPECT_NEAR(picture.At(x, y, c), expected, 1e-3 * expected) << x << " " << y << " " << c;
      }
      EXPECT_EQ(picture.At(x, y, 3), 1);
    }
  }
}

TEST(RendererTest, SpotFallsOffAsSmoothstepInTheCosine) {
  const Scene scene = Plane(Rgb::Constant(1));
  Light spot = PointLight({0, 0, 1}, Rgb::Constant(kPi));
  spot.type = LightType::kSpot;
  spot.direction = -Vec3d::UnitZ();
  spot.cone_inner = 0.2;
  spot.cone_outer = 0.5;
  // One sample a pixel: exact positions.
  const ImageF picture =
      Render(scene.surface(), CameraAbove(2, 64, 80), {{spot}, {}}, Pass::kBeauty, {.samples = 1});
  int partial = 0;
  for (int x = 32; x < 64; ++x) {
    const Vec3d p = OnPlane(2, 64, 80, x, 32);
    const double d2 = p.squaredNorm() + 1;
    const double cosine = 1 / std::sqrt(d2);
    const double s =
        std::clamp((cosine - std::cos(0.5)) / (std::cos(0.2) - std::cos(0.5)), 0.0, 1.0);
    partial += s > 0 && s < 1 ? 1 : 0;
    EXPECT_NEAR(picture.At(x, 32, 0), s * s * (3 - 2 * s) * cosine / d2, 1e-3) << x;
  }
  EXPECT_GT(partial, 5);
}

// The unit sphere under one directional light, seen from far: radiance against formulas written
// here.
void ExpectSphere(const std::string& model,
                  const std::vector<float>& specular,
                  const std::function<double(double, double, double)>& brdf) {
  Scene scene = MakeSphere(1, 128);
  SetMaps(scene, model, Rgb::Constant(0.4F), specular);
  const Vec3d to_light = Vec3d(1, 0.5, 1).normalized();
  const Camera camera = CameraAbove(20, 64, 560);
  const ImageF picture = Render(scene.surface(),
                                camera,
                                {{DirectionalLight(to_light, Rgb::Constant(2))}, {}},
                                Pass::kBeauty,
                                {.samples = 1});
  int compared = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const Vec3d ray = camera.Ray({x + 0.5, y + 0.5});
      const Vec3d eye = camera.Center();
      const double b = ray.dot(eye);
      const double discriminant = b * b - eye.squaredNorm() + 1;
      if (discriminant < 0.01) continue;  // rims: the polyhedron's differ
      const Vec3d n = eye + (-b - std::sqrt(discriminant)) * ray;
      const double n_l = n.dot(to_light);
      if (std::abs(n_l) < 0.1) continue;  // the shadow map's terminator
      const double expected = n_l < 0 ? 0 : 2 * n_l * brdf(n_l, -n.dot(ray), -ray.dot(to_light));
      EXPECT_NEAR(picture.At(x, y, 1), expected, 2e-3) << x << " " << y;
      ++compared;
    }
  }
  EXPECT_GT(compared, 1500);
}

TEST(RendererTest, PhongSphereIsClosedForm) {
  ExpectSphere("phong", {0.2F, 30.0F}, [](double n_l, double n_v, double l_v) {
    const double r_v = std::max(0.0, 2 * n_l * n_v - l_v);
    return 0.4 / kPiD + 0.2 * 32 / (2 * kPiD) * std::pow(r_v, 30.0);
  });
}

TEST(RendererTest, GgxSphereIsClosedForm) {
  ExpectSphere("ggx", {0.4F, 0.05F}, [](double n_l, double n_v, double l_v) {
    const double l_h = std::sqrt((1 + l_v) / 2);
    const double n_h = (n_l + n_v) / (2 * l_h);
    const double a2 = std::pow(0.4, 4);
    const double d = a2 / (kPiD * std::pow(n_h * n_h * (a2 - 1) + 1, 2));
    const auto lambda = [&](double c) {  // Smith's Λ
      return 0.5 * (std::sqrt(1 + a2 * (1 - c * c) / (c * c)) - 1);
    };
    const double g = 1 / (1 + lambda(n_l) + lambda(n_v));
    const double fresnel = 0.05 + 0.95 * std::pow(1 - l_h, 5);
    const double f90 = 0.5 + 2 * 0.4 * l_h * l_h;
    const double burley =
        (1 + (f90 - 1) * std::pow(1 - n_l, 5)) * (1 + (f90 - 1) * std::pow(1 - n_v, 5));
    return 0.4 / kPiD * burley + d * g * fresnel / (4 * n_l * n_v);
  });
}

TEST(RendererTest, QuadThrowsItsShadowWhereGeometrySays) {
  Scene scene;
  AddQuad(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  // Half a metre up, from y = -0.1 to 0.1; light at 45° from +x moves the shadow by -0.5 in x.
  AddQuad(scene, {0.4F, -0.1F, 0.5F}, {0.2F, 0, 0}, {0, 0.2F, 0});
  SetMaps(scene, "phong", Rgb::Constant(1), {0.0F, 10.0F});
  const Light sun = DirectionalLight({1, 0, 1}, Rgb::Constant(kPi));
  const Camera camera = CameraAbove(4, 256, 400);
  const ImageF picture = Render(scene.surface(), camera, {{sun}, {}});
  const auto at = [&](double x, double y) {
    const Vec2d p = camera.Project({x, y, 0});
    return picture.At(static_cast<int>(p.x()), static_cast<int>(p.y()), 0);
  };
  const float lit = std::sqrt(0.5F);
  EXPECT_NEAR(at(0, 0), 0, 1e-6);
  EXPECT_NEAR(at(-0.08, 0.08), 0, 1e-6);
  EXPECT_NEAR(at(0.08, -0.08), 0, 1e-6);
  for (const Vec2d& p : {Vec2d(-0.12, 0), Vec2d(0.12, 0), Vec2d(0, 0.12), Vec2d(0, -0.12)}) {
    EXPECT_NEAR(at(p.x(), p.y()), lit, 1e-3) << p.transpose();
  }
  EXPECT_NEAR(at(-0.9, 0.9), lit, 1e-3);
}

TEST(RendererTest, ConstantEnvironmentOnConvexDiffuseSphereGivesAlbedoTimesRadiance) {
  Scene scene = MakeSphere(1, 64);
  SetMaps(scene, "phong", Rgb(0.5F, 0.3F, 0.1F), {0.0F, 10.0F});
  Environment environment;
  environment.radiance = ImageF(64, 32, 3, 2.0F);
  Lighting lighting;
  lighting.environment = environment;
  const Camera camera = CameraAbove(20, 64, 560);
  const ImageF picture =
      Render(scene.surface(),
             camera,
             lighting,
             Pass::kBeauty,
             {.samples = 1, .environment_lights = 512, .environment_shadow_size = 64});
  double sum = 0;
  int count = 0;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      if (std::hypot(x - 31.5, y - 31.5) > 24) continue;
      EXPECT_NEAR(picture.At(x, y, 0), 1.0, 0.05) << x << " " << y;
      sum += static_cast<double>(picture.At(x, y, 1));
      ++count;
    }
  }
  EXPECT_NEAR(sum / count, 0.6, 0.006);
}

TEST(RendererTest, LanesShadeAsScalars) {
  Random random(1);
  const auto unit = [&] {
    return Vec3f(random.Normal(), random.Normal(), random.Normal()).normalized();
  };
  internal::ShadeBlock block = {};
  block.count = internal::kShadeBlock - 3;
  for (std::size_t i = 0; i < internal::kShadeBlock; ++i) {
    const Vec3f x = unit(), n = unit(), v = unit();
    const Vec3f side = (n + 0.3F * unit()).normalized();
    for (int a = 0; a < 3; ++a) {
      const auto row = static_cast<std::size_t>(a);
      block.position[row][i] = x[a];
      block.normal[row][i] = n[a];
      block.side[row][i] = side[a];
      block.view[row][i] = v[a];
      block.diffuse[row][i] = random.Uniform();
    }
    block.specular[0][i] = 0.2F + 0.3F * random.Uniform();
    block.specular[1][i] = 0.02F + 0.1F * random.Uniform();
  }
  Light spot = PointLight({2, 1, 3}, Rgb(30, 20, 10));
  spot.type = LightType::kSpot;
  spot.direction = -Vec3d(2, 1, 3).normalized();
  spot.cone_inner = 0.1;
  spot.cone_outer = 0.4;
  std::vector<internal::ShadeLight> lights;
  for (const Light& light :
       {spot, PointLight({-1, 2, 0}, Rgb(5, 6, 7)), DirectionalLight({0, -1, 1}, Rgb(1, 2, 3))}) {
    lights.push_back(internal::MakeShadeLight(light));
  }
  for (const char* model : {"phong", "ggx"}) {
    internal::ShadeBlock scalar = block;
    internal::ShadeBlock lanes = block;
    internal::Shade<float>(model, lights, {}, scalar);
    internal::Shade<Lanes>(model, lights, {}, lanes);
    float brightest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i) {
        EXPECT_NEAR(scalar.radiance[c][i], lanes.radiance[c][i], 1e-5 * (1 + scalar.radiance[c][i]))
            << model << " " << c << " " << i;
        brightest = std::max(brightest, scalar.radiance[c][i]);
      }
    }
    EXPECT_GT(brightest, 0.1F);
  }
}

TEST(RendererTest, LanesGatherAsScalars) {
  Scene scene = MakeSphere(1, 24);
  SetMaps(scene, "ggx", Rgb(0.5F, 0.3F, 0.1F), {0.4F, 0.04F});
  Random random(4);
  for (float& x : scene.maps.diffuse.data) x = random.Uniform();
  scene.normal_map = ImageF(8, 8, 3);
  for (float& x : scene.normal_map.data) x = random.Uniform();
  const RenderSurface surface = scene.surface();
  const internal::PackedSurface packed = internal::PackSurface(surface);
  const internal::ScreenSurface screen =
      internal::ProjectSurface(surface, CameraAbove(5, 200, 300), 1);
  internal::SampleBlock samples;
  for (int y = 3; y < screen.window.height && samples.count < 61; y += 7) {
    for (int x = 2; x < screen.window.width && samples.count < 61; x += 11) {
      const std::size_t at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(screen.visibility.width) +
          static_cast<std::size_t>(x);
      if (screen.visibility.triangle[at] < 0) continue;
      const auto i = static_cast<std::size_t>(samples.count++);
      samples.triangle[i] = screen.visibility.triangle[at];
      samples.x[i] = x;
      samples.y[i] = y;
    }
  }
  ASSERT_EQ(samples.count, 61);
  internal::ShadeBlock scalar = {};
  internal::ShadeBlock lanes = {};
  internal::SampleBlock other = samples;
  internal::GatherSamples<float>(surface, packed, screen, samples, scalar);
  internal::GatherSamples<Lanes>(surface, packed, screen, other, lanes);
  for (std::size_t i = 0; i < 61; ++i) {
    for (std::size_t a = 0; a < 3; ++a) {
      EXPECT_NEAR(scalar.position[a][i], lanes.position[a][i], 1e-5);
      EXPECT_NEAR(scalar.side[a][i], lanes.side[a][i], 1e-5);
      EXPECT_NEAR(scalar.normal[a][i], lanes.normal[a][i], 1e-4);
      EXPECT_NEAR(scalar.view[a][i], lanes.view[a][i], 1e-5);
      EXPECT_NEAR(scalar.diffuse[a][i], lanes.diffuse[a][i], 1e-4);
    }
    EXPECT_NEAR(samples.depth[i], other.depth[i], 1e-5);
    // And both are on the sphere that the camera, 5 m away, sees the top of.
    const Vec3f x(scalar.position[0][i], scalar.position[1][i], scalar.position[2][i]);
    EXPECT_NEAR(x.norm(), 1, 0.01);
    EXPECT_NEAR(samples.depth[i], 5 - x.z(), 1e-4);
  }
}

TEST(RendererTest, ThreadsDoNotChangeAByte) {
  Scene scene = MakeSphere(1, 48);
  SetMaps(scene, "ggx", Rgb(0.5F, 0.3F, 0.1F), {0.4F, 0.04F});
  const Lighting lighting{
      {PointLight({2, 2, 3}, Rgb(10, 20, 30)), DirectionalLight({-1, 0.2, 0.4}, Rgb::Constant(1))},
      {}};
  const Camera camera = CameraAbove(5, 200, 300);
  ImageF pictures[2];
  for (std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    pictures[threads - 1] = Render(scene.surface(), camera, lighting);
  }
  ASSERT_EQ(pictures[0].data.size(), pictures[1].data.size());
  EXPECT_EQ(0,
            std::memcmp(pictures[0].data.data(),
                        pictures[1].data.data(),
                        pictures[0].data.size() * sizeof(float)));
}

TEST(RendererTest, HalfCoveredPixelsHaveHalfTheLightAndCoverage) {
  Scene scene;
  // The edge x = 0 runs through the middle of the pixel column 32 of 65.
  AddQuad(scene, {0, -1, 0}, {1, 0, 0}, {0, 2, 0});
  SetMaps(scene, "phong", Rgb::Constant(0.5F), {0.0F, 10.0F});
  const ImageF picture = Render(scene.surface(),
                                CameraAbove(2, 65, 80),
                                {{DirectionalLight({0, 0, 1}, Rgb::Constant(kPi))}, {}});
  EXPECT_EQ(picture.At(31, 32, 3), 0);
  EXPECT_FLOAT_EQ(picture.At(32, 32, 3), 0.5F);
  EXPECT_NEAR(picture.At(32, 32, 0), 0.25, 1e-5);
  EXPECT_EQ(picture.At(33, 32, 3), 1);
  EXPECT_NEAR(picture.At(33, 32, 0), 0.5, 1e-5);
}

TEST(RendererTest, NormalMapTurnsTheNormalInTheTangentFrame) {
  Scene scene = Plane(Rgb::Constant(1));
  const Vec3f n = Vec3f(0.3F, 0.5F, 1).normalized();
  scene.normal_map = ImageF(8, 8, 3);
  for (std::size_t i = 0; i < scene.normal_map.data.size(); ++i) {
    scene.normal_map.data[i] = n[static_cast<int>(i % 3)];
  }
  const Lighting lighting{{DirectionalLight({1, 0, 1}, Rgb::Constant(kPi))}, {}};
  const Camera camera = CameraAbove(2, 64, 80);
  const float cosine = (n.x() + n.z()) * std::sqrt(0.5F);
  EXPECT_NEAR(Render(scene.surface(), camera, lighting).At(20, 20, 0), cosine, 1e-4);
  // The plane's tangent is x and its bitangent y, or -y in a mirrored chart.
  for (const float handedness : {1.0F, -1.0F}) {
    scene.posed.handedness.assign(4, handedness);
    const ImageF normals = Render(scene.surface(), camera, lighting, Pass::kNormal);
    EXPECT_NEAR(normals.At(20, 20, 0), n.x(), 1e-5);
    EXPECT_NEAR(normals.At(20, 20, 1), handedness * n.y(), 1e-5);
    EXPECT_NEAR(normals.At(20, 20, 2), n.z(), 1e-5);
  }
}

TEST(RendererTest, PassesShowWhatTheySay) {
  Scene scene = Plane(Rgb(0.5F, 0.25F, 0.1F));
  scene.maps.material.data.assign(64, 3);
  const Camera camera = CameraAbove(2, 64, 80);
  const std::vector<Pass> passes = {
      Pass::kDiffuse, Pass::kSpecular, Pass::kDepth, Pass::kMaterial, Pass::kUv, Pass::kConfidence};
  const std::vector<ImageF> pictures =
      RenderPasses(scene.surface(), camera, PreparedLighting(scene.surface(), {}), passes);
  const auto at = [&](std::size_t p) {
    const float* v = &pictures[p].At(40, 20);
    return std::vector<float>(v, v + 3);
  };
  using testing::ElementsAre;
  using testing::FloatNear;
  EXPECT_THAT(at(0),
              ElementsAre(FloatNear(0.5F, 1e-5), FloatNear(0.25F, 1e-5), FloatNear(0.1F, 1e-5)));
  EXPECT_THAT(at(1), ElementsAre(0, FloatNear(10, 1e-4), 0));
  EXPECT_THAT(at(2), ElementsAre(FloatNear(2, 1e-4), FloatNear(2, 1e-4), FloatNear(2, 1e-4)));
  EXPECT_THAT(at(3), ElementsAre(3, 3, 3));
  // uv of the pixel's first sample, a quarter pixel up and left of its centre.
  const Vec3d p = OnPlane(2, 64, 80, 40, 20) + Vec3d(-0.25, 0.25, 0) / 80 * 2;
  EXPECT_NEAR(at(4)[0], 0.5 + 0.5 * p.x(), 1e-5);
  EXPECT_NEAR(at(4)[1], 0.5 + 0.5 * p.y(), 1e-5);
  EXPECT_THAT(at(5)[0], FloatNear(0.75F, 1e-6));
}

TEST(RendererTest, PassNamesRoundTrip) {
  for (const char* name :
       {"beauty", "normal", "diffuse", "specular", "depth", "material", "uv", "confidence"}) {
    EXPECT_STREQ(PassName(ParsePass(name)), name);
  }
  EXPECT_THROW((void)ParsePass("shiny"), Error);
}

TEST(RendererTest, SheetSeenFromBehindIsLitFromBehind) {
  Scene scene;
  AddQuad(scene, {-1, -1, 0}, {0, 2, 0}, {2, 0, 0});  // normal -z, the camera looks from +z
  SetMaps(scene, "phong", Rgb::Constant(0.5F), {0.0F, 10.0F});
  const Camera camera = CameraAbove(2, 64, 80);
  const auto center = [&](const Vec3d& to_light) {
    return Render(scene.surface(), camera, {{DirectionalLight(to_light, Rgb::Constant(kPi))}, {}})
        .At(30, 30, 0);
  };
  EXPECT_NEAR(center({0, 0, 1}), 0.5, 1e-4);
  EXPECT_EQ(center({0, 0, -1}), 0);
}

TEST(RendererTest, DistortionMovesEdgesAsTheCameraProjects) {
  Scene scene;
  AddQuad(scene, {-0.05F, -1, 0}, {0.55F, 0, 0}, {0, 2, 0});
  SetMaps(scene, "phong", Rgb::Constant(0.5F), {0.0F, 10.0F});
  Camera camera = CameraAbove(2, 201, 300);
  camera.distortion = {-0.3, 0.1, 0.001, -0.002, 0.01};
  const ImageF picture = Render(scene.surface(), camera, {}, Pass::kDiffuse, {.samples = 8});
  // The row through the corners' own height bends between vertices; compare at the corner columns
  // of a quad cut finely enough: here the middle of the right edge's chord.
  const Vec2d low = camera.Project({0.5, -1, 0});
  const Vec2d high = camera.Project({0.5, 1, 0});
  const double middle = 100.5;
  const double t = (middle - low.y()) / (high.y() - low.y());
  const double edge = low.x() + t * (high.x() - low.x());
  double covered = 0;
  for (int x = 110; x < 201; ++x) covered += static_cast<double>(picture.At(x, 100, 3));
  EXPECT_NEAR(110 + covered, edge, 0.1);
  EXPECT_GT(std::abs(edge - (100.5 + 0.5 / 2 * 300)), 3);  // undistorted it would be elsewhere
}

TEST(RendererTest, NothingInViewIsAnEmptyPicture) {
  const Scene scene = Plane(Rgb::Constant(1));
  Camera camera = CameraAbove(2, 32, 40);
  camera.cam_from_world.translation.z() = -2;  // behind
  const ImageF picture = Render(scene.surface(), camera, {});
  EXPECT_EQ(picture.width, 32);
  for (const float x : picture.data) ASSERT_EQ(x, 0);
}

TEST(RendererTest, MapsOfAnotherSizeAreRefused) {
  Scene scene = Plane(Rgb::Constant(1));
  scene.maps.diffuse = ImageF(4, 4, 3);
  EXPECT_THROW((void)Render(scene.surface(), CameraAbove(2, 32, 40), {}), Error);
}

TEST(OrbitTest, EveryAzimuthKeepsThePersonInThePicture) {
  std::vector<Vec3f> body;
  for (const float x : {-0.4F, 0.4F}) {
    for (const float y : {-0.2F, 0.2F}) {
      for (const float z : {0.0F, 1.8F}) body.emplace_back(x, y, z);
    }
  }
  for (const Vec3d& up : {Vec3d::UnitZ().eval(), Vec3d::UnitX().eval()}) {
    const Orbit orbit = FitOrbit(body, up, 300, 400, 0.3);
    double fullest = 0;
    for (int i = 0; i < 40; ++i) {
      const Camera camera = OrbitCamera(orbit, i * kPiD / 20);
      EXPECT_NEAR((camera.cam_from_world.rotation * camera.cam_from_world.rotation.transpose() -
                   Mat3d::Identity())
                      .norm(),
                  0,
                  1e-12);
      EXPECT_NEAR(camera.cam_from_world.rotation.determinant(), 1, 1e-12);
      for (const Vec3f& x : body) {
        const Vec2d p = camera.Project(x.cast<double>());
        EXPECT_TRUE(p.x() > 0 && p.x() < 300 && p.y() > 0 && p.y() < 400) << p.transpose();
        fullest = std::max({fullest, std::abs(p.x() / 150 - 1), std::abs(p.y() / 200 - 1)});
      }
      // Up is up.
      const Vec3d c = orbit.center;
      EXPECT_LT(camera.Project(c + 0.1 * up).y(), camera.Project(c).y());
      EXPECT_NEAR(camera.Project(c + 0.1 * up).x(), camera.Project(c).x(), 1e-9);
    }
    EXPECT_GT(fullest, 0.95);  // and fills it
  }
  // Counter-clockwise from above: a quarter turn after +x comes +y.
  const Vec3d eye = OrbitCamera(FitOrbit(body, Vec3d::UnitZ(), 300, 300, 0), kPiD / 2).Center();
  EXPECT_GT(eye.y(), 1);
  EXPECT_NEAR(eye.x(), 0, 1e-9);
}

}  // namespace
}  // namespace dyxel
