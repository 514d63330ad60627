#include "dyxel/texture/blend.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/parallel.h"

namespace dyxel {

std::vector<std::vector<float>> BlendWeights(const Atlas& atlas,
                                             const TexelGrid& grid,
                                             const PosedSurface& surface,
                                             std::span<const Camera> cameras,
                                             const MvvTextures& textures,
                                             float sharpness) {
  std::vector<Vec3f> centres;
  centres.reserve(cameras.size());
  for (const Camera& camera : cameras) centres.push_back(camera.Center().cast<float>());
  std::vector<std::vector<float>> weights(centres.size(), std::vector<float>(grid.count(), 0.0F));
  ParallelForBlocks(grid.count(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const Triangle& t = atlas.triangles[static_cast<std::size_t>(grid.triangle[k])];
      Vec3f x = Vec3f::Zero();
      Vec3f n = Vec3f::Zero();
      for (std::size_t c = 0; c < 3; ++c) {
        const float b = grid.bary[k][static_cast<int>(c)];
        x += b * surface.positions[static_cast<std::size_t>(t[c])];
        n += b * surface.normals[static_cast<std::size_t>(t[c])];
      }
      n.normalize();
      for (std::size_t c = 0; c < centres.size(); ++c) {
        if (textures.weight[c][k] <= 0) continue;
        const float facing = std::max(n.dot((centres[c] - x).normalized()), 0.0F);
        weights[c][k] = textures.weight[c][k] * std::pow(facing, sharpness);
      }
    }
  });
  return weights;
}

BlendedTexture BlendTexture(const MvvTextures& textures,
                            std::span<const std::vector<float>> weights,
                            int left_out) {
  BlendedTexture blended;
  const std::size_t count = weights.empty() ? 0 : weights[0].size();
  blended.radiance.assign(3 * count, 0.0F);
  blended.weight.assign(count, 0.0F);
  ParallelForBlocks(count, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = 0; c < weights.size(); ++c) {
      if (static_cast<int>(c) == left_out) continue;
      for (std::size_t k = begin; k < end; ++k) {
        const float weight = weights[c][k];
        if (weight <= 0) continue;
        for (std::size_t i = 3 * k; i < 3 * k + 3; ++i) {
          blended.radiance[i] += weight * textures.radiance[c][i];
        }
        blended.weight[k] += weight;
      }
    }
    for (std::size_t k = begin; k < end; ++k) {
      if (blended.weight[k] <= 0) continue;
      for (std::size_t i = 3 * k; i < 3 * k + 3; ++i) blended.radiance[i] /= blended.weight[k];
    }
  });
  return blended;
}

ImageF TexelImage(const TexelGrid& grid, std::span<const float> values, int channels) {
  ImageF map(grid.size, grid.size, channels);
  const auto n = static_cast<std::size_t>(channels);
  for (std::size_t k = 0; k < grid.count(); ++k) {
    std::copy_n(values.data() + n * k, n, &map.data[n * static_cast<std::size_t>(grid.pixel[k])]);
  }
  FillGutters(grid, map);
  return map;
}

}  // namespace dyxel
