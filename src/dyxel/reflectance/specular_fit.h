// One material's specular parameters from many of its texels; docs/method.md (R9, R10). Internal.
#pragma once

#include <string>
#include <vector>

#include "dyxel/reflectance/dyxels.h"
#include "dyxel/reflectance/texel_samples.h"

namespace dyxel::internal {

// Some texels of one material.
struct MaterialSamples {
  DyxelTile tile;
  std::vector<int> texel;                     // (n) their indices
  std::array<std::vector<float>, 3> diffuse;  // [channel][n], in and out
  std::array<std::vector<float>, 3> normal;   // [axis][n], in and out
  float noise = 0.1F;                         // σ of (R2), relative
};

struct SpecularFit {
  std::vector<double> params;
  double cost = 0;  // Σ robust squared errors, and the prior's
  int steps = 0;    // of Levenberg-Marquardt
  bool converged = false;
};

// Minimises the robust error of all samples over the model's specular parameters, every texel's
// diffuse albedo (kept in `samples.diffuse`) being the best for them: variable projection,
// Levenberg-Marquardt from `start`, or where that is empty from the best of a few starts, `prior`
// among them. A weak pull towards
// `prior` decides where the samples do not.
[[nodiscard]] SpecularFit FitSpecular(const std::string& model,
                                      MaterialSamples& samples,
                                      const std::vector<double>& prior,
                                      const std::vector<double>& start,
                                      const ErrorModel& errors);

// Sets samples.noise to 1.48 times the median of the normalised errors (R2 with σ = 1).
void EstimateNoise(const std::string& model,
                   MaterialSamples& samples,
                   const std::vector<double>& params,
                   const ErrorModel& errors);

struct NormalPassOptions {
  float alpha = 0.2F;
  float gamma = 2;
  int views = 2;
};

// The normals of the samples' texels, diffuse albedo eliminated; updates normal and diffuse.
void FitSampleNormals(const std::string& model,
                      MaterialSamples& samples,
                      const std::vector<double>& params,
                      const ErrorModel& errors,
                      const NormalPassOptions& options);

// Copies all samples of texel `from` of `source` to texel `to` of `target`, of the same frames,
// cameras and lights.
void CopyTexel(const DyxelTile& source, int from, DyxelTile& target, int to);

}  // namespace dyxel::internal
