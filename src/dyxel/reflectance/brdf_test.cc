#include "dyxel/reflectance/brdf.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/error.h"
#include "dyxel/base/random.h"
#include "dyxel/reflectance/dual.h"

namespace dyxel {
namespace {

Vec3d HemisphereDirection(Random& random) {
  const double z = static_cast<double>(random.Uniform());
  const double phi = 2 * kPiD * static_cast<double>(random.Uniform());
  const double s = std::sqrt(1 - z * z);
  return {s * std::cos(phi), s * std::sin(phi), z};
}

template <class Brdf>
typename Brdf::template Params<double> RandomParams(Random& random) {
  typename Brdf::template Params<double> p;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const SpecularInfo& info = Brdf::kSpecular[i];
    p[i] = info.min + (info.max - info.min) * static_cast<double>(random.Uniform());
  }
  return p;
}

template <class Brdf>
class BrdfTest : public testing::Test {};
using Brdfs = testing::Types<Phong, Ggx>;
TYPED_TEST_SUITE(BrdfTest, Brdfs);

TYPED_TEST(BrdfTest, IsReciprocalAndNotNegative) {
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const auto p = RandomParams<TypeParam>(random);
    const Vec3d l = HemisphereDirection(random);
    const Vec3d v = HemisphereDirection(random);
    const double there = EvaluateBrdf<TypeParam, double>(0.5, p, {l.z(), v.z(), l.dot(v)});
    const double back = EvaluateBrdf<TypeParam, double>(0.5, p, {v.z(), l.z(), l.dot(v)});
    EXPECT_GE(there, 0);
    EXPECT_NEAR(there / back, 1, 1e-12);
  }
}

// ∫ S cosθ dω over the hemisphere of outgoing directions stays below 1 (midpoint rule).
TYPED_TEST(BrdfTest, SpecularReflectsNoMoreThanItReceives) {
  Random random(2);
  constexpr int kRings = 400;
  constexpr int kSectors = 400;
  for (int i = 0; i < 6; ++i) {
    const auto p = RandomParams<TypeParam>(random);
    const Vec3d v = HemisphereDirection(random);
    double sum = 0;
    for (int a = 0; a < kRings; ++a) {
      const double z = (a + 0.5) / kRings;
      for (int b = 0; b < kSectors; ++b) {
        const double phi = 2 * kPiD * (b + 0.5) / kSectors;
        const double s = std::sqrt(1 - z * z);
        const Vec3d l(s * std::cos(phi), s * std::sin(phi), z);
        sum += z * TypeParam::template Specular<double>(p, {z, v.z(), l.dot(v)});
      }
    }
    sum *= 2 * kPiD / (kRings * kSectors);
    EXPECT_LE(sum, 1) << "parameters " << p[0] << ' ' << p[1];
  }
}

TYPED_TEST(BrdfTest, IsZeroBehindTheSurfaceAndNeverNan) {
  for (const double n_l : {-1.0, -0.3, 0.0, 1e-9, 0.5, 1.0}) {
    for (const double n_v : {-1.0, 0.0, 1e-9, 0.5, 1.0}) {
      for (const double l_v : {-1.0, -0.999999, 0.0, 1.0}) {
        for (const bool upper : {false, true}) {
          typename TypeParam::template Params<float> p;
          for (std::size_t i = 0; i < p.size(); ++i) {
            const SpecularInfo& info = TypeParam::kSpecular[i];
            p[i] = static_cast<float>(upper ? info.max : info.min);
          }
          const Cosines<float> c = {
              static_cast<float>(n_l), static_cast<float>(n_v), static_cast<float>(l_v)};
          const float f = EvaluateBrdf<TypeParam, float>(0.5F, p, c);
          EXPECT_TRUE(std::isfinite(f));
          if (n_l <= 0 || n_v <= 0) {
            EXPECT_EQ(f, 0);
          }
        }
      }
    }
  }
}

