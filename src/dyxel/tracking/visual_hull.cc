#include "dyxel/tracking/visual_hull.h"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "dyxel/base/parallel.h"
#include "dyxel/tracking/body_view.h"
#include "dyxel/tracking/silhouettes.h"

namespace dyxel::internal {
namespace {

bool MaskCentre(const ImageU8& mask, Vec2d& centre, double* area = nullptr) {
  double x = 0, y = 0, n = 0;
  for (int v = 0; v < mask.height; v += 2) {
    for (int u = 0; u < mask.width; u += 2) {
      if (mask.At(u, v) < 128) continue;
      x += u + 0.5;
      y += v + 0.5;
      ++n;
    }
  }
  if (n == 0) return false;
  centre = Vec2d(x / n, y / n);
  if (area != nullptr) *area = n;
  return true;
}

struct Grid {
  Vec3d corner;  // in the upright frame
  double voxel = 0;
  int nx = 0, ny = 0, nz = 0;
  std::vector<std::uint8_t> full;  // [z][y][x]
};

// Pixels of the points of a row of voxels, which lie evenly along a line.
class RowProjector {
 public:
  RowProjector(const Camera& camera, const Mat3d& world_from_upright)
      : exact_(camera), distorted_(camera.HasDistortion()), turn_(world_from_upright) {
    Mat3d k;
    k << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1;
    linear_ = k * camera.cam_from_world.rotation * world_from_upright;
    offset_ = k * camera.cam_from_world.translation;
  }

  // Calls f(x, u, v) with the pixel of start + x (step, 0, 0) for those of `count` points that
  // `wanted` names and that lie before the camera.
  template <class F>
  void Row(const Vec3d& start,
           double step,
           int count,
           const std::vector<std::uint8_t>& wanted,
           F&& f) const {
    const Vec3f first = (linear_ * start + offset_).cast<float>();
    const Vec3f along = (step * linear_.col(0)).cast<float>();
    for (int i = 0; i < count; ++i) {
      const auto x = static_cast<std::size_t>(i);
      if (wanted[x] == 0) continue;
      Vec3f h = first + static_cast<float>(i) * along;
      if (!(h.z() > 0)) continue;
      if (distorted_) {
        h = exact_(Vec3d(turn_ * (start + Vec3d(i * step, 0, 0))).cast<float>());
      } else {
        const float w = 1 / h.z();
        h.x() *= w;
        h.y() *= w;
      }
      f(x, static_cast<int>(std::floor(h.x())), static_cast<int>(std::floor(h.y())));
    }
  }

