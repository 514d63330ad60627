#include "dyxel/reflectance/specular_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "dyxel/base/parallel.h"
#include "dyxel/reflectance/texel_solver.h"

namespace dyxel::internal {
namespace {

constexpr std::size_t kBlock = 128;  // texels of one task
constexpr int kMaxSteps = 40;
constexpr double kMinDecrease = 1e-4;  // relative, of a step that goes on
// The prior weighs as much as so many samples one noise off for a quarter of a parameter's range.
constexpr double kPriorSamples = 30;

// f.template operator()<T>(offset) over texels [begin, end), in lanes as far as they go.
template <class F>
void ForLanes(std::size_t begin, std::size_t end, F&& f) {
  std::size_t i = begin;
  for (; i + kLaneCount<Lanes> <= end; i += kLaneCount<Lanes>) f.template operator()<Lanes>(i);
  for (; i < end; ++i) f.template operator()<float>(i);
}

template <Real T>
Triple<T> LoadTriple(const std::array<std::vector<float>, 3>& array, std::size_t i) {
  return {Load<T>(array[0].data() + i), Load<T>(array[1].data() + i), Load<T>(array[2].data() + i)};
}
template <Real T>
void StoreTriple(const Triple<T>& x, std::array<std::vector<float>, 3>& array, std::size_t i) {
  for (std::size_t c = 0; c < 3; ++c) Store(x[c], array[c].data() + i);
}

// A parameter as the search sees it: its logarithm where it is so declared.
double ToSearch(const SpecularInfo& info, double p) { return info.logarithmic ? std::log(p) : p; }
double FromSearch(const SpecularInfo& info, double x) { return info.logarithmic ? std::exp(x) : x; }

template <int N>
struct Equations {
  double cost = 0;
  Eigen::Matrix<double, N, 1> gradient = Eigen::Matrix<double, N, 1>::Zero();
  Eigen::Matrix<double, N, N> hessian = Eigen::Matrix<double, N, N>::Zero();
};

template <class Brdf>
class Problem {
 public:
  static constexpr int kN = Brdf::kNumSpecular;
  using Vector = Eigen::Matrix<double, kN, 1>;

  Problem(MaterialSamples& samples, const std::vector<double>& prior, const ErrorModel& errors)
      : samples_(samples), errors_(errors) {
    for (int i = 0; i < kN; ++i) {
      const SpecularInfo& info = Info(i);
      low_[i] = ToSearch(info, info.min);
      high_[i] = ToSearch(info, info.max);
      prior_[i] = ToSearch(info, prior[static_cast<std::size_t>(i)]);
    }
  }

  SpecularFit Solve(const std::vector<double>& start_params) {
    // The best of: the prior, and each parameter a quarter from either end of its range.
    std::vector<Vector> starts = {Clamped(prior_)};
    if (!start_params.empty()) {
      for (int i = 0; i < kN; ++i) {
        starts[0][i] = ToSearch(Info(i), start_params[static_cast<std::size_t>(i)]);
      }
    }
    for (int i = 0; i < kN && start_params.empty(); ++i) {
      for (const double share : {0.25, 0.75}) {
        Vector x = starts[0];
        x[i] = low_[i] + share * (high_[i] - low_[i]);
        starts.push_back(x);
      }
    }
    Vector x = starts[0];
    Equations<kN> at;
    at.cost = std::numeric_limits<double>::infinity();
    auto diffuse = samples_.diffuse;
    for (const Vector& start : starts) {
      const Equations<kN> trial = At(start, true);
      if (trial.cost < at.cost) {
        at = trial;
        x = start;
        diffuse = samples_.diffuse;
      }
    }
    samples_.diffuse = diffuse;

    SpecularFit fit;
    double damping = 1e-2;
    for (; fit.steps < kMaxSteps && !fit.converged; ++fit.steps) {
      Eigen::Matrix<double, kN, kN> h = at.hessian;
      h.diagonal() *= 1 + damping;
      h.diagonal().array() += 1e-12;
      const Vector trial_x = Clamped(x - h.ldlt().solve(at.gradient));
      const Equations<kN> trial = At(trial_x, false);
      const double decrease = at.cost - trial.cost;
      if (decrease > 0) {
        fit.converged = decrease < kMinDecrease * at.cost;
        at = trial;
        x = trial_x;
        diffuse = samples_.diffuse;
        damping = std::max(damping / 5, 1e-9);
      } else {
        samples_.diffuse = diffuse;
        damping *= 6;
        fit.converged = damping > 1e6;
      }
    }
    for (int i = 0; i < kN; ++i) fit.params.push_back(FromSearch(Info(i), x[i]));
    fit.cost = at.cost;
    return fit;
  }

