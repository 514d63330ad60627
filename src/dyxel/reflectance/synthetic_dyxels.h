// Dyxels of known reflectance, for tests: a flat grid of texels in a turning body, two lamps and
// eight cameras around it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "dyxel/base/random.h"
#include "dyxel/reflectance/brdf.h"
#include "dyxel/reflectance/dyxels.h"

namespace dyxel {

struct SyntheticMaterial {
  std::array<double, 3> diffuse;
  std::vector<double> specular;
};

struct SyntheticOptions {
  std::string model = "ggx";
  int width = 32;
  int height = 32;
  int frames = 24;
  int cameras = 8;
  int lights = 2;
  int tile_texels = 300;
  std::vector<SyntheticMaterial> materials = {{{0.5, 0.3, 0.2}, {0.45, 0.04}},
                                              {{0.1, 0.15, 0.4}, {0.7, 0.03}}};
  double pattern = 0.2;   // the texels' own albedo varies by this share of their material's
  double bumps = 0.0;     // rms slope of the normals
  double noise = 0.0;     // relative, of the radiance
  double outliers = 0.0;  // share of samples that saw something else
  double exposure = 1;    // scales radiance and irradiance
  std::uint64_t seed = 1;
};

struct SyntheticTruth {
  std::vector<int> material;
  std::array<std::vector<double>, 3> diffuse;
  std::vector<Vec3d> normal;
};

// Left part of the grid is material 0, and so on. Texels of the last row are never seen.
inline SyntheticTruth MakeSyntheticTruth(const SyntheticOptions& o) {
  SyntheticTruth truth;
  for (int x = 0; x < o.width * o.height; ++x) {
    Random random(o.seed, static_cast<std::uint64_t>(x));
    const int m = x % o.width * static_cast<int>(o.materials.size()) / o.width;
    truth.material.push_back(m);
    const double own = 1 + o.pattern * (2 * static_cast<double>(random.Uniform()) - 1);
    for (std::size_t c = 0; c < 3; ++c) {
      truth.diffuse[c].push_back(o.materials[static_cast<std::size_t>(m)].diffuse[c] * own);
    }
    const double a = o.bumps * static_cast<double>(random.Normal());
    const double b = o.bumps * static_cast<double>(random.Normal());
    truth.normal.push_back(Vec3d(a, b, 1).normalized());
  }
  return truth;
}

inline DyxelTile MakeSyntheticTile(const SyntheticOptions& o,
                                   const SyntheticTruth& truth,
                                   int begin,
                                   int end) {
  DyxelTile tile;
  tile.first_texel = begin;
  tile.Resize(end - begin, o.frames, o.cameras, o.lights);
  VisitBrdf(o.model, [&]<class Brdf>(Brdf) {
    for (int i = 0; i < tile.texels; ++i) {
      const auto x = static_cast<std::size_t>(begin + i);
      Random random(o.seed + 1000, x);
      const SyntheticMaterial& material = o.materials[static_cast<std::size_t>(truth.material[x])];
      typename Brdf::template Params<double> params;
      std::copy_n(material.specular.begin(), params.size(), params.begin());
      const Vec3d n = truth.normal[x];
      const auto set = [&](float* row, double value) { row[i] = static_cast<float>(value); };
      for (int f = 0; f < o.frames; ++f) {
        const double turn = 2 * kPiD * f / o.frames;
        std::vector<Vec3d> light(static_cast<std::size_t>(o.lights));
        std::vector<double> irradiance(light.size());
        for (int j = 0; j < o.lights; ++j) {
          const auto k = static_cast<std::size_t>(j);
          const double azimuth = turn + 1.7 * j + 0.3;
          light[k] = Vec3d(0.5 + 0.2 * j, std::cos(azimuth), std::sin(azimuth)).normalized();
          // As a surface facing away would: the lamp does not reach it.
          irradiance[k] = light[k].z() > 0.05 ? o.exposure * (3 - j) : 0;
          for (int c = 0; c < 3; ++c) {
            set(tile.LightDir(f, j, c), light[k][c]);
            set(tile.Irradiance(f, j, c), irradiance[k] * (1 - 0.1 * c));
          }
        }
        for (int v = 0; v < o.cameras; ++v) {
          const double azimuth = turn + 2 * kPiD * v / o.cameras;
          const Vec3d view =
              Vec3d(0.2 * (v % 3), std::cos(azimuth), std::sin(azimuth)).normalized();
          if (view.z() < 0.2 || begin + i >= o.width * (o.height - 1)) continue;
          set(tile.Weight(f, v), 1);
          const bool outlier = static_cast<double>(random.Uniform()) < o.outliers;
          const double other = 2 * static_cast<double>(random.Uniform());
          for (int c = 0; c < 3; ++c) {
            double radiance = 0;
            for (std::size_t j = 0; j < light.size(); ++j) {
              const double n_l = n.dot(light[j]);
              const Cosines<double> cosines =
                  SeenCosines<double>(n_l, n.dot(view), light[j].dot(view));
              radiance += irradiance[j] * (1 - 0.1 * c) * std::max(0.0, n_l) *
                          EvaluateBrdf<Brdf, double>(
                              truth.diffuse[static_cast<std::size_t>(c)][x], params, cosines);
            }
            if (outlier) radiance = other * o.exposure * 0.3;
            radiance *= 1 + o.noise * static_cast<double>(random.Normal());
            set(tile.ViewDir(f, v, c), view[c]);
            set(tile.Radiance(f, v, c), radiance);
          }
        }
      }
    }
  });
  return tile;
}

inline DyxelSource MakeSyntheticSource(const SyntheticOptions& o) {
  DyxelSource source;
  source.num_texels = o.width * o.height;
  for (int begin = 0; begin < source.num_texels; begin += o.tile_texels) {
    source.tile_begin.push_back(begin);
  }
  source.tile_begin.push_back(source.num_texels);
  source.load = [o, truth = MakeSyntheticTruth(o), begins = source.tile_begin](int tile) {
    const auto t = static_cast<std::size_t>(tile);
    return MakeSyntheticTile(o, truth, begins[t], begins[t + 1]);
  };
  return source;
}

inline TexelGraph MakeGridGraph(int width, int height) {
  TexelGraph graph;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int i = y * width + x;
      graph.neighbours.push_back({x > 0 ? i - 1 : -1,
                                  x + 1 < width ? i + 1 : -1,
                                  y > 0 ? i - width : -1,
                                  y + 1 < height ? i + width : -1});
    }
  }
  return graph;
}

}  // namespace dyxel
