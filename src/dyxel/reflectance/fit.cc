#include "dyxel/reflectance/fit.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "dyxel/base/parallel.h"
#include "dyxel/base/random.h"
#include "dyxel/reflectance/fill.h"
#include "dyxel/reflectance/materials.h"
#include "dyxel/reflectance/specular_fit.h"
#include "dyxel/reflectance/texel_solver.h"

namespace dyxel {
namespace {

using internal::ErrorModel;
using internal::MaterialSamples;
using internal::Prediction;
using internal::TexelSamples;
using internal::Triple;

constexpr float kFirstNoise = 0.1F;  // σ before there is an estimate
// Trusted, lit samples (each at most the cosine of its light) that a texel needs to be measured,
// and those at which its confidence is one half.
constexpr float kMeasured = 0.4F;
constexpr float kHalfConfidence = 4;
constexpr std::size_t kSampleBytes = std::size_t{192} << 20U;  // of the subset's samples

// Reports tiles done over the passes.
class TileProgress {
 public:
  TileProgress(const ProgressFn& report, int total) : report_(report), total_(total) {}
  void Done() {
    const int done = ++done_;
    if (report_) report_(static_cast<double>(done) / total_);
  }

 private:
  const ProgressFn& report_;
  int total_;
  std::atomic<int> done_{0};
};

// What the Lambertian pass leaves: albedo, trust, and the samples of a seeded subset.
struct FirstPass {
  std::array<std::vector<float>, 3> diffuse;
  std::vector<float> information;
  struct Subset {
    DyxelTile tile;
    std::vector<int> texel;
  };
  std::vector<Subset> subset;  // one a tile
};

template <Real T>
void LambertTexels(const DyxelTile& tile,
                   int offset,
                   const ErrorModel& errors,
                   TexelSamples<T>& texel,
                   std::vector<Prediction<T>>& predictions,
                   FirstPass& out) {
  const Triple<T> up = {T(0), T(0), T(1)};
  texel.Gather(tile, offset, up, errors);
  predictions.clear();
  for (const auto& sample : texel.samples) {
    Prediction<T> p{};
    p.diffuse.fill(T(0));
    p.specular.fill(T(0));
    for (int j = 0; j < sample.num_lights; ++j) {
      const auto& light = texel.lights[static_cast<std::size_t>(sample.first_light + j)];
      const T cosine = internal::Max(T(0), light.direction[2]) * Constant<T>(1 / kPiD);
      for (std::size_t c = 0; c < 3; ++c) p.diffuse[c] += light.irradiance[c] * cosine;
    }
    predictions.push_back(p);
  }
  const T gain = texel.Gain(T(kFirstNoise));
  const Triple<T> rho = internal::SolveDiffuse<T, T>(texel, predictions, gain, errors, 4, nullptr);
  const auto error = internal::MeasureError<T, T>(texel, predictions, gain, errors, rho);
  const auto x = static_cast<std::size_t>(tile.first_texel + offset);
  for (std::size_t c = 0; c < 3; ++c) internal::Store(rho[c], out.diffuse[c].data() + x);
  internal::Store(error.information, out.information.data() + x);
}

// f(offset, T{}) over the tile's texels, in lanes as far as they go.
template <class F>
void ForLanes(const DyxelTile& tile, F&& f) {
  int offset = 0;
  for (; offset + kLaneCount<Lanes> <= tile.texels; offset += kLaneCount<Lanes>) {
    f(offset, Lanes(0.0F));
  }
  for (; offset < tile.texels; ++offset) f(offset, 0.0F);
}

FirstPass RunFirstPass(const DyxelSource& source,
                       const ReflectanceOptions& options,
                       const ErrorModel& errors,
                       TileProgress& progress) {
  const auto num_texels = static_cast<std::size_t>(source.num_texels);
  FirstPass out;
  for (auto& channel : out.diffuse) channel.assign(num_texels, 0.0F);
  out.information.assign(num_texels, 0.0F);
  out.subset.resize(static_cast<std::size_t>(source.num_tiles()));
  ParallelFor(out.subset.size(), [&](std::size_t t) {
    const DyxelTile tile = source.load(static_cast<int>(t));
    TexelSamples<Lanes> wide;
    TexelSamples<float> narrow;
    std::vector<Prediction<Lanes>> wide_predictions;
    std::vector<Prediction<float>> narrow_predictions;
    ForLanes(tile, [&]<Real T>(int offset, T) {
      if constexpr (1 < kLaneCount<T>) {
        LambertTexels<T>(tile, offset, errors, wide, wide_predictions, out);
      } else {
        LambertTexels<T>(tile, offset, errors, narrow, narrow_predictions, out);
      }
    });

    const std::size_t texel_floats =
        (tile.light_dir.size() + tile.irradiance.size() + tile.view_dir.size() +
         tile.radiance.size() + tile.weight.size()) /
        static_cast<std::size_t>(std::max(tile.texels, 1));
    const double most =
        static_cast<double>(kSampleBytes) / static_cast<double>(4 * texel_floats + 4);
    const double share = std::min<double>(options.sample_texels, most) / source.num_texels;
    FirstPass::Subset& subset = out.subset[t];
    for (int i = 0; i < tile.texels; ++i) {
      const auto x = static_cast<std::size_t>(tile.first_texel + i);
      if (out.information[x] < kMeasured) continue;
      Random random(static_cast<std::uint64_t>(options.seed), x);
      if (static_cast<double>(random.Uniform()) < share)
        subset.texel.push_back(tile.first_texel + i);
    }
    subset.tile.Resize(
        static_cast<int>(subset.texel.size()), tile.frames, tile.cameras, tile.lights);
    for (std::size_t i = 0; i < subset.texel.size(); ++i) {
      internal::CopyTexel(
          tile, subset.texel[i] - tile.first_texel, subset.tile, static_cast<int>(i));
    }
    progress.Done();
  });
  return out;
}

// The subset sorted into materials; empties `first.subset`.
std::vector<MaterialSamples> SortByMaterial(FirstPass& first,
                                            const std::vector<int>& material,
                                            int num_materials) {
  std::vector<MaterialSamples> out(static_cast<std::size_t>(num_materials));
  for (const FirstPass::Subset& subset : first.subset) {
    for (const int x : subset.texel) {
      out[static_cast<std::size_t>(material[static_cast<std::size_t>(x)])].texel.push_back(x);
    }
  }
  const FirstPass::Subset* some = nullptr;
  for (const FirstPass::Subset& subset : first.subset) {
    if (!subset.texel.empty()) some = &subset;
  }
  if (some == nullptr) return out;
  for (MaterialSamples& samples : out) {
    const std::size_t count = samples.texel.size();
    samples.tile.Resize(
        static_cast<int>(count), some->tile.frames, some->tile.cameras, some->tile.lights);
    samples.normal = {std::vector<float>(count, 0.0F),
                      std::vector<float>(count, 0.0F),
                      std::vector<float>(count, 1.0F)};
    for (std::size_t c = 0; c < 3; ++c) {
      for (const int x : samples.texel) {
        samples.diffuse[c].push_back(first.diffuse[c][static_cast<std::size_t>(x)]);
      }
    }
    samples.noise = kFirstNoise;
  }
  std::vector<int> filled(out.size(), 0);
  for (FirstPass::Subset& subset : first.subset) {
    for (std::size_t i = 0; i < subset.texel.size(); ++i) {
      const auto m = static_cast<std::size_t>(material[static_cast<std::size_t>(subset.texel[i])]);
      internal::CopyTexel(subset.tile, static_cast<int>(i), out[m].tile, filled[m]++);
    }
    subset = {};
  }
  return out;
}

// Specular parameters of every material, and its noise.
struct MaterialFit {
  std::vector<double> params;
  float noise = kFirstNoise;
};

std::vector<MaterialFit> FitMaterials(std::vector<MaterialSamples>& materials,
                                      const ReflectanceOptions& options,
                                      const ErrorModel& errors) {
  std::vector<double> prior;
  for (const SpecularInfo& info : SpecularParameters(options.model)) prior.push_back(info.initial);
  std::vector<MaterialFit> fits;
  for (MaterialSamples& samples : materials) {
    MaterialFit fit;
    if (samples.texel.empty()) {
      fit.params = prior;
    } else {
      const auto refit = [&] {
        fit.params =
            internal::FitSpecular(options.model, samples, prior, fit.params, errors).params;
        internal::EstimateNoise(options.model, samples, fit.params, errors);
      };
      refit();
      refit();  // with the noise known
      for (int round = 0; options.second_pass && round < options.rounds; ++round) {
        internal::FitSampleNormals(options.model,
                                   samples,
                                   fit.params,
                                   errors,
                                   {.alpha = static_cast<float>(options.alpha),
                                    .gamma = static_cast<float>(options.gamma),
                                    .views = options.views});
        refit();
      }
      fit.noise = samples.noise;
    }
    samples.tile = {};
    fits.push_back(fit);
  }
  return fits;
}

// The last pass: normal and diffuse of the texels of one tile.
template <class Brdf>
class TexelPass {
 public:
  TexelPass(const std::vector<MaterialFit>& fits,
            const ReflectanceOptions& options,
            const ErrorModel& errors,
            Reflectance& out,
            std::vector<float>& information)
      : fits_(fits), options_(options), errors_(errors), out_(out), information_(information) {}