 private:
  static const SpecularInfo& Info(int i) { return Brdf::kSpecular[static_cast<std::size_t>(i)]; }
  Vector Clamped(const Vector& x) const { return x.cwiseMax(low_).cwiseMin(high_); }

  // Cost and its Gauss-Newton model at `x`; updates samples_.diffuse, from scratch with `fresh`.
  Equations<kN> At(const Vector& x, bool fresh) {
    Equations<kN> out = ParallelReduce(
        samples_.texel.size(),
        kBlock,
        Equations<kN>{},
        [&](std::size_t begin, std::size_t end) {
          Equations<kN> part;
          AddRange(x, fresh, begin, end, part);
          return part;
        },
        [](Equations<kN>& total, const Equations<kN>& part) {
          total.cost += part.cost;
          total.gradient += part.gradient;
          total.hessian += part.hessian;
        });
    for (int i = 0; i < kN; ++i) {
      const double range = 0.25 * (high_[i] - low_[i]);
      const double weight = kPriorSamples / (range * range);
      const double off = x[i] - prior_[i];
      out.cost += weight * off * off;
      out.gradient[i] += weight * off;
      out.hessian(i, i) += weight;
    }
    return out;
  }

  template <Real T>
  struct Workspace {
    TexelSamples<T> texel;
    std::vector<Prediction<Dual<kN, T>>> predictions;
  };

  void AddRange(
      const Vector& x, bool fresh, std::size_t begin, std::size_t end, Equations<kN>& part) {
    Workspace<Lanes> wide;
    Workspace<float> narrow;
    std::size_t i = begin;
    for (; i + kLaneCount<Lanes> <= end; i += kLaneCount<Lanes>) Add(x, fresh, i, wide, part);
    for (; i < end; ++i) Add(x, fresh, i, narrow, part);
  }

  template <Real T>
  void Add(const Vector& x, bool fresh, std::size_t i, Workspace<T>& work, Equations<kN>& part) {
    using D = Dual<kN, T>;
    const Triple<T> n = LoadTriple<T>(samples_.normal, i);
    work.texel.Gather(samples_.tile, static_cast<int>(i), n, errors_);
    typename Brdf::template Params<D> params;
    for (int k = 0; k < kN; ++k) {
      const double p = FromSearch(Info(k), x[k]);
      D dual = D::Variable(Constant<T>(p), k);
      if (Info(k).logarithmic) dual.d[static_cast<std::size_t>(k)] = Constant<T>(p);
      params[static_cast<std::size_t>(k)] = dual;
    }
    const Triple<D> normal = {D(n[0]), D(n[1]), D(n[2])};
    work.predictions.clear();
    for (const auto& sample : work.texel.samples) {
      work.predictions.push_back(Predict<Brdf, D, T>(work.texel, sample, normal, params));
    }
    const T gain = work.texel.Gain(T(samples_.noise));
    Triple<T> rho = LoadTriple<T>(samples_.diffuse, i);
    rho = SolveDiffuse(
        work.texel, work.predictions, gain, errors_, fresh ? 4 : 3, fresh ? nullptr : &rho);
    StoreTriple(rho, samples_.diffuse, i);
    const NormalEquations<kN, T> equations =
        Linearize<kN, T>(work.texel, work.predictions, gain, errors_, rho, true);
    for (int lane = 0; lane < kLaneCount<T>; ++lane) {
      part.cost += static_cast<double>(Lane(equations.cost, lane));
      for (int k = 0; k < kN; ++k) {
        const auto row = static_cast<std::size_t>(k);
        part.gradient[k] += static_cast<double>(Lane(equations.gradient[row], lane));
        for (int m = 0; m <= k; ++m) {
          const auto h =
              static_cast<double>(Lane(equations.hessian[row][static_cast<std::size_t>(m)], lane));
          part.hessian(k, m) += h;
          if (m < k) part.hessian(m, k) += h;
        }
      }
    }
  }