 private:
  Projector exact_;
  bool distorted_;
  Mat3d turn_;
  Mat3d linear_;
  Vec3d offset_;
};

// An empty mask of a camera that has a picture would carve all away: such cameras are left out.
void Carve(std::span<const Camera> cameras,
           std::span<const ImageU8> masks,
           const std::vector<int>& used,
           const Mat3d& world_from_upright,
           Dark dark,
           Grid& grid) {
  grid.full.assign(static_cast<std::size_t>(grid.nx) * static_cast<std::size_t>(grid.ny) *
                       static_cast<std::size_t>(grid.nz),
                   0);
  const int cameras_used = static_cast<int>(used.size());
  const int least = dark == Dark::kUnknown
                        ? std::max(std::min(3, cameras_used), 2 * cameras_used / 5)
                        : std::max(std::min(2, cameras_used), cameras_used / 2);
  std::vector<RowProjector> projectors;
  for (const int c : used) {
    projectors.emplace_back(cameras[static_cast<std::size_t>(c)], world_from_upright);
  }
  ParallelFor(static_cast<std::size_t>(grid.nz), [&](std::size_t z) {
    std::vector<std::uint8_t> inside(static_cast<std::size_t>(grid.nx));
    std::vector<int> seen(static_cast<std::size_t>(grid.nx));
    for (int y = 0; y < grid.ny; ++y) {
      std::fill(inside.begin(), inside.end(), std::uint8_t{1});
      std::fill(seen.begin(), seen.end(), 0);
      int left = grid.nx;
      const Vec3d start =
          grid.corner + grid.voxel * Vec3d(0.5, y + 0.5, static_cast<double>(z) + 0.5);
      for (std::size_t k = 0; k < used.size() && left > 0; ++k) {
        const ImageU8& mask = masks[static_cast<std::size_t>(used[k])];
        projectors[k].Row(start, grid.voxel, grid.nx, inside, [&](std::size_t x, int u, int v) {
          if (u < 0 || v < 0 || u >= mask.width || v >= mask.height) return;
          const std::uint8_t value = mask.At(u, v);
          if (dark == Dark::kUnknown && value == kMaskUnknown) return;
          ++seen[x];
          if (value >= 128) return;
          inside[x] = 0;
          --left;
        });
      }
      std::uint8_t* row =
          &grid.full[(z * static_cast<std::size_t>(grid.ny) + static_cast<std::size_t>(y)) *
                     static_cast<std::size_t>(grid.nx)];
      for (std::size_t x = 0; x < inside.size(); ++x) {
        row[x] = inside[x] != 0 && seen[x] >= least ? 1 : 0;
      }
    }
  });
}

}  // namespace

Mat3d UprightFrame(const Vec3d& up) {
  const Vec3d z = up.normalized();
  const Vec3d side = std::abs(z.x()) < 0.9 ? Vec3d(Vec3d::UnitX()) : Vec3d(Vec3d::UnitY());
  const Vec3d x = (side - z * z.dot(side)).normalized();
  Mat3d frame;
  frame.col(0) = x;
  frame.col(1) = z.cross(x);
  frame.col(2) = z;
  return frame;
}

Vec3d MeetingPoint(std::span<const Camera> cameras, std::span<const ImageU8> masks) {
  Mat3d a = Mat3d::Identity() * 1e-12;
  Vec3d b = Vec3d::Zero();
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    Vec2d centre;
    double weight = 0;  // its area: a silhouette lost in the dark says little
    if (masks[c].empty() || !MaskCentre(masks[c], centre, &weight)) continue;
    weight /= static_cast<double>(masks[c].data.size());
    const Vec3d ray = cameras[c].Ray(centre);
    const Mat3d across = Mat3d::Identity() - ray * ray.transpose();
    a += weight * across;
    b += weight * (across * cameras[c].Center());
  }
  return a.inverse() * b;
}

