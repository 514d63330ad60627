#include "dyxel/reflectance/fill.h"

#include <cstdint>

#include "dyxel/base/parallel.h"

namespace dyxel {
namespace {

constexpr int kRounds = 60;
constexpr float kTowardMean = 0.01F;  // ε: a tenth of the border's albedo is left some 20 texels on

// Breadth first from the texels of `reached`: gives each filled texel that it reaches the material
// and the albedo of the one it came from. Measured texels on the way are passed through.
void Spread(const TexelGraph& graph, std::vector<std::uint8_t>& reached, Reflectance& reflectance) {
  struct Entry {
    std::size_t texel;
    std::size_t source;
  };
  std::vector<Entry> queue;
  for (std::size_t x = 0; x < reached.size(); ++x) {
    if (reached[x] != 0) queue.push_back({x, x});
  }
  for (std::size_t head = 0; head < queue.size(); ++head) {
    const Entry from = queue[head];
    for (const int neighbour : graph.neighbours[from.texel]) {
      if (neighbour < 0) continue;
      const auto y = static_cast<std::size_t>(neighbour);
      if (reached[y] != 0) continue;
      reached[y] = 1;
      if (reflectance.filled[y] != 0) {
        reflectance.material[y] = reflectance.material[from.source];
        for (auto& channel : reflectance.diffuse) channel[y] = channel[from.source];
      }
      queue.push_back({y, from.source});
    }
  }
}

}  // namespace

void FillUnmeasured(const TexelGraph& graph,
                    const std::vector<float>& trust,
                    Reflectance& reflectance) {
  const std::size_t num_texels = reflectance.filled.size();
  std::vector<std::uint8_t> reached(num_texels, 0);
  for (std::size_t x = 0; x < num_texels; ++x) reached[x] = trust[x] >= kSureTrust ? 1 : 0;
  Spread(graph, reached, reflectance);
  for (std::size_t x = 0; x < num_texels; ++x) {
    if (reflectance.filled[x] == 0) reached[x] = 1;
  }
  Spread(graph, reached, reflectance);

  std::vector<std::size_t> unsure;
  for (std::size_t x = 0; x < num_texels; ++x) {
    if (reflectance.filled[x] != 0) reflectance.normal[x] = Vec3f::UnitZ();
    if (reached[x] == 0) {
      reflectance.material[x] = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        reflectance.diffuse[c][x] = reflectance.materials[0].mean_diffuse[static_cast<int>(c)];
      }
    } else if (trust[x] < kSureTrust) {
      unsure.push_back(x);
    }
  }

  std::vector<float> next(unsure.size());
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<float>& channel = reflectance.diffuse[c];
    std::vector<float> measured(unsure.size());
    for (std::size_t i = 0; i < unsure.size(); ++i) measured[i] = channel[unsure[i]];
    for (int round = 0; round < kRounds; ++round) {
      ParallelForBlocks(unsure.size(), 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const std::size_t x = unsure[i];
          const auto m = static_cast<std::size_t>(reflectance.material[x]);
          float sum = trust[x] * measured[i] +
                      kTowardMean * reflectance.materials[m].mean_diffuse[static_cast<int>(c)];
          float count = trust[x] + kTowardMean;
          for (const int neighbour : graph.neighbours[x]) {
            if (neighbour < 0) continue;
            const auto y = static_cast<std::size_t>(neighbour);
            if (reflectance.material[y] != reflectance.material[x]) continue;
            sum += channel[y];
            count += 1;
          }
          next[i] = sum / count;
        }
      });
      for (std::size_t i = 0; i < unsure.size(); ++i) channel[unsure[i]] = next[i];
    }
  }
}

}  // namespace dyxel
