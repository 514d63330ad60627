#include "dyxel/tracking/registration.h"

#include <algorithm>
#include <cmath>

#include "dyxel/base/parallel.h"
#include "dyxel/image/flow.h"
#include "dyxel/image/metrics.h"
#include "dyxel/image/sampling.h"
#include "dyxel/tracking/node_fit.h"
#include "dyxel/tracking/sequence_tracker.h"

namespace dyxel {
namespace {

using internal::Match;
using internal::Projector;

constexpr float kLeastFacing = 0.25F;      // cosine between view and normal
constexpr float kDepthAgreement = 0.012F;  // metres: a vertex is seen where the depth says so
constexpr float kLeastContrast = 0.03F;    // local deviation of display values
constexpr float kReturn = 1.0F;            // pixels, and a tenth of the flow: forth and back
constexpr float kStructure = 0.15F;        // of the tensor's eigenvalues: half weight
constexpr double kInertia = 0.02;

// Luminance as displayed of the radiance (3 or 4 channels) in a window [h][w][1], white at
// 1/`scale`; no value (NaN) is black.
ImageF Luminance(const ImageF& radiance, const Rect& window, float scale) {
  ImageF out(window.width, window.height, 1);
  for (int y = 0; y < window.height; ++y) {
    for (int x = 0; x < window.width; ++x) {
      const float* c = &radiance.data[radiance.Index(window.x + x, window.y + y)];
      const float l = scale * (0.2126F * c[0] + 0.7152F * c[1] + 0.0722F * c[2]);
      out.At(x, y) = l > 0 ? SrgbFromLinear(std::min(l, 1.0F)) : 0.0F;
    }
  }
  return out;
}

// The two directions of a picture's structure around a pixel, the stronger first.
struct Structure {
  Vec2f direction;
  float strong, weak;  // eigenvalues
};
Structure StructureAt(const ImageF& image, int x, int y) {
  constexpr int kRadius = 2;
  float xx = 0, xy = 0, yy = 0;
  for (int v = y - kRadius; v <= y + kRadius; ++v) {
    for (int u = x - kRadius; u <= x + kRadius; ++u) {
      const int i = std::clamp(u, 1, image.width - 2);
      const int j = std::clamp(v, 1, image.height - 2);
      const float dx = image.At(i + 1, j) - image.At(i - 1, j);
      const float dy = image.At(i, j + 1) - image.At(i, j - 1);
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
    }
  }
  const float half = 0.5F * (xx + yy);
  const float root = std::sqrt(0.25F * (xx - yy) * (xx - yy) + xy * xy);
  Structure s{Vec2f::UnitX(), half + root, std::max(half - root, 0.0F)};
  if (std::abs(xy) > 1e-9F) {
    s.direction = Vec2f(s.strong - yy, xy).normalized();
  } else if (yy > xx) {
    s.direction = Vec2f::UnitY();
  }
  return s;
}

// `weight` times the area that is nearest to each vertex (V).
std::vector<float> VertexWeights(std::span<const Vec3f> positions,
                                 std::span<const Triangle> triangles,
                                 float weight) {
  std::vector<float> weights(positions.size(), 0.0F);
  for (const Triangle& t : triangles) {
    const auto at = [&](std::size_t k) { return positions[static_cast<std::size_t>(t[k])]; };
    const float area = 0.5F * (at(1) - at(0)).cross(at(2) - at(0)).norm();
    for (const int v : t) weights[static_cast<std::size_t>(v)] += weight * area / 3;
  }
  return weights;
}

// What one camera's flow says of the vertices that it sees, appended to `matches`.
void AddFlow(const Camera& camera,
             const PredictedPicture& predicted,
             const Picture& recorded,
             const ImageU8& silhouette,
             std::span<const Vec3f> positions,
             std::span<const Vec3f> normals,
             std::span<const float> weights,
             std::vector<Match>& matches) {
  const Rect& window = recorded.window;
  if (recorded.image.empty() || silhouette.empty() || window.width < 8 || window.height < 8) return;
  ImageU8 drawn(window.width, window.height, 1);
  ImageU8 seen(window.width, window.height, 1);
  for (int y = 0; y < window.height; ++y) {
    for (int x = 0; x < window.width; ++x) {
      const float coverage = predicted.radiance.At(window.x + x, window.y + y, 3);
      drawn.At(x, y) = coverage >= 0.5F ? 255 : 0;
      seen.At(x, y) = silhouette.At(window.x + x, window.y + y) >= 128 ? 255 : 0;
    }
  }
  const auto scale = static_cast<float>(DisplayScale(recorded.image, seen));
  if (!std::isfinite(scale)) return;
  ImageF contrast_drawn, contrast_seen;
  const ImageF from =
      NormaliseContrast(Luminance(predicted.radiance, window, scale), drawn, 8, &contrast_drawn);
  const ImageF to =
      NormaliseContrast(Luminance(recorded.image, {0, 0, window.width, window.height}, scale),
                        seen,
                        8,
                        &contrast_seen);
  const ImageF there = OpticalFlow(from, to);
  const ImageF back = OpticalFlow(to, from);

  const Projector project(camera);
  const Vec3f centre = camera.Center().cast<float>();
  for (std::size_t v = 0; v < positions.size(); ++v) {
    const Vec3f p = project(positions[v]);
    if (!(p.z() > 0)) continue;
    const int x = static_cast<int>(std::floor(p.x())) - window.x;
    const int y = static_cast<int>(std::floor(p.y())) - window.y;
    if (x < 0 || y < 0 || x >= window.width || y >= window.height) continue;
    if (drawn.At(x, y) == 0 || contrast_drawn.At(x, y) < kLeastContrast) continue;
    if (std::abs(predicted.depth.At(window.x + x, window.y + y) - p.z()) > kDepthAgreement)
      continue;
    const float facing = normals[v].dot((centre - positions[v]).normalized());
    if (facing < kLeastFacing) continue;
    const Vec2f flow(there.At(x, y, 0), there.At(x, y, 1));
    const int u = x + static_cast<int>(std::lround(flow.x()));
    const int w = y + static_cast<int>(std::lround(flow.y()));
    if (u < 0 || w < 0 || u >= window.width || w >= window.height) continue;
    if (seen.At(u, w) == 0 || contrast_seen.At(u, w) < kLeastContrast) continue;
    const Vec2f returned(back.At(u, w, 0), back.At(u, w, 1));
    if ((flow + returned).norm() > kReturn + 0.1F * flow.norm()) continue;
    const Structure structure = StructureAt(from, x, y);
    const float metres = p.z() / static_cast<float>(camera.fx);
    const auto jacobian = project.Jacobian(positions[v]);
    const auto add = [&](const Vec2f& direction, float strength) {
      const float trust = facing * strength / (strength + kStructure);
      if (trust < 0.02F) return;
      matches.push_back({static_cast<int>(v),
                         metres * (jacobian.transpose() * direction),
                         -metres * flow.dot(direction),
                         weights[v] * trust});
    };
    add(structure.direction, structure.strong);
    add(Vec2f(-structure.direction.y(), structure.direction.x()), structure.weak);
  }
}

}  // namespace

Motion RegisterMotion(const SilhouetteSet& silhouettes,
                      const Actor& actor_with_nodes,
                      Motion motion,
                      const PredictPictures& predict,
                      const RecordedPictures& recorded,
                      const RegistrationOptions& options,
                      const MotionOptions& motion_options,
                      const ProgressFn& progress) {
  CheckOptions("registration", options);
  internal::CheckSilhouettes(silhouettes);
  const internal::TrackedBody body = internal::MakeTrackedBody(actor_with_nodes, 0);
  const internal::NodeFit fit(body);
  const std::size_t frames = motion.poses.size();
  const std::size_t cameras = silhouettes.cameras.size();
  const internal::NodeSettings settings{
      .rounds = 2, .stiffness = motion_options.node_stiffness, .inertia = kInertia};
  for (int round = 0; round < options.rounds; ++round) {
    const std::vector<Pose> last = motion.poses;
    for (std::size_t t = 0; t < frames; ++t) {
      const std::vector<Vec3f> positions = SkinPositions(actor_with_nodes, last[t]);
      const std::vector<Vec3f> normals = VertexNormals(positions, actor_with_nodes.skin.triangles);
      const std::vector<float> weights = VertexWeights(
          positions, actor_with_nodes.skin.triangles, static_cast<float>(options.picture_weight));
      const std::vector<PredictedPicture> predictions = predict(t, positions);
      const std::vector<Picture> pictures = recorded(t, positions);
      std::vector<std::vector<Match>> parts(cameras);
      ParallelFor(cameras, [&](std::size_t c) {
        AddFlow(silhouettes.cameras[c],
                predictions[c],
                pictures[c],
                silhouettes.masks[t][c],
                positions,
                normals,
                weights,
                parts[c]);
      });
      std::vector<Match> seen;
      for (const auto& part : parts) seen.insert(seen.end(), part.begin(), part.end());
      if (progress) {
        progress(static_cast<double>(static_cast<std::size_t>(round) * frames + t) /
                 static_cast<double>(static_cast<std::size_t>(options.rounds) * frames));
      }
      const internal::Observation observation = internal::ObserveFrame(silhouettes, t);
      if (seen.empty() || observation.views.empty()) continue;
      motion.poses[t] =
          fit.Solve(observation, last[t], internal::ShiftsBeside(last, t), settings, seen).pose;
    }
  }
  return motion;
}

}  // namespace dyxel
