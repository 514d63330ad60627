// The studio's GGX, which is the truth of the tests, against the estimator's: written apart, they
// must agree but for Schlick's approximation of Fresnel's law.
#include <cmath>

#include <gtest/gtest.h>

#include "dyxel/reflectance/brdf.h"
#include "dyxel/studio/brdf.h"

namespace dyxel {
namespace {

Vec3f Direction(float theta, float phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

TEST(Ggx, StudioAndEstimatorAgree) {
  const Vec3f n = Vec3f::UnitZ();
  for (const float roughness : {0.3F, 0.5F, 0.8F}) {
    for (const float ior : {1.35F, 1.5F}) {
      StudioMaterial material;
      material.albedo = Rgb(0.2F, 0.5F, 0.8F);
      material.roughness = roughness;
      material.ior = ior;
      const float f0 = std::pow((ior - 1) / (ior + 1), 2.0F);
      for (float theta_l = 0.1F; theta_l < 1.3F; theta_l += 0.3F) {
        for (float theta_v = 0.05F; theta_v < 1.3F; theta_v += 0.3F) {
          for (float phi = 0; phi < 3.1F; phi += 0.5F) {
            const Vec3f l = Direction(theta_l, 0.3F);
            const Vec3f v = Direction(theta_v, 0.3F + phi);
            const StudioBrdfValue truth = EvaluateStudioBrdf(material, n, l, v);
            const Cosines<float> c{n.dot(l), n.dot(v), l.dot(v)};
            const Ggx::Params<float> specular = {roughness, f0};
            // With F0 = 1 the estimator's Fresnel term is 1: distribution and shadowing alone.
            const float unit = Ggx::Specular<float>({roughness, 1.0F}, c);
            const float cos_lh = std::sqrt((1 + c.l_v) / 2);
            const float fresnel = DielectricFresnel(cos_lh, ior);
            EXPECT_NEAR(unit * fresnel, truth.specular, 1e-3F * truth.specular + 1e-6F);
            // Schlick's law is within 0.02 of Fresnel's up to 60 degrees.
            if (cos_lh > 0.5F) {
              EXPECT_NEAR(Ggx::Specular<float>(specular, c), truth.specular, 0.02F * unit + 1e-6F);
            }
            EXPECT_NEAR(0.5F * Ggx::DiffuseShape<float>(specular, c), truth.diffuse[1], 1e-4F);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace dyxel
