// From a posed surface and a camera to blocks of points ready for shading.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "dyxel/image/image.h"
#include "dyxel/mesh/rasterizer.h"
#include "dyxel/render/renderer.h"
#include "dyxel/render/shade.h"

namespace dyxel::internal {

// What is interpolated over a triangle, one cache line a vertex.
struct alignas(64) PackedVertex {
  // position 0-2, normal 3-5, tangent 6-8, handedness 9, u 10, v 11, rest zero
  std::array<float, 16> v = {};
};
struct PackedSurface {
  std::vector<PackedVertex> vertices;  // (C)
};
[[nodiscard]] PackedSurface PackSurface(const RenderSurface& surface);

// A surface as a camera sees it, in samples: `samples` a pixel along each side, over the window of
// the picture (pixels) that the surface reaches.
struct ScreenSurface {
  int samples = 1;
  Rect window;
  std::vector<ScreenVertex> vertices;  // (C), samples from the window's corner
  VisibilityBuffer visibility;
  Vec3f eye = Vec3f::Zero();  // world
};
// Vertices are projected with the lens's distortion, and edges stay straight between them. Vertices
// behind the camera, or outside the cone in which the distortion is monotonic, are not drawn.
[[nodiscard]] ScreenSurface ProjectSurface(const RenderSurface& surface,
                                           const Camera& camera,
                                           int samples);

// Samples of one block: where they are, and what of them shading does not need.
struct SampleBlock {
  int count = 0;
  std::array<int, kShadeBlock> pixel = {};  // in the tile
  std::array<std::int32_t, kShadeBlock> triangle = {};
  std::array<int, kShadeBlock> x = {}, y = {};  // samples from the window's corner
  alignas(64) ShadeBlock::Row u = {}, v = {};   // out: parameterization I
  alignas(64) ShadeBlock::Row depth = {};       // out: metres along the camera's axis
};
// Interpolates the attributes of the samples (at least one) and looks up the maps: fills u, v and
// depth of `samples` and all of `shade` but the radiance. Seen from behind, both normals are
// mirrored. Instantiated for float and Lanes.
template <class T>
void GatherSamples(const RenderSurface& surface,
                   const PackedSurface& packed,
                   const ScreenSurface& screen,
                   SampleBlock& samples,
                   ShadeBlock& shade);

// map at (u, v) in [0, 1]², clamped at the edges: out[channels].
void Bilinear(const ImageF& map, float u, float v, float* out);
[[nodiscard]] std::uint8_t NearestTexel(const ImageU8& map, float u, float v);

}  // namespace dyxel::internal