// By every parameter and cosine, against central differences.
TYPED_TEST(BrdfTest, DualGivesTheGradient) {
  constexpr int kNum = TypeParam::kNumSpecular + 3;
  using D = Dual<kNum>;
  Random random(3);
  for (int k = 0; k < 300; ++k) {
    const Vec3d l = HemisphereDirection(random);
    const Vec3d v = HemisphereDirection(random);
    if (std::min(l.z(), v.z()) < 0.05) continue;
    const auto p = RandomParams<TypeParam>(random);
    std::array<double, kNum> x{};
    for (std::size_t i = 0; i < p.size(); ++i) x[i] = p[i];
    x[kNum - 3] = l.z();
    x[kNum - 2] = v.z();
    x[kNum - 1] = l.dot(v);
    const auto evaluate = [&]<class T>(const std::array<T, kNum>& y) {
      typename TypeParam::template Params<T> q;
      for (std::size_t i = 0; i < q.size(); ++i) q[i] = y[i];
      return EvaluateBrdf<TypeParam, T>(
          T(0.4), q, Cosines<T>{y[kNum - 3], y[kNum - 2], y[kNum - 1]});
    };
    std::array<D, kNum> dual;
    for (int i = 0; i < kNum; ++i) dual[i] = D::Variable(x[i], i);
    const D f = evaluate(dual);
    EXPECT_NEAR(f.value / evaluate(x), 1, 1e-12);
    for (int i = 0; i < kNum; ++i) {
      const double step = 1e-6 * std::max(0.1, std::abs(x[i]));
      auto up = x;
      auto down = x;
      up[i] += step;
      down[i] -= step;
      const double slope = (evaluate(up) - evaluate(down)) / (2 * step);
      EXPECT_NEAR(f.d[i], slope, 1e-5 * (std::abs(slope) + std::abs(f.value) + 1)) << i;
    }
  }
}

TYPED_TEST(BrdfTest, LanesAgreeWithTheScalar) {
  Random random(4);
  using Params = typename TypeParam::template Params<Lanes>;
  for (int k = 0; k < 200; ++k) {
    const auto p = RandomParams<TypeParam>(random);
    const Vec3d v = HemisphereDirection(random);
    std::array<Vec3d, 64> l;
    for (Vec3d& direction : l) direction = HemisphereDirection(random);
    Params q;
    for (std::size_t i = 0; i < p.size(); ++i) q[i] = Lanes(static_cast<float>(p[i]));
    const Lanes f =
        EvaluateBrdf<TypeParam, Lanes>(Lanes(0.5F),
                                       q,
                                       {FromLanes<Lanes>([&](int i) { return l[i].z(); }),
                                        Lanes(static_cast<float>(v.z())),
                                        FromLanes<Lanes>([&](int i) { return l[i].dot(v); })});
    for (int i = 0; i < kLaneCount<Lanes>; ++i) {
      const double expected =
          EvaluateBrdf<TypeParam, double>(0.5, p, {l[i].z(), v.z(), l[i].dot(v)});
      EXPECT_NEAR(Lane(f, i) / expected, 1, 2e-3);
    }
  }
}

// Against the closed form at normal incidence: D = 1/(πα²), V = ¼, F = F0.
TEST(Ggx, AtNormalIncidence) {
  const double f = Ggx::Specular<double>({0.5, 0.04}, {1, 1, 1});
  EXPECT_NEAR(f, 0.04 / (4 * kPiD * 0.0625), 1e-12);
}
TEST(Ggx, DiffuseIsLambertsWhereBurleysFactorVanishes) {
  // F90 = ½ + 2 roughness (l·h)² is 1 at roughness ¼ and l = v.
  EXPECT_NEAR(Ggx::DiffuseShape<double>({0.25, 0}, {0.3, 0.3, 1}), 1 / kPiD, 1e-12);
  EXPECT_LT(Ggx::DiffuseShape<double>({0.2, 0}, {0.3, 0.3, 1}), 1 / kPiD);
}
// The lobe at r = v is k_s (m + 2)/2π, and its albedo at normal incidence is k_s.
TEST(Phong, IsNormalised) {
  const Phong::Params<double> p = {0.3, 20};
  EXPECT_NEAR(Phong::Specular<double>(p, {1, 1, 1}), 0.3 * 22 / (2 * kPiD), 1e-12);
  double sum = 0;
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) {
    const double z = (i + 0.5) / kSteps;
    sum += 2 * kPiD / kSteps * z * Phong::Specular<double>(p, {z, 1, z});
  }
  EXPECT_NEAR(sum, 0.3, 1e-6);
}

TEST(BrdfTable, DispatchesByName) {
  EXPECT_THAT(BrdfNames(), testing::ElementsAre("phong", "ggx"));
  EXPECT_THAT(SpecularNames("ggx"), testing::ElementsAre("roughness", "f0"));
  for (const std::string& name : BrdfNames()) {
    EXPECT_EQ(VisitBrdf(name, []<class Brdf>(Brdf) { return std::string(Brdf::kName); }), name);
  }
  EXPECT_THROW(
      {
        try {
          (void)SpecularNames("phnog");
        } catch (const Error& error) {
          EXPECT_THAT(error.what(), testing::HasSubstr("phong, ggx"));
          EXPECT_EQ(error.fault(), Fault::kUsage);
          throw;
        }
      },
      Error);
}

}  // namespace
}  // namespace dyxel
