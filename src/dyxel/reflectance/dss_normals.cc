#include "dyxel/reflectance/dss_normals.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "dyxel/base/parallel.h"
#include "dyxel/reflectance/texel_solver.h"

namespace dyxel {
namespace {

using internal::ErrorModel;
using internal::Prediction;
using internal::TexelSamples;
using internal::Triple;

constexpr float kFirstNoise = 0.1F;   // of a material without samples
constexpr int kNoiseTiles = 8;        // tiles that the noise is learnt from
constexpr int kNoiseStride = 16;      // every so many of their lanes
constexpr float kHalfConfidence = 4;  // trusted, lit samples at which confidence is one half
constexpr float kMeasured = 0.2F;     // below so many a texel keeps the starting normal
constexpr float kFilledTrust = 0.1F;  // of a texel whose albedo was filled in
constexpr int kMaxSteps = 10;
constexpr int kCouplingRounds = 60;

template <class F>
void ForLanes(int texels, F&& f) {
  int offset = 0;
  for (; offset + kLaneCount<Lanes> <= texels; offset += kLaneCount<Lanes>) f(offset, Lanes(0.0F));
  for (; offset < texels; ++offset) f(offset, 0.0F);
}

// The reflectance of the texels from `first` on, one a lane.
template <class Brdf, Real T>
struct TexelReflectance {
  typename Brdf::template Params<T> specular;
  Triple<T> diffuse;
  Triple<T> start;

  TexelReflectance(const Reflectance& r, std::size_t first, bool toward_reference) {
    for (std::size_t k = 0; k < specular.size(); ++k) {
      specular[k] = internal::Load<T>(r.specular[k].data() + first);
    }
    for (std::size_t c = 0; c < 3; ++c) {
      diffuse[c] = internal::Load<T>(r.diffuse[c].data() + first);
      start[c] = toward_reference ? FromLanes<T>([&](int i) {
        return r.normal[first + static_cast<std::size_t>(i)][static_cast<int>(c)];
      })
                                  : T(c == 2 ? 1.0F : 0.0F);
    }
  }
};

// What the texels say of the change s of their slopes (x/z, y/z of the normal) from the starting
// normal's. To second order confidence · (R4) is (s − slope)ᵀ H (s − slope), H half of its Hessian;
// H is 0 where nothing was seen.
struct SlopeField {
  std::array<std::vector<float>, 2> slope;    // [axis][K]
  std::array<std::vector<float>, 3> hessian;  // [aa, ab, bb][K]
};

// Minimises Σ_x (s_x − slope_x)ᵀ H_x (s_x − slope_x) + coupling Σ_(x,y) |s_x − s_y|² over the seen
// texels (N2), by Jacobi rounds from the texels' own slopes. Neighbours' tangent frames are taken
// as parallel: those across a seam, where they are not, are left out.
void Couple(const TexelGraph& graph, float coupling, int rounds, SlopeField& field) {
  const std::size_t num_texels = field.slope[0].size();
  const std::array<std::vector<float>, 2> own = field.slope;
  std::array<std::vector<float>, 2> next = field.slope;
  for (int round = 0; round < rounds; ++round) {
    ParallelForBlocks(num_texels, 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t x = begin; x < end; ++x) {
        const float h00 = field.hessian[0][x];
        const float h01 = field.hessian[1][x];
        const float h11 = field.hessian[2][x];
        if (h00 + h11 <= 0) continue;
        float n = 0;
        float sum_a = 0;
        float sum_b = 0;
        for (std::size_t side = 0; side < 4; ++side) {
          const int neighbour = graph.neighbours[x][side];
          if (neighbour < 0) continue;
          const auto y = static_cast<std::size_t>(neighbour);
          if (graph.neighbours[y][side ^ 1U] != static_cast<int>(x)) continue;
          if (field.hessian[0][y] + field.hessian[2][y] <= 0) continue;
          n += coupling;
          sum_a += coupling * field.slope[0][y];
          sum_b += coupling * field.slope[1][y];
        }
        const float a = h00 * own[0][x] + h01 * own[1][x] + sum_a;
        const float b = h01 * own[0][x] + h11 * own[1][x] + sum_b;
        const float m00 = h00 + n;
        const float m11 = h11 + n;
        const float det = m00 * m11 - h01 * h01;
        if (det <= 0) continue;
        next[0][x] = (m11 * a - h01 * b) / det;
        next[1][x] = (m00 * b - h01 * a) / det;
      }
    });
    std::swap(field.slope, next);
  }
}

