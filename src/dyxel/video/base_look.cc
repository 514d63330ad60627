#include "dyxel/video/base_look.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "dyxel/base/error.h"
#include "dyxel/reflectance/brdf.h"

namespace dyxel {
namespace {

constexpr double kMinRoughness = 0.05;
constexpr double kMinF0 = 1e-4;

struct Sample {
  double n_l, n_v, l_v;
  double weight;  // solid angle times what a step of radiance is worth on a display
  double target;  // of f, with the material's mean diffuse albedo
};

// Views as a picture of a sphere has them (even in projected area); lights over the hemisphere in
// cells of one solid angle. Errors count as a display shows them: by the slope of a power of 1/2.2
// at the target's radiance, floored. Both angles stay within 60°: beyond, Fresnel's rise, which a
// Phong lobe lacks, would rule the fit, and make highlights seen from the front too faint and too
// sharp.
std::vector<Sample> MakeSamples(const std::string& model, const Material& material, double albedo) {
  std::vector<Sample> samples;
  constexpr double kLeastCosine = 0.5;
  constexpr double kMostSine2 = 1 - kLeastCosine * kLeastCosine;
  constexpr int kViews = 6;
  constexpr int kTheta = 32;
  constexpr int kPhi = 16;
  for (int k = 0; k < kViews; ++k) {
    const double theta_v = std::asin(std::sqrt(kMostSine2 * (k + 0.5) / kViews));
    for (int i = 0; i < kTheta; ++i) {
      const double n_l = 1 - (1 - kLeastCosine) * (i + 0.5) / kTheta;
      const double sin_l = std::sqrt(1 - n_l * n_l);
      for (int j = 0; j < kPhi; ++j) {
        const double phi = kPiD * (j + 0.5) / kPhi;
        const double n_v = std::cos(theta_v);
        samples.push_back({n_l,
                           n_v,
                           n_l * n_v - sin_l * std::sin(theta_v) * std::cos(phi),
                           2 * kPiD * (1 - kLeastCosine) / (kTheta * kPhi),
                           0});
      }
    }
  }
  VisitBrdf(model, [&](auto brdf) {
    using Brdf = decltype(brdf);
    typename Brdf::template Params<double> params;
    Require(material.specular.size() >= params.size(),
            Fault::kUsage,
            "material '{}' has {} specular parameters, '{}' has {}",
            material.name,
            material.specular.size(),
            model,
            params.size());
    for (std::size_t p = 0; p < params.size(); ++p) {
      params[p] = static_cast<double>(material.specular[p]);
    }
    for (Sample& s : samples) {
      s.target = EvaluateBrdf<Brdf, double>(albedo, params, {s.n_l, s.n_v, s.l_v});
      s.weight *= std::pow(s.n_l * s.target + 0.1 * albedo / kPiD, -2 * (1 - 1 / 2.2));
    }
  });
  return samples;
}

double Residual(const Sample& s, double albedo, double roughness, double f0, double w, double g) {
  const BaseLobes lobes = EvaluateBaseLook(roughness, w, f0, s.n_l, s.n_v, s.l_v);
  return s.n_l * (g * albedo * lobes.diffuse + lobes.specular - s.target);
}

struct Fit {
  double roughness = 1, strength = 0, gain = 1;
  double cost = 0;
};

// Gauss-Newton over (strength, gain) at a fixed roughness. Strength is F0 with w = 1 where f0 < 0,
// else w.
Fit SolveLinearPart(
    const std::vector<Sample>& samples, double albedo, double roughness, double f0, double given) {
  const auto residual = [&](const Sample& s, double strength, double gain) {
    return f0 < 0 ? Residual(s, albedo, roughness, strength, 1, gain)
                  : Residual(s, albedo, roughness, f0, strength, gain);
  };
  Fit fit{roughness, given >= 0 ? given : 0.04, 1, 0};
  for (int round = 0; round < 4; ++round) {
    // The residual is bilinear in the two: differences over any step are its derivatives.
    double aa = 1e-12, ab = 0, bb = 1e-12, ra = 0, rb = 0;
    for (const Sample& s : samples) {
      const double r = residual(s, fit.strength, fit.gain);
      const double a = given >= 0 ? 0 : residual(s, fit.strength + 1, fit.gain) - r;
      const double b = residual(s, fit.strength, fit.gain + 1) - r;
      aa += s.weight * a * a;
      ab += s.weight * a * b;
      bb += s.weight * b * b;
      ra += s.weight * a * r;
      rb += s.weight * b * r;
    }
    const double determinant = aa * bb - ab * ab;
    if (!(determinant > 0)) break;
    fit.strength = std::clamp(fit.strength - (bb * ra - ab * rb) / determinant, 0.0, 1.0);
    fit.gain = std::clamp(fit.gain - (aa * rb - ab * ra) / determinant, 0.0, 4.0);
  }
  // The gain alone, now that the strength is within its bounds.
  double bb = 1e-12;
  double rb = 0;
  for (const Sample& s : samples) {
    const double r = residual(s, fit.strength, fit.gain);
    const double b = residual(s, fit.strength, fit.gain + 1) - r;
    bb += s.weight * b * b;
    rb += s.weight * b * r;
  }
  fit.gain = std::clamp(fit.gain - rb / bb, 0.0, 4.0);
  for (const Sample& s : samples) {
    const double r = residual(s, fit.strength, fit.gain);
    fit.cost += s.weight * r * r;
  }
  return fit;
}

// The best roughness: a coarse walk, then golden section around it.
Fit Search(const std::vector<Sample>& samples, double albedo, double f0) {
  const auto at = [&](double roughness) {
    return SolveLinearPart(samples, albedo, roughness, f0, -1);
  };
  constexpr int kSteps = 20;
  const auto grid = [](int i) { return kMinRoughness + (1 - kMinRoughness) * i / kSteps; };
  Fit best = at(grid(0));
  int best_step = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const Fit fit = at(grid(i));
    if (fit.cost < best.cost) {
      best = fit;
      best_step = i;
    }
  }
  double low = grid(std::max(0, best_step - 1));
  double high = grid(std::min(kSteps, best_step + 1));
  constexpr double kGolden = 0.6180339887498949;
  Fit a = at(high - kGolden * (high - low));
  Fit b = at(low + kGolden * (high - low));
  for (int i = 0; i < 18; ++i) {
    if (a.cost < b.cost) {
      high = b.roughness;
      b = a;
      a = at(high - kGolden * (high - low));
    } else {
      low = a.roughness;
      a = b;
      b = at(low + kGolden * (high - low));
    }
  }
  for (const Fit& fit : {a, b}) {
    if (fit.cost < best.cost) best = fit;
  }
  return best;
}

double Albedo(const Material& material) {
  const double mean = static_cast<double>(material.mean_diffuse.mean());
  return std::isfinite(mean) && mean > 0.01 ? mean : 0.2;
}

}  // namespace

