#include "dyxel/reflectance/dyxels.h"

#include <cstddef>

namespace dyxel {
namespace {

// Index of row (a, b) of an array [..][size_b][texel].
std::size_t Row(int a, int b, int size_b, int texels) {
  return (static_cast<std::size_t>(a) * static_cast<std::size_t>(size_b) +
          static_cast<std::size_t>(b)) *
         static_cast<std::size_t>(texels);
}
std::size_t Row(int a, int b, int size_b, int c, int texels) {
  return Row(a, b, size_b, 3 * texels) + Row(0, c, 3, texels);
}

}  // namespace

void DyxelTile::Resize(int num_texels, int num_frames, int num_cameras, int num_lights) {
  texels = num_texels;
  frames = num_frames;
  cameras = num_cameras;
  lights = num_lights;
  light_dir.assign(Row(frames, 0, lights, 3 * texels), 0.0F);
  irradiance.assign(Row(frames, 0, lights, 3 * texels), 0.0F);
  view_dir.assign(Row(frames, 0, cameras, 3 * texels), 0.0F);
  radiance.assign(Row(frames, 0, cameras, 3 * texels), 0.0F);
  weight.assign(Row(frames, 0, cameras, texels), 0.0F);
}

float* DyxelTile::LightDir(int frame, int light, int axis) {
  return light_dir.data() + Row(frame, light, lights, axis, texels);
}
float* DyxelTile::Irradiance(int frame, int light, int channel) {
  return irradiance.data() + Row(frame, light, lights, channel, texels);
}
float* DyxelTile::ViewDir(int frame, int camera, int axis) {
  return view_dir.data() + Row(frame, camera, cameras, axis, texels);
}
float* DyxelTile::Radiance(int frame, int camera, int channel) {
  return radiance.data() + Row(frame, camera, cameras, channel, texels);
}
float* DyxelTile::Weight(int frame, int camera) {
  return weight.data() + Row(frame, camera, cameras, texels);
}
const float* DyxelTile::LightDir(int frame, int light, int axis) const {
  return light_dir.data() + Row(frame, light, lights, axis, texels);
}
const float* DyxelTile::Irradiance(int frame, int light, int channel) const {
  return irradiance.data() + Row(frame, light, lights, channel, texels);
}
const float* DyxelTile::ViewDir(int frame, int camera, int axis) const {
  return view_dir.data() + Row(frame, camera, cameras, axis, texels);
}
const float* DyxelTile::Radiance(int frame, int camera, int channel) const {
  return radiance.data() + Row(frame, camera, cameras, channel, texels);
}
const float* DyxelTile::Weight(int frame, int camera) const {
  return weight.data() + Row(frame, camera, cameras, texels);
}

}  // namespace dyxel