template <class Brdf>
class Chunk {
 public:
  Chunk(const DyxelSource& source,
        const Reflectance& reflectance,
        const NormalOptions& options,
        ChunkNormals& out)
      : source_(source),
        reflectance_(reflectance),
        options_(options),
        errors_{.robust = static_cast<float>(options.robust)},
        out_(out) {
    for (auto& row : field_.slope) row.assign(out.normal.size(), 0.0F);
    for (auto& row : field_.hessian) row.assign(out.normal.size(), 0.0F);
  }

  // The noise of every material: 1.48 times the median normalised error at the starting normals,
  // over some tiles.
  void LearnNoise() {
    const int num_tiles = source_.num_tiles();
    const int count = std::min(kNoiseTiles, num_tiles);
    const std::size_t num_materials = reflectance_.materials.size();
    std::vector<std::vector<std::vector<float>>> found(static_cast<std::size_t>(count));
    ParallelFor(found.size(), [&](std::size_t t) {
      found[t].resize(num_materials);
      const DyxelTile tile = source_.load((2 * static_cast<int>(t) + 1) * num_tiles / (2 * count));
      int turn = 0;
      ForLanes(tile.texels, [&]<Real T>(int offset, T) {
        if (turn++ % kNoiseStride == 0) CollectErrors<T>(tile, offset, found[t]);
      });
    });
    noise_.assign(num_materials, kFirstNoise);
    for (std::size_t m = 0; m < num_materials; ++m) {
      std::vector<float> squares;
      for (const auto& part : found) {
        squares.insert(squares.end(), part[m].begin(), part[m].end());
      }
      if (squares.empty()) continue;
      const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
      std::nth_element(squares.begin(), middle, squares.end());
      noise_[m] = std::max(1.4826F * std::sqrt(*middle), 0.005F);
    }
  }

  void Run(int tile_index) {
    const DyxelTile tile = source_.load(tile_index);
    Workspace<Lanes> wide;
    Workspace<float> narrow;
    ForLanes(tile.texels, [&]<Real T>(int offset, T) {
      if constexpr (1 < kLaneCount<T>) {
        Fit<T>(tile, offset, wide);
      } else {
        Fit<T>(tile, offset, narrow);
      }
    });
  }

  // Couples the slopes, and makes normals of them.
  void Finish(const TexelGraph& graph) {
    if (options_.coupling > 0) {
      Couple(graph, static_cast<float>(options_.coupling), kCouplingRounds, field_);
    }
    for (std::size_t x = 0; x < out_.normal.size(); ++x) {
      if (field_.hessian[0][x] + field_.hessian[2][x] <= 0) continue;
      const Vec3f start =
          options_.toward_reference ? reflectance_.normal[x] : Vec3f(Vec3f::UnitZ());
      out_.normal[x] = Vec3f(start.x() / start.z() + field_.slope[0][x],
                             start.y() / start.z() + field_.slope[1][x],
                             1)
                           .normalized();
    }
  }

 private:
  template <Real T>
  struct Workspace {
    TexelSamples<T> texel;
    std::vector<Prediction<T>> predictions;
    internal::NormalSolver<Brdf, T> solver;
  };

  template <Real T>
  void CollectErrors(const DyxelTile& tile, int offset, std::vector<std::vector<float>>& found) {
    const auto first = static_cast<std::size_t>(tile.first_texel + offset);
    const TexelReflectance<Brdf, T> at(reflectance_, first, options_.toward_reference);
    TexelSamples<T> texel;
    texel.Gather(tile, offset, at.start, errors_, options_.views);
    const T gain = texel.Gain(T(1));
    for (const auto& sample : texel.samples) {
      const Prediction<T> p = Predict<Brdf, T, T>(texel, sample, at.start, at.specular);
      const T u2 =
          gain * sample.precision * internal::SquaredResidual(sample.radiance, at.diffuse, p);
      for (int lane = 0; lane < kLaneCount<T>; ++lane) {
        const std::size_t x = first + static_cast<std::size_t>(lane);
        if (Lane(sample.weight, lane) > 0.3F && Lane(sample.strength, lane) > 0 &&
            reflectance_.filled[x] == 0) {
          found[static_cast<std::size_t>(reflectance_.material[x])].push_back(Lane(u2, lane));
        }
      }
    }
  }

