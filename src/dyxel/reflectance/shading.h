// What every BRDF of the table is a function of.
#pragma once

#include "dyxel/base/lanes.h"
#include "dyxel/math/types.h"

namespace dyxel {

template <Real T>
T Constant(double value) {
  return T(static_cast<ScalarOf<T>>(value));
}

// The three cosines that an isotropic, reciprocal BRDF depends on; n normal, l to the light, v to
// the eye, all unit and in one frame, whichever. What else a formula needs follows: the half vector
// h = (l + v) / |l + v| has n·h = (n·l + n·v) / √(2 + 2 l·v) and l·h = √((1 + l·v) / 2), and the
// mirrored light r has r·v = 2 n·l n·v − l·v.
//
// At n·l <= 0 or n·v <= 0 a BRDF of the table is 0. A surface that is seen although its (mapped or
// smoothed) normal turns away from the eye must not go black: the fits and the renderer pass
// n·v no smaller than kMinCosView.
template <Real T>
struct Cosines {
  T n_l;
  T n_v;
  T l_v;
};

inline constexpr double kMinCosView = 0.05;

// With n·v no smaller than kMinCosView.
template <Real T>
Cosines<T> SeenCosines(const T& n_l, const T& n_v, const T& l_v) {
  const T floor = Constant<T>(kMinCosView);
  return {n_l, Select(n_v < floor, floor, n_v), l_v};
}

// One specular parameter of a BRDF.
struct SpecularInfo {
  const char* name;
  double min;
  double max;
  double initial;
  bool logarithmic;  // fitted by its logarithm
};

}  // namespace dyxel
