// The least-squares solves of one texel (a lane of T): its diffuse albedo given the specular part,
// the normal equations of the specular parameters with the diffuse albedo eliminated (variable
// projection, Golub and Pereyra 1973, in Kaufman's approximation), and its normal. Internal to the
// fits; every function takes the samples as gathered. docs/method.md (R3), (R4), (R7), (R9).
#pragma once

#include <array>
#include <vector>

#include "dyxel/reflectance/texel_samples.h"

namespace dyxel::internal {

template <Real T>
T ValueOf(const T& x) {
  return x;
}
template <int N, Real T>
T ValueOf(const Dual<N, T>& x) {
  return x.value;
}

// Σ_c (S_c − ρ_c diffuse_c − specular_c)².
template <Real U, Real T>
T SquaredResidual(const Triple<T>& radiance, const Triple<T>& rho, const Prediction<U>& p) {
  T sum(0);
  for (std::size_t c = 0; c < 3; ++c) {
    const T r = radiance[c] - rho[c] * ValueOf(p.diffuse[c]) - ValueOf(p.specular[c]);
    sum += r * r;
  }
  return sum;
}

inline constexpr double kMaxDiffuse = 1.5;  // a texel brighter than white: light that we missed

// The diffuse albedo (R3) by `rounds` of reweighted linear least squares; the first takes all
// weights as 1 where `start` is null, else those at `start`.
template <Real U, Real T>
Triple<T> SolveDiffuse(const TexelSamples<T>& texel,
                       const std::vector<Prediction<U>>& predictions,
                       const T& gain,
                       const ErrorModel& errors,
                       int rounds,
                       const Triple<T>* start) {
  const T zero(0);
  Triple<T> rho = {zero, zero, zero};
  if (start != nullptr) rho = *start;
  for (int round = 0; round < rounds; ++round) {
    const bool plain = start == nullptr && round == 0;
    Triple<T> dd = {zero, zero, zero};
    Triple<T> ds = {zero, zero, zero};
    for (std::size_t i = 0; i < texel.samples.size(); ++i) {
      const auto& sample = texel.samples[i];
      const Prediction<U>& p = predictions[i];
      T w = sample.weight * sample.precision;
      if (!plain) {
        const T u2 = gain * sample.precision * SquaredResidual(sample.radiance, rho, p);
        w *= RobustLoss(u2, errors.robust).weight;
      }
      for (std::size_t c = 0; c < 3; ++c) {
        const T wd = w * ValueOf(p.diffuse[c]);
        dd[c] += wd * ValueOf(p.diffuse[c]);
        ds[c] += wd * (sample.radiance[c] - ValueOf(p.specular[c]));
      }
    }
    for (std::size_t c = 0; c < 3; ++c) {
      rho[c] = Clamp(ds[c] / PositiveOrOne(dd[c]), zero, Constant<T>(kMaxDiffuse));
    }
  }
  return rho;
}

// E of (R4), the mean robust error, and the gathered trust: Σ weight · robust weight · cosine.
template <Real T>
struct FitError {
  T mean;
  T information;
};
template <Real U, Real T>
FitError<T> MeasureError(const TexelSamples<T>& texel,
                         const std::vector<Prediction<U>>& predictions,
                         const T& gain,
                         const ErrorModel& errors,
                         const Triple<T>& rho) {
  FitError<T> out{T(0), T(0)};
  for (std::size_t i = 0; i < texel.samples.size(); ++i) {
    const auto& sample = texel.samples[i];
    const T u2 = gain * sample.precision * SquaredResidual(sample.radiance, rho, predictions[i]);
    const Loss<T> loss = RobustLoss(u2, errors.robust);
    out.mean += sample.weight * loss.value;
    out.information += sample.weight * loss.weight * sample.cosine;
  }
  out.mean /= PositiveOrOne(texel.total_weight);
  return out;
}

// The Gauss-Newton model of Σ weight · loss(u²) by N parameters: half its gradient and Hessian.
template <int N, Real T>
struct NormalEquations {
  T cost;
  std::array<T, N> gradient;
  std::array<std::array<T, N>, N> hessian;  // lower triangle
};

// Of the parameters that the predictions' duals stand for, at diffuse albedo `rho`; with
// `eliminate`, `rho` is the best for them and follows them (variable projection).
template <int N, Real T>
NormalEquations<N, T> Linearize(const TexelSamples<T>& texel,
                                const std::vector<Prediction<Dual<N, T>>>& predictions,
                                const T& gain,
                                const ErrorModel& errors,
                                const Triple<T>& rho,
                                bool eliminate) {
  const T zero(0);
  NormalEquations<N, T> out{};
  out.cost = zero;
  out.gradient.fill(zero);
  for (auto& row : out.hessian) row.fill(zero);
  Triple<T> dd = {zero, zero, zero};
  std::array<std::array<T, N>, 3> dj;
  for (auto& row : dj) row.fill(zero);
  for (std::size_t i = 0; i < texel.samples.size(); ++i) {
    const auto& sample = texel.samples[i];
    const auto& p = predictions[i];
    const T relative = gain * sample.precision;
    const Loss<T> loss =
        RobustLoss(relative * SquaredResidual(sample.radiance, rho, p), errors.robust);
    out.cost += sample.weight * loss.value;
    const T w = sample.weight * relative * loss.weight;
    for (std::size_t c = 0; c < 3; ++c) {
      std::array<T, N> j;
      for (std::size_t k = 0; k < N; ++k) j[k] = rho[c] * p.diffuse[c].d[k] + p.specular[c].d[k];
      const T r = rho[c] * p.diffuse[c].value + p.specular[c].value - sample.radiance[c];
      for (std::size_t k = 0; k < N; ++k) {
        const T wj = w * j[k];
        out.gradient[k] += wj * r;
        dj[c][k] += wj * p.diffuse[c].value;
        for (std::size_t m = 0; m <= k; ++m) out.hessian[k][m] += wj * j[m];
      }
      dd[c] += w * p.diffuse[c].value * p.diffuse[c].value;
    }
  }
  if (eliminate) {
    for (std::size_t c = 0; c < 3; ++c) {
      const T inverse = T(1) / PositiveOrOne(dd[c]);
      for (std::size_t k = 0; k < N; ++k) {
        for (std::size_t m = 0; m <= k; ++m) out.hessian[k][m] -= dj[c][k] * dj[c][m] * inverse;
      }
    }
  }
  return out;
}

// ---- normals ----

// (R4): α E(n) + β Δ(n)^γ, Δ the angle to `toward`.
template <Real T>
struct NormalPrior {
  Triple<T> toward;
  T alpha;
  T beta;
  float gamma = 2;
};

template <Real T>
struct NormalSolution {
  Triple<T> normal;
  Triple<T> rho;
  T energy;                  // (R4)
  std::array<T, 2> slope;    // the normal's, x/z and y/z
  std::array<T, 3> hessian;  // half the energy's, by the slopes: aa, ab, bb
};

// n = (a, b, 1) / |(a, b, 1)|, a and b at most kMaxSlope (about 68°).
inline constexpr double kMaxSlope = 2.5;

template <Real T>
Triple<Dual<2, T>> NormalOf(const T& a, const T& b) {
  using D = Dual<2, T>;
  const D x = D::Variable(a, 0);
  const D y = D::Variable(b, 1);
  const D inverse = D(T(1)) / Sqrt(x * x + y * y + T(1));
  return {x * inverse, y * inverse, inverse};
}

// β Δ^γ and its Gauss-Newton model, added to `equations`.
template <Real T>
void AddPrior(const NormalPrior<T>& prior,
              const Triple<Dual<2, T>>& normal,
              NormalEquations<2, T>& equations) {
  using std::asin;
  Triple<T> e;
  T c2(0);  // squared chord
  for (std::size_t k = 0; k < 3; ++k) {
    e[k] = normal[k].value - prior.toward[k];
    c2 += e[k] * e[k];
  }
  const T chord = Sqrt(Clamp(c2, Constant<T>(1e-8), T(4)));
  const T half = Clamp(chord * Constant<T>(0.5), T(0), Constant<T>(0.999));
  const T angle = T(2) * asin(half);
  const T gamma(prior.gamma);
  const T power = Exp((gamma - T(1)) * Log(angle));  // Δ^(γ − 1)
  // ∂Δ^γ / ∂chord².
  const T w = prior.beta * gamma * power / (T(2) * chord * Sqrt(T(1) - half * half));
  equations.cost += prior.beta * power * angle;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < 2; ++i) {
      equations.gradient[i] += w * normal[k].d[i] * e[k];
      for (std::size_t m = 0; m <= i; ++m) {
        equations.hessian[i][m] += w * normal[k].d[i] * normal[k].d[m];
      }
    }
  }
}

