// The studio's own reflectance: a diffuse lobe (Lambert or Burley) plus GGX with exact dielectric
// Fresnel. Written apart from reflectance/, which it serves as truth for.
#pragma once

#include "dyxel/math/types.h"

namespace dyxel {

struct StudioMaterial {
  Rgb albedo = Rgb::Constant(0.5F);  // of the diffuse lobe
  float roughness = 0.5F;            // perceptual; the GGX width is its square
  float ior = 1.45F;                 // of the dielectric; 1 switches the specular lobe off
  float specular = 1;                // scales the specular lobe, in [0, 1]
  bool burley = true;                // Burley's diffuse lobe, else Lambert's
};

// Unpolarised reflectance of a smooth dielectric at cos(angle of incidence), from outside.
[[nodiscard]] float DielectricFresnel(float cos_incidence, float ior);

// The diffuse and the specular lobe (1/sr, without the cosine) for unit vectors away from the
// surface; both 0 where either lies below the surface of normal n. Reciprocal in l and v.
//   specular = D G2 F / (4 n·l n·v): Walter et al. 2007 (D, exact F), Heitz 2014 (height-correlated
//   Smith G2); Burley's diffuse lobe: Burley 2012, eq. 4.
struct StudioBrdfValue {
  Rgb diffuse;
  float specular;
};
[[nodiscard]] StudioBrdfValue EvaluateStudioBrdf(const StudioMaterial& material,
                                                 const Vec3f& n,
                                                 const Vec3f& l,
                                                 const Vec3f& v);

}  // namespace dyxel
