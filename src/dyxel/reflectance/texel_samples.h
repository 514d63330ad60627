// The samples of as many texels as T has lanes, gathered from a tile, and what a BRDF predicts for
// them. Internal to the fits. docs/method.md (R1, R2).
//
// Errors are free of exposure: residuals are divided by the texel's own rms radiance, and a
// sample's expected variance grows with its irradiance (shot noise and errors of geometry alike),
//   u_i² = Σ_c (S_ic − L_ic)² / (3 s² σ² (f + (1 − f) q_i)),                                  (R2)
// s the texel's rms radiance, q_i the sample's irradiance over the texel's mean, f a floor, σ the
// relative noise of the texel's material. The robust loss is Cauchy's: k² ln(1 + u²/k²).
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "dyxel/reflectance/brdf.h"
#include "dyxel/reflectance/dual.h"
#include "dyxel/reflectance/dyxels.h"

namespace dyxel::internal {

template <Real T>
using Triple = std::array<T, 3>;

// T from consecutive floats, and back.
template <Real T>
T Load(const float* p) {
  if constexpr (kLaneCount<T> == 1) {
    return static_cast<T>(*p);
  } else {
    return T::load_unaligned(p);
  }
}
template <Real T>
void Store(const T& x, float* p) {
  if constexpr (kLaneCount<T> == 1) {
    *p = static_cast<float>(x);
  } else {
    x.store_unaligned(p);
  }
}

template <class A, class B>
auto Dot(const std::array<A, 3>& a, const std::array<B, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <Real T>
T Max(const T& a, const T& b) {
  return Select(a < b, b, a);
}
template <Real T>
T Min(const T& a, const T& b) {
  return Select(b < a, b, a);
}
// x where it is positive, else 1: a divisor.
template <Real T>
T PositiveOrOne(const T& x) {
  return Select(T(0) < x, x, T(1));
}

// How errors are weighed.
struct ErrorModel {
  float robust = 2.5F;  // k; 0: plain least squares
  float floor = 0.2F;   // f
};

template <Real T>
struct TexelSamples {
  struct Light {
    Triple<T> direction;
    Triple<T> irradiance;
  };
  struct Sample {
    int first_light;  // those of its frame
    int num_lights;
    Triple<T> view;
    Triple<T> radiance;
    T weight;     // the capture's trust, in [0, 1]
    T cosine;     // share of the lamps' light that the texel's tilt leaves
    T strength;   // q
    T precision;  // 1 / (f + (1 − f) q)
  };
  std::vector<Light> lights;
  std::vector<Sample> samples;
  T scale;         // s
  T total_weight;  // Σ weight

  // Texels [offset, offset + lanes) of the tile with normal `n`, whose irradiance sets q. Only
  // samples that some lamp reaches count. `best_views` > 0 keeps so many cameras a frame, those
  // that see the texel most frontally.
  void Gather(const DyxelTile& tile,
              int offset,
              const Triple<T>& n,
              const ErrorModel& errors,
              int best_views = 0);

  // 1 / (3 s² σ²) of (R2).
  [[nodiscard]] T Gain(const T& noise) const {
    return T(1) / (T(3) * scale * scale * noise * noise);
  }
};

// The two parts of the predicted radiance of a sample: L_c = ρ_c diffuse_c + specular_c. U is T or
// a Dual of it.
template <Real U>
struct Prediction {
  Triple<U> diffuse;
  Triple<U> specular;
};

template <class Brdf, Real U, Real T>
[[gnu::flatten]] Prediction<U> Predict(const TexelSamples<T>& texel,
                                       const typename TexelSamples<T>::Sample& sample,
                                       const Triple<U>& normal,
                                       const typename Brdf::template Params<U>& params) {
  const U zero(T(0));
  Prediction<U> out;
  out.diffuse.fill(zero);
  out.specular.fill(zero);
  const U n_v = Dot(normal, sample.view);
  for (int j = 0; j < sample.num_lights; ++j) {
    const auto& light = texel.lights[static_cast<std::size_t>(sample.first_light + j)];
    const U n_l = Dot(normal, light.direction);
    const auto lit = zero < n_l;
    if (!Any(lit)) continue;
    const Cosines<U> cosines = SeenCosines<U>(n_l, n_v, U(Dot(light.direction, sample.view)));
    const U diffuse = Select(lit, n_l * Brdf::template DiffuseShape<U>(params, cosines), zero);
    const U specular = Select(lit, n_l * Brdf::template Specular<U>(params, cosines), zero);
    for (std::size_t c = 0; c < 3; ++c) {
      out.diffuse[c] += diffuse * light.irradiance[c];
      out.specular[c] += specular * light.irradiance[c];
    }
  }
  return out;
}

template <Real T>
void TexelSamples<T>::Gather(const DyxelTile& tile,
                             int offset,
                             const Triple<T>& n,
                             const ErrorModel& errors,
                             int best_views) {
  constexpr std::size_t kMaxCameras = 64;  // whose rank is known
  const T zero(0);
  lights.clear();
  samples.clear();
  T sum_square(0);
  T sum_irradiance(0);
  total_weight = zero;
  for (int frame = 0; frame < tile.frames; ++frame) {
    const int first_light = static_cast<int>(lights.size());
    T reach(0);
    T irradiance(0);  // on the texel
    for (int j = 0; j < tile.lights; ++j) {
      Light light;
      for (std::size_t c = 0; c < 3; ++c) {
        const int axis = static_cast<int>(c);
        light.direction[c] = Load<T>(tile.LightDir(frame, j, axis) + offset);
        light.irradiance[c] = Load<T>(tile.Irradiance(frame, j, axis) + offset);
      }
      const T sum = light.irradiance[0] + light.irradiance[1] + light.irradiance[2];
      if (!Any(zero < sum)) continue;
      reach += sum;
      irradiance += sum * Max(zero, Dot(n, light.direction));
      lights.push_back(light);
    }
    const int num_lights = static_cast<int>(lights.size()) - first_light;
    if (num_lights == 0) continue;

    const std::size_t first_sample = samples.size();
    for (int i = 0; i < tile.cameras; ++i) {
      Sample sample;
      sample.weight = Select(zero < reach, Load<T>(tile.Weight(frame, i) + offset), zero);
      if (!Any(zero < sample.weight)) continue;
      sample.first_light = first_light;
      sample.num_lights = num_lights;
      sample.cosine = irradiance / PositiveOrOne(reach);
      sample.strength = irradiance;
      for (std::size_t c = 0; c < 3; ++c) {
        const int axis = static_cast<int>(c);
        sample.view[c] = Load<T>(tile.ViewDir(frame, i, axis) + offset);
        sample.radiance[c] = Load<T>(tile.Radiance(frame, i, axis) + offset);
      }
      samples.push_back(sample);
    }
    if (best_views > 0) {
      // A camera's rank is the number of cameras that see the texel better.
      std::array<T, kMaxCameras> frontal;
      const std::size_t count = std::min(samples.size() - first_sample, kMaxCameras);
      for (std::size_t a = 0; a < count; ++a) {
        const Sample& sample = samples[first_sample + a];
        frontal[a] = Select(zero < sample.weight, Dot(n, sample.view), T(-2));
      }
      for (std::size_t a = 0; a < count; ++a) {
        T rank(0);
        for (std::size_t b = 0; b < count; ++b) {
          rank += Select(frontal[a] < frontal[b], T(1), zero);
        }
        T& weight = samples[first_sample + a].weight;
        weight = Select(rank < Constant<T>(best_views - 0.5), weight, zero);
      }
    }
    for (std::size_t a = first_sample; a < samples.size(); ++a) {
      const Sample& sample = samples[a];
      total_weight += sample.weight;
      sum_irradiance += sample.weight * sample.strength;
      sum_square += sample.weight * Dot(sample.radiance, sample.radiance);
    }
  }
  const T one(1);
  scale = PositiveOrOne(Sqrt(sum_square / (T(3) * PositiveOrOne(total_weight))));
  const T mean = PositiveOrOne(sum_irradiance / PositiveOrOne(total_weight));
  const T floor(errors.floor);
  for (Sample& sample : samples) {
    sample.strength /= mean;
    sample.precision = one / (floor + (one - floor) * sample.strength);
  }
}

// Cauchy's loss of u² and its derivative by u²: the weight in reweighted least squares.
template <Real T>
struct Loss {
  T value;
  T weight;
};
template <Real T>
Loss<T> RobustLoss(const T& u2, float robust) {
  if (robust <= 0) return {u2, T(1)};
  const T k2(robust * robust);
  const T t = T(1) + u2 / k2;
  return {k2 * Log(t), T(1) / t};
}

}  // namespace dyxel::internal