  template <Real T>
  void Fit(const DyxelTile& tile, int offset, Workspace<T>& work) {
    const auto first = static_cast<std::size_t>(tile.first_texel + offset);
    const TexelReflectance<Brdf, T> at(reflectance_, first, options_.toward_reference);
    work.texel.Gather(tile, offset, at.start, errors_, options_.views);
    const T noise = FromLanes<T>([&](int i) {
      const std::size_t x = first + static_cast<std::size_t>(i);
      return noise_[static_cast<std::size_t>(reflectance_.material[x])];
    });
    const T gain = work.texel.Gain(noise);
    internal::NormalPrior<T> prior = {.toward = at.start,
                                      .alpha = Constant<T>(options_.alpha),
                                      .beta = Constant<T>(1 - options_.alpha),
                                      .gamma = static_cast<float>(options_.gamma)};
    internal::NormalSolution<T> found = Solve(work, at, at.start, prior, gain);
    internal::FitError<T> error = Error(work, at, found.normal, gain);
    if (options_.refit > 0) {
      const auto poor = Constant<T>(options_.refit) < error.mean;
      if (Any(poor)) {
        prior.alpha = Constant<T>(0.25 * options_.alpha);
        prior.beta = Constant<T>(1 - 0.25 * options_.alpha);
        const internal::NormalSolution<T> again = Solve(work, at, found.normal, prior, gain);
        const auto choose = [&](auto& to, const auto& from) {
          for (std::size_t i = 0; i < to.size(); ++i) to[i] = Select(poor, from[i], to[i]);
        };
        choose(found.normal, again.normal);
        choose(found.slope, again.slope);
        choose(found.hessian, again.hessian);
        error = Error(work, at, found.normal, gain);
      }
    }
    for (int lane = 0; lane < kLaneCount<T>; ++lane) {
      const std::size_t x = first + static_cast<std::size_t>(lane);
      const float information = Lane(error.information, lane);
      if (information < kMeasured) {
        out_.normal[x] =
            Vec3f(Lane(at.start[0], lane), Lane(at.start[1], lane), Lane(at.start[2], lane));
        continue;
      }
      out_.error[x] = Lane(error.mean, lane);
      // A texel whose albedo was filled in says little about its normal.
      out_.confidence[x] = information / (information + kHalfConfidence) *
                           (reflectance_.filled[x] != 0 ? kFilledTrust : 1.0F);
      for (std::size_t i = 0; i < 2; ++i)
        field_.slope[i][x] = Lane(found.slope[i] - at.start[i] / at.start[2], lane);
      for (std::size_t i = 0; i < 3; ++i) {
        field_.hessian[i][x] = out_.confidence[x] * Lane(found.hessian[i], lane);
      }
    }
  }

  template <Real T>
  internal::NormalSolution<T> Solve(Workspace<T>& work,
                                    const TexelReflectance<Brdf, T>& at,
                                    const Triple<T>& start,
                                    const internal::NormalPrior<T>& prior,
                                    const T& gain) {
    return work.solver.Solve(
        work.texel, at.specular, start, at.diffuse, false, prior, gain, errors_, kMaxSteps);
  }

  template <Real T>
  internal::FitError<T> Error(Workspace<T>& work,
                              const TexelReflectance<Brdf, T>& at,
                              const Triple<T>& normal,
                              const T& gain) {
    work.predictions.clear();
    for (const auto& sample : work.texel.samples) {
      work.predictions.push_back(Predict<Brdf, T, T>(work.texel, sample, normal, at.specular));
    }
    return internal::MeasureError<T, T>(work.texel, work.predictions, gain, errors_, at.diffuse);
  }

  const DyxelSource& source_;
  const Reflectance& reflectance_;
  const NormalOptions& options_;
  ErrorModel errors_;
  ChunkNormals& out_;
  SlopeField field_;
  std::vector<float> noise_;  // a material
};

}  // namespace

ChunkNormals FitNormals(const DyxelSource& source,
                        const TexelGraph& graph,
                        const Reflectance& reflectance,
                        const NormalOptions& options,
                        const ProgressFn& progress) {
  CheckOptions("normals", options);
  const auto num_texels = static_cast<std::size_t>(source.num_texels);
  Require(
      reflectance.material.size() == num_texels && graph.neighbours.size() == num_texels,
      Fault::kInput,
      "normals: the reflectance has {} texels and the atlas {}; run the reflectance stage again",
      reflectance.material.size(),
      num_texels);
  ChunkNormals out;
  out.normal.assign(num_texels, Vec3f::UnitZ());
  out.error.assign(num_texels, std::numeric_limits<float>::quiet_NaN());
  out.confidence.assign(num_texels, 0.0F);
  VisitBrdf(reflectance.model, [&]<class Brdf>(Brdf) {
    Chunk<Brdf> chunk(source, reflectance, options, out);
    chunk.LearnNoise();
    std::atomic<int> done{0};
    ParallelFor(static_cast<std::size_t>(source.num_tiles()), [&](std::size_t t) {
      chunk.Run(static_cast<int>(t));
      const int count = ++done;
      if (progress) progress(static_cast<double>(count) / source.num_tiles());
    });
    chunk.Finish(graph);
  });
  return out;
}

}  // namespace dyxel
