// Where the person is: a coarse visual hull by voxel carving; docs/method.md (T6).
#pragma once

#include <span>
#include <vector>

#include "dyxel/capture/camera.h"
#include "dyxel/image/image.h"
#include "dyxel/math/types.h"

namespace dyxel::internal {

// What the hull says of a standing or jumping person. Axes: `up`, and two that complete it.
struct HullSummary {
  bool found = false;
  Vec3d center = Vec3d::Zero();  // of the hull's volume, world
  Vec3d trunk = Vec3d::Zero();   // where it is thickest (distance to its outside across `up`)
  double bottom = 0, top = 0;    // along `up`, metres
  std::size_t voxels = 0;
  // Share of the voxels, for each camera, that it can't tell from the dark (kMaskUnknown).
  std::vector<double> unknown;
};

// What an unknown pixel (kMaskUnknown) says: nothing is there, or nothing at all. Then two fifths
// of the cameras whose mask shows somebody (at least three, if there are as many) must see him in a
// voxel.
enum class Dark { kEmpty, kUnknown };

// The point that the rays through the masks' centres come nearest to (least squares, weighted by
// the mask's share of its picture).
[[nodiscard]] Vec3d MeetingPoint(std::span<const Camera> cameras, std::span<const ImageU8> masks);

// Carves a cube around the meeting point in two passes, coarse and within the hull's box with
// voxels of `voxel` metres. A voxel outside a camera's picture is not carved by it; half of
// the cameras, and two, must see it (Dark::kEmpty).
[[nodiscard]] HullSummary FindHull(std::span<const Camera> cameras,
                                   std::span<const ImageU8> masks,
                                   const Vec3d& up,
                                   double voxel = 0.025,
                                   Dark dark = Dark::kEmpty);

// A rotation whose third column is `up` and whose first is any level direction.
[[nodiscard]] Mat3d UprightFrame(const Vec3d& up);

}  // namespace dyxel::internal