  void Run(const DyxelTile& tile) {
    ForLanes(tile, [&]<Real T>(int offset, T) {
      if constexpr (1 < kLaneCount<T>) {
        Fit<T>(tile, offset, wide_);
      } else {
        Fit<T>(tile, offset, narrow_);
      }
    });
  }

 private:
  template <Real T>
  struct Workspace {
    TexelSamples<T> texel;
    std::vector<Prediction<T>> predictions;
    internal::NormalSolver<Brdf, T> solver;
  };

  template <Real T>
  void Fit(const DyxelTile& tile, int offset, Workspace<T>& work) {
    const auto first = static_cast<std::size_t>(tile.first_texel + offset);
    std::array<const MaterialFit*, static_cast<std::size_t>(kLaneCount<T>)> fits;
    bool any = false;
    for (int lane = 0; lane < kLaneCount<T>; ++lane) {
      const std::size_t x = first + static_cast<std::size_t>(lane);
      const int m = out_.filled[x] != 0 ? -1 : out_.material[x];
      any = any || m >= 0;
      fits[static_cast<std::size_t>(lane)] = &fits_[static_cast<std::size_t>(std::max(m, 0))];
    }
    if (!any) return;
    typename Brdf::template Params<T> params;
    for (std::size_t k = 0; k < params.size(); ++k) {
      params[k] = FromLanes<T>([&](int i) { return fits[static_cast<std::size_t>(i)]->params[k]; });
    }
    const T noise = FromLanes<T>([&](int i) { return fits[static_cast<std::size_t>(i)]->noise; });

    Triple<T> normal = {T(0), T(0), T(1)};
    Triple<T> rho;
    for (std::size_t c = 0; c < 3; ++c) rho[c] = internal::Load<T>(out_.diffuse[c].data() + first);
    if (options_.second_pass) {
      work.texel.Gather(tile, offset, normal, errors_, options_.views);
      const internal::NormalPrior<T> prior = {.toward = normal,
                                              .alpha = Constant<T>(options_.alpha),
                                              .beta = Constant<T>(1 - options_.alpha),
                                              .gamma = static_cast<float>(options_.gamma)};
      const auto solution = work.solver.Solve(
          work.texel, params, normal, rho, true, prior, work.texel.Gain(noise), errors_, 8);
      normal = solution.normal;
      rho = solution.rho;
    }
    work.texel.Gather(tile, offset, normal, errors_);
    work.predictions.clear();
    for (const auto& sample : work.texel.samples) {
      work.predictions.push_back(Predict<Brdf, T, T>(work.texel, sample, normal, params));
    }
    const T gain = work.texel.Gain(noise);
    rho = internal::SolveDiffuse<T, T>(work.texel, work.predictions, gain, errors_, 5, nullptr);
    const auto error =
        internal::MeasureError<T, T>(work.texel, work.predictions, gain, errors_, rho);
    for (int lane = 0; lane < kLaneCount<T>; ++lane) {
      const std::size_t x = first + static_cast<std::size_t>(lane);
      if (out_.filled[x] != 0) continue;
      for (std::size_t c = 0; c < 3; ++c) out_.diffuse[c][x] = Lane(rho[c], lane);
      out_.normal[x] = {Lane(normal[0], lane), Lane(normal[1], lane), Lane(normal[2], lane)};
      information_[x] = Lane(error.information, lane);
    }
  }

