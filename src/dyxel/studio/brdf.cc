#include "dyxel/studio/brdf.h"

#include <algorithm>
#include <cmath>

namespace dyxel {

float DielectricFresnel(float cos_incidence, float ior) {
  const float c = std::clamp(cos_incidence, 0.0F, 1.0F);
  const float cos_refracted_squared = 1 - (1 - c * c) / (ior * ior);
  if (cos_refracted_squared <= 0) return 1;
  const float t = std::sqrt(cos_refracted_squared);
  const float parallel = (ior * c - t) / (ior * c + t);
  const float perpendicular = (c - ior * t) / (c + ior * t);
  return 0.5F * (parallel * parallel + perpendicular * perpendicular);
}

StudioBrdfValue EvaluateStudioBrdf(const StudioMaterial& material,
                                   const Vec3f& n,
                                   const Vec3f& l,
                                   const Vec3f& v) {
  const float nl = n.dot(l);
  const float nv = n.dot(v);
  if (nl <= 0 || nv <= 0) return {Rgb::Zero(), 0};
  const Vec3f h = (l + v).normalized();
  const float lh = std::clamp(l.dot(h), 0.0F, 1.0F);

  float diffuse = 1 / kPi;
  if (material.burley) {
    const auto fifth = [](float c) {
      const float x = std::clamp(1 - c, 0.0F, 1.0F);
      return x * x * x * x * x;
    };
    const float grazing = 0.5F + 2 * material.roughness * lh * lh;
    diffuse *= (1 + (grazing - 1) * fifth(nl)) * (1 + (grazing - 1) * fifth(nv));
  }

  const float alpha = std::max(material.roughness * material.roughness, 1e-3F);
  const float a2 = alpha * alpha;
  const float nh = std::clamp(n.dot(h), 0.0F, 1.0F);
  const float b = nh * nh * (a2 - 1) + 1;
  const float distribution = a2 / (kPi * b * b);
  // G2 / (4 n·l n·v) of the height-correlated Smith masking.
  const float masking =
      0.5F / (nl * std::sqrt(a2 + (1 - a2) * nv * nv) + nv * std::sqrt(a2 + (1 - a2) * nl * nl));
  const float specular =
      material.specular * distribution * masking * DielectricFresnel(lh, material.ior);
  return {material.albedo * diffuse, specular};
}

}  // namespace dyxel
