#include "dyxel/texture/blend.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/parallel.h"

namespace dyxel {

BlendedTexture BlendTexture(const Atlas& atlas,
                            const TexelGrid& grid,
                            const PosedSurface& surface,
                            std::span<const Camera> cameras,
                            const MvvTextures& textures,
                            float sharpness) {
  std::vector<Vec3f> centres;
  for (const Camera& camera : cameras) centres.push_back(camera.Center().cast<float>());
  BlendedTexture blended;
  blended.radiance.assign(3 * grid.count(), 0.0F);
  blended.weight.assign(grid.count(), 0.0F);
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
      float total = 0;
      Rgb sum = Rgb::Zero();
      for (std::size_t c = 0; c < centres.size(); ++c) {
        if (textures.weight[c][k] <= 0) continue;
        const float facing = std::max(n.dot((centres[c] - x).normalized()), 0.0F);
        const float weight = textures.weight[c][k] * std::pow(facing, sharpness);
        const float* const colour = &textures.radiance[c][3 * k];
        sum += weight * Rgb(colour[0], colour[1], colour[2]);
        total += weight;
      }
      blended.weight[k] = total;
      if (total <= 0) continue;
      for (std::size_t i = 0; i < 3; ++i) {
        blended.radiance[3 * k + i] = sum[static_cast<int>(i)] / total;
      }
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