  const std::vector<MaterialFit>& fits_;
  const ReflectanceOptions& options_;
  ErrorModel errors_;
  Reflectance& out_;
  std::vector<float>& information_;
  Workspace<Lanes> wide_;
  Workspace<float> narrow_;
};

// Mean albedo and number of texels of every material, over the measured texels.
void SummariseMaterials(const std::vector<MaterialFit>& fits, Reflectance& out) {
  std::vector<std::array<double, 4>> sums(fits.size(), {0, 0, 0, 0});
  for (std::size_t x = 0; x < out.filled.size(); ++x) {
    if (out.filled[x] != 0) continue;
    auto& sum = sums[static_cast<std::size_t>(out.material[x])];
    for (std::size_t c = 0; c < 3; ++c) sum[c] += static_cast<double>(out.diffuse[c][x]);
    sum[3] += 1;
  }
  for (std::size_t m = 0; m < fits.size(); ++m) {
    Material material;
    material.name = fmt::format("material{}", m);
    for (const double p : fits[m].params) material.specular.push_back(static_cast<float>(p));
    for (int c = 0; c < 3; ++c) {
      material.mean_diffuse[c] =
          static_cast<float>(sums[m][static_cast<std::size_t>(c)] / std::max(sums[m][3], 1.0));
    }
    out.materials.push_back(std::move(material));
  }
}

}  // namespace

Reflectance FitReflectance(const DyxelSource& source,
                           const TexelGraph& graph,
                           const ReflectanceOptions& options,
                           const ProgressFn& progress) {
  CheckOptions("reflectance", options);
  const auto num_texels = static_cast<std::size_t>(source.num_texels);
  const ErrorModel errors{.robust = static_cast<float>(options.robust)};
  TileProgress tile_progress(progress, 2 * source.num_tiles());

  FirstPass first = RunFirstPass(source, options, errors, tile_progress);
  Reflectance out;
  out.model = options.model;
  out.diffuse = first.diffuse;
  out.normal.assign(num_texels, Vec3f::UnitZ());
  out.filled.resize(num_texels);
  std::size_t measured = 0;
  for (std::size_t x = 0; x < num_texels; ++x) {
    out.filled[x] = first.information[x] < kMeasured ? 1 : 0;
    if (out.filled[x] != 0) {
      first.information[x] = 0;
    } else {
      ++measured;
    }
  }
  Require(measured > 0,
          Fault::kStage,
          "reflectance: none of {} texels was seen by a camera while a lamp lit it; look at the "
          "textures stage, and at the lights' and cameras' calibration",
          num_texels);

  std::vector<float> trust(num_texels);
  for (std::size_t x = 0; x < num_texels; ++x) {
    trust[x] = first.information[x] / (first.information[x] + kHalfConfidence);
  }
  out.material = ClusterMaterials(
      out.diffuse,
      trust,
      graph,
      {.materials = options.materials, .seed = static_cast<std::uint64_t>(options.seed)});
  const int num_materials = *std::max_element(out.material.begin(), out.material.end()) + 1;
  std::vector<MaterialSamples> samples = SortByMaterial(first, out.material, num_materials);
  const std::vector<MaterialFit> fits = FitMaterials(samples, options, errors);

  std::vector<float>& information = first.information;
  VisitBrdf(options.model, [&]<class Brdf>(Brdf) {
    ParallelFor(static_cast<std::size_t>(source.num_tiles()), [&](std::size_t t) {
      const DyxelTile tile = source.load(static_cast<int>(t));
      TexelPass<Brdf>(fits, options, errors, out, information).Run(tile);
      tile_progress.Done();
    });
  });

  SummariseMaterials(fits, out);
  FillUnmeasured(graph, information, out);
  out.confidence.resize(num_texels);
  out.specular.assign(out.materials[0].specular.size(), std::vector<float>(num_texels));
  for (std::size_t x = 0; x < num_texels; ++x) {
    out.confidence[x] = information[x] / (information[x] + kHalfConfidence);
    Material& material = out.materials[static_cast<std::size_t>(out.material[x])];
    ++material.texels;
    for (std::size_t k = 0; k < out.specular.size(); ++k) {
      out.specular[k][x] = material.specular[k];
    }
  }
  return out;
}

}  // namespace dyxel
