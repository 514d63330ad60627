#include "dyxel/reflectance/fill.h"

#include <utility>

#include "dyxel/base/parallel.h"

namespace dyxel {
namespace {
constexpr int kRounds = 40;
}

void FillUnmeasured(const TexelGraph& graph, Reflectance& reflectance) {
  const std::size_t num_texels = reflectance.filled.size();
  std::vector<std::size_t> queue;  // measured texels, then the others by distance from them
  std::vector<std::uint8_t> reached(num_texels, 0);
  for (std::size_t x = 0; x < num_texels; ++x) {
    if (reflectance.filled[x] != 0) continue;
    reached[x] = 1;
    queue.push_back(x);
  }
  const std::size_t measured = queue.size();
  for (std::size_t head = 0; head < queue.size(); ++head) {
    const std::size_t x = queue[head];
    for (const int neighbour : graph.neighbours[x]) {
      if (neighbour < 0) continue;
      const auto y = static_cast<std::size_t>(neighbour);
      if (reached[y] != 0) continue;
      reached[y] = 1;
      reflectance.material[y] = reflectance.material[x];
      for (auto& channel : reflectance.diffuse) channel[y] = channel[x];
      queue.push_back(y);
    }
  }
  for (std::size_t x = 0; x < num_texels; ++x) {
    if (reflectance.filled[x] != 0) reflectance.normal[x] = Vec3f::UnitZ();
    if (reached[x] != 0) continue;
    reflectance.material[x] = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      reflectance.diffuse[c][x] = reflectance.materials[0].mean_diffuse[static_cast<int>(c)];
    }
  }

  const std::size_t num_filled = queue.size() - measured;
  std::vector<float> next(num_filled);
  for (auto& channel : reflectance.diffuse) {
    for (int round = 0; round < kRounds; ++round) {
      ParallelForBlocks(num_filled, 4096, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          const std::size_t x = queue[measured + i];
          float sum = 0;
          float count = 0;
          for (const int neighbour : graph.neighbours[x]) {
            if (neighbour < 0) continue;
            const auto y = static_cast<std::size_t>(neighbour);
            if (reflectance.material[y] != reflectance.material[x]) continue;
            sum += channel[y];
            count += 1;
          }
          next[i] = count > 0 ? sum / count : channel[x];
        }
      });
      for (std::size_t i = 0; i < num_filled; ++i) channel[queue[measured + i]] = next[i];
    }
  }
}

}  // namespace dyxel
