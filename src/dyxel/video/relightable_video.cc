#include "dyxel/video/relightable_video.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"

namespace dyxel {
namespace {

// Spherical linear interpolation of two unit vectors; linear and normalised where they are so close
// that the sines vanish (or opposite, where the arc is undefined).
void Slerp(const float* a, const float* b, float t, float* out) {
  const float dot = std::clamp(a[0] * b[0] + a[1] * b[1] + a[2] * b[2], -1.0F, 1.0F);
  float wa = 1 - t;
  float wb = t;
  if (dot < 0.999F && dot > -0.9999F) {
    const float angle = std::acos(dot);
    wa = std::sin((1 - t) * angle);
    wb = std::sin(t * angle);
  }
  for (int c = 0; c < 3; ++c) out[c] = wa * a[c] + wb * b[c];
  const float length = std::sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
  if (!(length > 1e-6F)) {
    std::copy_n(a, 3, out);
    return;
  }
  for (int c = 0; c < 3; ++c) out[c] /= length;
}

// The two frames around `frame`, and where between them.
struct Between {
  std::size_t first, second;
  double t;
};
Between FindBetween(double frame, int count) {
  const double clamped = std::clamp(std::isfinite(frame) ? frame : 0.0, 0.0, count - 1.0);
  const auto first = static_cast<std::size_t>(clamped);
  const std::size_t second = std::min(first + 1, static_cast<std::size_t>(count - 1));
  return {first, second, clamped - static_cast<double>(first)};
}

std::vector<Vec3f> Interpolate(const std::vector<Vec3f>& a, const std::vector<Vec3f>& b, double t) {
  if (t == 0) return a;
  const auto s = static_cast<float>(t);
  std::vector<Vec3f> out(a.size());
  for (std::size_t v = 0; v < a.size(); ++v) out[v] = (1 - s) * a[v] + s * b[v];
  return out;
}

}  // namespace

ImageF NormalMapAt(const RelightableVideo& video, double frame) {
  const std::vector<NormalKey>& keys = video.normals;
  if (keys.empty()) return video.maps.normal;
  const auto after =
      std::upper_bound(keys.begin(), keys.end(), frame, [](double f, const NormalKey& key) {
        return f < key.frame;
      });
  if (after == keys.begin()) return keys.front().normal;
  const NormalKey& a = *(after - 1);
  if (after == keys.end() || a.frame == frame) return a.normal;
  const NormalKey& b = *after;
  const auto t = static_cast<float>((frame - a.frame) / (b.frame - a.frame));
  ImageF out(a.normal.width, a.normal.height, 3);
  ParallelForBlocks(out.data.size() / 3, 16384, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Slerp(&a.normal.data[3 * i], &b.normal.data[3 * i], t, &out.data[3 * i]);
    }
  });
  return out;
}

std::vector<Vec3f> SkinPositionsAt(const RelightableVideo& video, double frame) {
  Require(
      video.NumFrames() > 0, Fault::kUsage, "the relightable video '{}' has no frames", video.name);
  const Between at = FindBetween(frame, video.NumFrames());
  if (video.actor) {
    const std::vector<Pose>& poses = video.motion.poses;
    return SkinPositions(*video.actor, InterpolatePoses(poses[at.first], poses[at.second], at.t));
  }
  return Interpolate(video.positions[at.first], video.positions[at.second], at.t);
}

std::vector<Vec3f> NormalPositionsAt(const RelightableVideo& video, double frame) {
  if (video.normal_positions.empty()) return {};
  const Between at = FindBetween(frame, static_cast<int>(video.normal_positions.size()));
  return Interpolate(video.normal_positions[at.first], video.normal_positions[at.second], at.t);
}

PosedSurface SurfaceAt(const RelightableVideo& video, double frame) {
  return PoseSurface(video.atlas,
                     video.skin_triangles,
                     SkinPositionsAt(video, frame),
                     NormalPositionsAt(video, frame));
}

}  // namespace dyxel