  MaterialSamples& samples_;
  ErrorModel errors_;
  Vector low_;
  Vector high_;
  Vector prior_;
};

template <class Brdf, Real T>
typename Brdf::template Params<T> ConstantParams(const std::vector<double>& params) {
  typename Brdf::template Params<T> out;
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = Constant<T>(params[i]);
  return out;
}

}  // namespace

SpecularFit FitSpecular(const std::string& model,
                        MaterialSamples& samples,
                        const std::vector<double>& prior,
                        const std::vector<double>& start,
                        const ErrorModel& errors) {
  return VisitBrdf(
      model, [&]<class Brdf>(Brdf) { return Problem<Brdf>(samples, prior, errors).Solve(start); });
}

void EstimateNoise(const std::string& model,
                   MaterialSamples& samples,
                   const std::vector<double>& params,
                   const ErrorModel& errors) {
  const auto gather = [&]<class Brdf>(Brdf) {
    return ParallelReduce(
        samples.texel.size(),
        kBlock,
        std::vector<float>{},
        [&](std::size_t begin, std::size_t end) {
          std::vector<float> found;
          ForLanes(begin, end, [&]<Real T>(std::size_t i) {
            TexelSamples<T> texel;
            const Triple<T> n = LoadTriple<T>(samples.normal, i);
            texel.Gather(samples.tile, static_cast<int>(i), n, errors);
            const auto p = ConstantParams<Brdf, T>(params);
            const Triple<T> rho = LoadTriple<T>(samples.diffuse, i);
            const T gain = texel.Gain(T(1));
            for (const auto& sample : texel.samples) {
              const Prediction<T> prediction = Predict<Brdf, T, T>(texel, sample, n, p);
              const T u2 =
                  gain * sample.precision * SquaredResidual(sample.radiance, rho, prediction);
              for (int lane = 0; lane < kLaneCount<T>; ++lane) {
                if (Lane(sample.weight, lane) > 0.3F && Lane(sample.strength, lane) > 0) {
                  found.push_back(Lane(u2, lane));
                }
              }
            }
          });
          return found;
        },
        [](std::vector<float>& total, const std::vector<float>& part) {
          total.insert(total.end(), part.begin(), part.end());
        });
  };
  std::vector<float> squares = VisitBrdf(model, gather);
  if (squares.empty()) return;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  samples.noise = std::max(1.4826F * std::sqrt(*middle), 0.005F);
}

void FitSampleNormals(const std::string& model,
                      MaterialSamples& samples,
                      const std::vector<double>& params,
                      const ErrorModel& errors,
                      const NormalPassOptions& options) {
  const auto fit = [&]<class Brdf>(Brdf) {
    ParallelForBlocks(samples.texel.size(), kBlock, [&](std::size_t begin, std::size_t end) {
      ForLanes(begin, end, [&]<Real T>(std::size_t i) {
        TexelSamples<T> texel;
        NormalSolver<Brdf, T> solver;
        const Triple<T> up = {T(0), T(0), T(1)};
        texel.Gather(samples.tile, static_cast<int>(i), up, errors, options.views);
        const NormalPrior<T> prior = {.toward = up,
                                      .alpha = T(options.alpha),
                                      .beta = T(1 - options.alpha),
                                      .gamma = options.gamma};
        const NormalSolution<T> solution = solver.Solve(texel,
                                                        ConstantParams<Brdf, T>(params),
                                                        LoadTriple<T>(samples.normal, i),
                                                        LoadTriple<T>(samples.diffuse, i),
                                                        true,
                                                        prior,
                                                        texel.Gain(T(samples.noise)),
                                                        errors,
                                                        12);
        StoreTriple(solution.normal, samples.normal, i);
        StoreTriple(solution.rho, samples.diffuse, i);
      });
    });
  };
  VisitBrdf(model, fit);
}

void CopyTexel(const DyxelTile& source, int from, DyxelTile& target, int to) {
  const auto copy = [&](const std::vector<float>& a, std::vector<float>& b) {
    const auto step_a = static_cast<std::size_t>(source.texels);
    const auto step_b = static_cast<std::size_t>(target.texels);
    for (std::size_t row = 0; row * step_a < a.size(); ++row) {
      b[row * step_b + static_cast<std::size_t>(to)] =
          a[row * step_a + static_cast<std::size_t>(from)];
    }
  };
  copy(source.light_dir, target.light_dir);
  copy(source.irradiance, target.irradiance);
  copy(source.view_dir, target.view_dir);
  copy(source.radiance, target.radiance);
  copy(source.weight, target.weight);
}

}  // namespace dyxel::internal
