#include "dyxel/reflectance/dss_normals.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/parallel.h"
#include "dyxel/reflectance/synthetic_dyxels.h"

namespace dyxel {
namespace {

// The reflectance that the synthetic dyxels were made with.
Reflectance TrueReflectance(const SyntheticOptions& o, const SyntheticTruth& truth) {
  Reflectance r;
  r.model = o.model;
  const std::size_t num_texels = truth.material.size();
  r.material = truth.material;
  r.materials.resize(o.materials.size());
  r.specular.resize(o.materials[0].specular.size());
  for (std::size_t x = 0; x < num_texels; ++x) {
    const auto& material = o.materials[static_cast<std::size_t>(truth.material[x])];
    for (std::size_t k = 0; k < r.specular.size(); ++k) {
      r.specular[k].push_back(static_cast<float>(material.specular[k]));
    }
    for (std::size_t c = 0; c < 3; ++c) {
      r.diffuse[c].push_back(static_cast<float>(truth.diffuse[c][x]));
    }
  }
  r.normal.assign(num_texels, Vec3f::UnitZ());
  r.confidence.assign(num_texels, 1.0F);
  r.filled.assign(num_texels, 0);
  return r;
}

double RmsDeg(const std::vector<Vec3f>& normal,
              const std::vector<Vec3d>& truth,
              std::size_t num_texels) {
  double sum = 0;
  for (std::size_t x = 0; x < num_texels; ++x) {
    sum += std::pow(std::acos(std::min(1.0, normal[x].cast<double>().dot(truth[x]))), 2);
  }
  return std::sqrt(sum / static_cast<double>(num_texels)) * 180 / kPiD;
}

struct Case {
  SyntheticOptions synthetic;
  SyntheticTruth truth;
  Reflectance reflectance;
  DyxelSource source;
  TexelGraph graph;
  std::size_t seen;  // all rows but the last

  explicit Case(const SyntheticOptions& o)
      : synthetic(o),
        truth(MakeSyntheticTruth(o)),
        reflectance(TrueReflectance(o, truth)),
        source(MakeSyntheticSource(o)),
        graph(MakeGridGraph(o.width, o.height)),
        seen(static_cast<std::size_t>(o.width * (o.height - 1))) {}
  ChunkNormals Fit(const NormalOptions& options) const {
    return FitNormals(source, graph, reflectance, options);
  }
  double ErrorDeg(const ChunkNormals& fit) const { return RmsDeg(fit.normal, truth.normal, seen); }
};

TEST(FitNormals, RecoversNormalsFromManyLights) {
  const Case c({.bumps = 0.12, .noise = 0.01});
  const std::vector<Vec3f> flat(c.truth.normal.size(), Vec3f::UnitZ());
  EXPECT_GT(RmsDeg(flat, c.truth.normal, c.seen), 8);
  const ChunkNormals fit = c.Fit({.alpha = 0.999, .coupling = 0});
  EXPECT_LT(c.ErrorDeg(fit), 1);
}

TEST(FitNormals, TexelsThatNobodySawKeepTheModelsNormal) {
  const Case c({.bumps = 0.12});
  const ChunkNormals fit = c.Fit({});
  for (std::size_t x = c.seen; x < fit.normal.size(); ++x) {
    EXPECT_EQ(fit.normal[x], Vec3f::UnitZ());
    EXPECT_EQ(fit.confidence[x], 0);
    EXPECT_TRUE(std::isnan(fit.error[x]));
  }
}

TEST(FitNormals, WithoutTrustInTheSamplesKeepsTheModelsNormal) {
  const Case c({.bumps = 0.12});
  const ChunkNormals fit = c.Fit({.alpha = 0});
  for (const Vec3f& n : fit.normal) EXPECT_LT((n - Vec3f::UnitZ()).norm(), 1e-3);
}

TEST(FitNormals, KeepsTowardTheReferenceWhereAsked) {
  Case c({.bumps = 0.12});
  for (std::size_t x = 0; x < c.truth.normal.size(); ++x) {
    c.reflectance.normal[x] = c.truth.normal[x].cast<float>();
  }
  const ChunkNormals fit = c.Fit({.alpha = 0, .toward_reference = true});
  for (std::size_t x = 0; x < fit.normal.size(); ++x) {
    EXPECT_LT((fit.normal[x] - c.reflectance.normal[x]).norm(), 1e-3);
  }
}

// Neighbours with the same true normal, few noisy samples: coupled texels share them.
TEST(FitNormals, CouplingAveragesNoiseAway) {
  Case c({.frames = 3, .bumps = 0.12, .noise = 0.1});
  for (Vec3d& n : c.truth.normal) n = Vec3d(0.1, -0.15, 1).normalized();
  c.source.load = [o = c.synthetic, truth = c.truth, begins = c.source.tile_begin](int tile) {
    const auto t = static_cast<std::size_t>(tile);
    return MakeSyntheticTile(o, truth, begins[t], begins[t + 1]);
  };
  const double alone = c.ErrorDeg(c.Fit({.alpha = 0.9, .coupling = 0}));
  const double coupled = c.ErrorDeg(c.Fit({.alpha = 0.9, .coupling = 10}));
  EXPECT_LT(coupled, 0.5 * alone);
}

TEST(FitNormals, DoesNotDependOnExposureNorThreads) {
  SyntheticOptions o{.frames = 5, .bumps = 0.1, .noise = 0.05};
  SetJobs(1);
  const ChunkNormals one = Case(o).Fit({});
  SetJobs(2);
  const ChunkNormals two = Case(o).Fit({});
  SetJobs(0);
  EXPECT_EQ(one.normal, two.normal);
  EXPECT_EQ(one.confidence, two.confidence);
  o.exposure = 100;
  const ChunkNormals bright = Case(o).Fit({});
  for (std::size_t x = 0; x < one.normal.size(); ++x) {
    ASSERT_LT((one.normal[x] - bright.normal[x]).norm(), 5e-3);
  }
}

TEST(FitNormals, RefusesAReflectanceOfAnotherAtlas) {
  Case c({});
  c.reflectance.material.pop_back();
  EXPECT_THROW((void)c.Fit({}), Error);
}

}  // namespace
}  // namespace dyxel