BaseLobes EvaluateBaseLook(
    double roughness, double specular, double f0, double n_l, double n_v, double l_v) {
  const double v_h = std::sqrt(std::max(0.0, (1 + l_v) / 2));
  const double n_h = v_h > 0 ? std::min(1.0, (n_l + n_v) / (2 * v_h)) : 0.0;
  const double rest = 1 - v_h;
  const double fresnel = specular * (f0 + (1 - f0) * rest * rest * rest * rest * rest);
  const double a2 = roughness * roughness * roughness * roughness;
  const double t = n_h * n_h * (a2 - 1) + 1;
  const double d = a2 / (kPiD * t * t);
  const double v = 0.5 / (n_l * std::sqrt(n_v * n_v * (1 - a2) + a2) +
                          n_v * std::sqrt(n_l * n_l * (1 - a2) + a2));
  return {d * v * fresnel, (1 - fresnel) / kPiD};
}

BaseLooks FitBaseLooks(const std::string& model, std::span<const Material> materials) {
  std::vector<std::vector<Sample>> samples;
  double f0 = kMinF0;
  for (const Material& material : materials) {
    samples.push_back(MakeSamples(model, material, Albedo(material)));
    if (model == Ggx::kName) {
      f0 = std::max(f0, static_cast<double>(material.specular[1]));
    } else {
      f0 = std::max(f0, Search(samples.back(), Albedo(material), -1).strength);
    }
  }
  f0 = std::min(f0, 0.95);

  BaseLooks looks;
  looks.ior = static_cast<float>((1 + std::sqrt(f0)) / (1 - std::sqrt(f0)));
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const double albedo = Albedo(materials[m]);
    Fit fit;
    if (model == Ggx::kName) {
      const std::vector<float>& p = materials[m].specular;
      fit = SolveLinearPart(
          samples[m], albedo, static_cast<double>(p[0]), f0, static_cast<double>(p[1]) / f0);
    } else {
      fit = Search(samples[m], albedo, f0);
    }
    double sum = 0;
    for (const Sample& s : samples[m]) {
      const double r = Residual(s, albedo, fit.roughness, f0, fit.strength, fit.gain);
      sum += r * r;
    }
    looks.looks.push_back(
        {static_cast<float>(fit.roughness),
         static_cast<float>(fit.strength),
         static_cast<float>(fit.gain),
         static_cast<float>(std::sqrt(sum / static_cast<double>(samples[m].size())))});
  }
  return looks;
}

}  // namespace dyxel