template <class Brdf, Real T>
class NormalSolver {
 public:
  // Levenberg-Marquardt over the two slopes from `start`; with `free_diffuse` the diffuse albedo is
  // eliminated, else it stays `rho`. A texel without samples gets `prior.toward`.
  NormalSolution<T> Solve(const TexelSamples<T>& texel,
                          const typename Brdf::template Params<T>& params,
                          const Triple<T>& start,
                          const Triple<T>& rho,
                          bool free_diffuse,
                          const NormalPrior<T>& prior,
                          const T& gain,
                          const ErrorModel& errors,
                          int max_steps) {
    const T zero(0);
    T a = start[0] / Max(start[2], Constant<T>(0.2));
    T b = start[1] / Max(start[2], Constant<T>(0.2));
    const T limit = Constant<T>(kMaxSlope);
    a = Clamp(a, -limit, limit);
    b = Clamp(b, -limit, limit);
    Triple<T> best_rho = rho;
    NormalEquations<2, T> at = At(texel, params, a, b, best_rho, free_diffuse, prior, gain, errors);
    T damping = Constant<T>(1e-2);
    for (int step = 0; step < max_steps; ++step) {
      const T tiny = Constant<T>(1e-12);
      const T h00 = at.hessian[0][0] * (T(1) + damping) + tiny;
      const T h11 = at.hessian[1][1] * (T(1) + damping) + tiny;
      const T h10 = at.hessian[1][0];
      const T det = h00 * h11 - h10 * h10;
      const T inverse = T(1) / PositiveOrOne(det);
      const T da = (h11 * at.gradient[0] - h10 * at.gradient[1]) * inverse;
      const T db = (h00 * at.gradient[1] - h10 * at.gradient[0]) * inverse;
      const T half = Constant<T>(0.5);  // the longest step
      const T trial_a = Clamp(a - Clamp(da, -half, half), -limit, limit);
      const T trial_b = Clamp(b - Clamp(db, -half, half), -limit, limit);
      Triple<T> trial_rho = best_rho;
      const NormalEquations<2, T> trial =
          At(texel, params, trial_a, trial_b, trial_rho, free_diffuse, prior, gain, errors);
      const auto better = trial.cost < at.cost;
      const T moved = Select(better, da * da + db * db, zero);
      a = Select(better, trial_a, a);
      b = Select(better, trial_b, b);
      for (std::size_t c = 0; c < 3; ++c) {
        best_rho[c] = Select(better, trial_rho[c], best_rho[c]);
      }
      const auto retry = (at.cost <= trial.cost) & (damping < T(100));
      at.cost = Select(better, trial.cost, at.cost);
      for (std::size_t i = 0; i < 2; ++i) {
        at.gradient[i] = Select(better, trial.gradient[i], at.gradient[i]);
        for (std::size_t m = 0; m <= i; ++m) {
          at.hessian[i][m] = Select(better, trial.hessian[i][m], at.hessian[i][m]);
        }
      }
      damping = damping * Select(better, Constant<T>(0.2), T(8));
      // A lane that stands still moves again only with a shorter step.
      if (!Any((Constant<T>(1e-6) < moved) | retry)) break;
    }
    const Triple<Dual<2, T>> n = NormalOf(a, b);
    return {{n[0].value, n[1].value, n[2].value},
            best_rho,
            at.cost,
            {a, b},
            {at.hessian[0][0], at.hessian[1][0], at.hessian[1][1]}};
  }