HullSummary FindHull(std::span<const Camera> cameras,
                     std::span<const ImageU8> masks,
                     const Vec3d& up,
                     double voxel,
                     Dark dark) {
  HullSummary hull;
  std::vector<int> used;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    Vec2d centre;
    if (!masks[c].empty() && MaskCentre(masks[c], centre)) used.push_back(static_cast<int>(c));
  }
  if (used.empty()) return hull;
  const Mat3d world_from_upright = UprightFrame(up);
  const Vec3d middle = world_from_upright.transpose() * MeetingPoint(cameras, masks);

  Grid grid;
  grid.voxel = 0.05;
  grid.nx = grid.ny = grid.nz = 72;  // 3.6 m
  grid.corner = middle - Vec3d::Constant(0.5 * 72 * grid.voxel);
  Carve(cameras, masks, used, world_from_upright, dark, grid);
  Vec3d low = Vec3d::Constant(1e9), high = Vec3d::Constant(-1e9);
  for (int z = 0, i = 0; z < grid.nz; ++z) {
    for (int y = 0; y < grid.ny; ++y) {
      for (int x = 0; x < grid.nx; ++x, ++i) {
        if (grid.full[static_cast<std::size_t>(i)] == 0) continue;
        const Vec3d p = grid.corner + grid.voxel * Vec3d(x, y, z);
        low = low.cwiseMin(p);
        high = high.cwiseMax(p + Vec3d::Constant(grid.voxel));
      }
    }
  }
  if (high.x() < low.x()) return hull;
  low.array() -= 0.05;
  high.array() += 0.05;
  grid.voxel = voxel;
  grid.corner = low;
  grid.nx = static_cast<int>(std::ceil((high.x() - low.x()) / voxel));
  grid.ny = static_cast<int>(std::ceil((high.y() - low.y()) / voxel));
  grid.nz = static_cast<int>(std::ceil((high.z() - low.z()) / voxel));
  Carve(cameras, masks, used, world_from_upright, dark, grid);

  std::vector<Projector> projectors;
  for (const Camera& camera : cameras) projectors.emplace_back(camera);
  std::vector<double> dark_voxels(cameras.size(), 0);
  Vec3d sum = Vec3d::Zero();
  std::vector<int> in_slice(static_cast<std::size_t>(grid.nz), 0);
  float thickest = 0;
  const std::size_t slice = static_cast<std::size_t>(grid.nx) * static_cast<std::size_t>(grid.ny);
  std::vector<float> thickness(static_cast<std::size_t>(grid.nz), 0.0F);
  std::vector<Vec2d> thick_at(static_cast<std::size_t>(grid.nz), Vec2d::Zero());
  for (int z = 0; z < grid.nz; ++z) {
    cv::Mat1b level(grid.ny + 2, grid.nx + 2, static_cast<std::uint8_t>(0));
    int count = 0;
    for (int y = 0; y < grid.ny; ++y) {
      for (int x = 0; x < grid.nx; ++x) {
        if (grid.full[static_cast<std::size_t>(z) * slice +
                      static_cast<std::size_t>(y * grid.nx + x)] == 0) {
          continue;
        }
        level(y + 1, x + 1) = 255;
        ++count;
        const Vec3d local = grid.corner + voxel * Vec3d(x + 0.5, y + 0.5, z + 0.5);
        sum += local;
        const Vec3f world = (world_from_upright * local).cast<float>();
        for (const int c : used) {
          const ImageU8& mask = masks[static_cast<std::size_t>(c)];
          const Vec3f p = projectors[static_cast<std::size_t>(c)](world);
          const int u = static_cast<int>(std::floor(p.x()));
          const int v = static_cast<int>(std::floor(p.y()));
          if (!(p.z() > 0) || u < 0 || v < 0 || u >= mask.width || v >= mask.height) continue;
          if (mask.At(u, v) == kMaskUnknown) ++dark_voxels[static_cast<std::size_t>(c)];
        }
      }
    }
    in_slice[static_cast<std::size_t>(z)] = count;
    hull.voxels += static_cast<std::size_t>(count);
    if (count == 0) continue;
    cv::Mat1f distance;
    cv::distanceTransform(level, distance, cv::DIST_L2, cv::DIST_MASK_5);
    double most = 0;
    cv::minMaxLoc(distance, nullptr, &most);
    // The middle of all that is nearly the thickest.
    Vec2d at = Vec2d::Zero();
    int n = 0;
    for (int y = 0; y < distance.rows; ++y) {
      for (int x = 0; x < distance.cols; ++x) {
        if (static_cast<double>(distance(y, x)) < 0.9 * most) continue;
        at += Vec2d(x - 0.5, y - 0.5);
        ++n;
      }
    }
    thickness[static_cast<std::size_t>(z)] = static_cast<float>(most);
    thick_at[static_cast<std::size_t>(z)] = at / n;
    thickest = std::max(thickest, static_cast<float>(most));
  }
  if (hull.voxels < 50) return hull;
  // Bottom and top: a thousandth of the volume lies beyond, so that no stray voxel decides.
  const auto tail = static_cast<int>(hull.voxels / 1000);
  int below = 0, first = 0, last = grid.nz - 1;
  while (first < grid.nz && (below += in_slice[static_cast<std::size_t>(first)]) <= tail) ++first;
  int above = 0;
  while (last > first && (above += in_slice[static_cast<std::size_t>(last)]) <= tail) --last;
  Vec3d trunk = Vec3d::Zero();
  double weight = 0;
  for (int z = 0; z < grid.nz; ++z) {
    if (thickness[static_cast<std::size_t>(z)] < 0.7F * thickest) continue;
    const double w = std::pow(static_cast<double>(thickness[static_cast<std::size_t>(z)]), 2);
    const Vec2d& at = thick_at[static_cast<std::size_t>(z)];
    trunk += w * (grid.corner + voxel * Vec3d(at.x(), at.y(), z + 0.5));
    weight += w;
  }
  hull.found = true;
  for (const double n : dark_voxels) {
    hull.unknown.push_back(n / static_cast<double>(hull.voxels));
  }
  hull.center = world_from_upright * (sum / static_cast<double>(hull.voxels));
  hull.trunk = world_from_upright * (trunk / weight);
  hull.bottom = grid.corner.z() + voxel * first;
  hull.top = grid.corner.z() + voxel * (last + 1);
  return hull;
}

}  // namespace dyxel::internal