 private:
  NormalEquations<2, T> At(const TexelSamples<T>& texel,
                           const typename Brdf::template Params<T>& params,
                           const T& a,
                           const T& b,
                           Triple<T>& rho,
                           bool free_diffuse,
                           const NormalPrior<T>& prior,
                           const T& gain,
                           const ErrorModel& errors) {
    using D = Dual<2, T>;
    const Triple<D> normal = NormalOf(a, b);
    typename Brdf::template Params<D> constants;
    for (std::size_t i = 0; i < constants.size(); ++i) constants[i] = D(params[i]);
    predictions_.clear();
    for (const auto& sample : texel.samples) {
      predictions_.push_back(Predict<Brdf, D, T>(texel, sample, normal, constants));
    }
    if (free_diffuse) rho = SolveDiffuse(texel, predictions_, gain, errors, 2, &rho);
    NormalEquations<2, T> equations =
        Linearize<2, T>(texel, predictions_, gain, errors, rho, free_diffuse);
    const T share = prior.alpha / PositiveOrOne(texel.total_weight);
    equations.cost *= share;
    for (std::size_t i = 0; i < 2; ++i) {
      equations.gradient[i] *= share;
      for (std::size_t m = 0; m <= i; ++m) equations.hessian[i][m] *= share;
    }
    AddPrior(prior, normal, equations);
    return equations;
  }

  std::vector<Prediction<Dual<2, T>>> predictions_;
};

}  // namespace dyxel::internal
