// Figures that need the truth: silhouettes, surface, normals, albedo; docs/method.md (M6)-(M8).
#include <algorithm>
#include <cmath>
#include <optional>

#include "dyxel/base/parallel.h"
#include "dyxel/capture/truth.h"
#include "dyxel/image/image_io.h"
#include "dyxel/image/metrics.h"
#include "dyxel/mesh/closest_point.h"
#include "dyxel/mesh/rasterizer.h"
#include "dyxel/pipeline/evaluate_parts.h"
#include "dyxel/pipeline/stage_inputs.h"
#include "dyxel/render/renderer.h"
#include "dyxel/texture/mvv_textures.h"

namespace dyxel {
namespace {

std::vector<ScreenVertex> ToScreen(const Camera& camera, std::span<const Vec3f> positions) {
  std::vector<ScreenVertex> screen(positions.size());
  ParallelForBlocks(positions.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3d x = positions[i].cast<double>();
      const double z = camera.Depth(x);
      const Vec2d p = z > 0 ? camera.Project(x) : Vec2d(0, 0);
      screen[i] = {static_cast<float>(p.x()),
                   static_cast<float>(p.y()),
                   z > 0 ? static_cast<float>(1 / z) : 0.0F};
    }
  });
  return screen;
}

VisibilityBuffer See(const Camera& camera,
                     std::span<const Vec3f> positions,
                     std::span<const Triangle> triangles) {
  return Rasterize(ToScreen(camera, positions), triangles, camera.width, camera.height);
}

// Vertices of triangles that some camera sees.
std::vector<char> SeenVertices(const std::vector<Camera>& cameras,
                               std::span<const Vec3f> positions,
                               std::span<const Triangle> triangles) {
  std::vector<char> seen(positions.size(), 0);
  for (const Camera& camera : cameras) {
    for (const std::int32_t t : See(camera, positions, triangles).triangle) {
      if (t < 0) continue;
      for (const int v : triangles[static_cast<std::size_t>(t)])
        seen[static_cast<std::size_t>(v)] = 1;
    }
  }
  return seen;
}

// Distances in metres from the seen points of one surface to another.
void AddDistances(std::span<const Vec3f> from,
                  const std::vector<char>& seen,
                  const ClosestPointTree& to,
                  Series& series) {
  std::vector<float> distance(from.size(), -1);
  ParallelForBlocks(from.size(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (seen[i] != 0) distance[i] = to.Find(from[i]).distance;
    }
  });
  for (const float d : distance) {
    if (d >= 0) series.Add(static_cast<double>(d));
  }
}

}  // namespace

ImageU8 RecordedMask(const Evaluation& e, const Sequence& sequence, int camera, int frame) {
  const Capture& capture = e.job->project().capture;
  if (e.truth) {
    ImageU8 mask = e.truth->Mask(capture, sequence, camera, frame);
    if (!mask.empty()) return mask;
  }
  const auto file = e.job->workspace->MaskFile(sequence.name, camera, frame);
  if (std::filesystem::exists(file)) return ReadPngMask(file);
  ImageU8 mask = ReadGivenMask(capture, sequence, camera, frame);
  if (mask.empty()) {
    mask = ExtractSilhouette(ReadFrame(capture, sequence, camera, frame).image,
                             ReadPlates(capture, sequence, camera),
                             SilhouetteOptionsOf(e.job->project(), sequence));
  }
  return mask;
}

void MeasureSilhouettes(const Evaluation& e, const Sequence& sequence) {
  if (!e.truth || e.job->project().HasGivenGeometry()) return;
  const Capture& capture = e.job->project().capture;
  Series iou;
  for (int frame = 0; frame < sequence.count; ++frame) {
    for (const int camera : capture.EstimationCameras()) {
      const ImageU8 truth = e.truth->Mask(capture, sequence, camera, frame);
      const auto own = e.job->workspace->MaskFile(sequence.name, camera, frame);
      if (!truth.empty() && std::filesystem::exists(own)) iou.Add(Iou(ReadPngMask(own), truth));
    }
  }
  e.metrics->Set("silhouette." + sequence.name + ".iou", iou.Mean());
  e.metrics->Set("silhouette." + sequence.name + ".iou_worst", iou.Min());
}

void MeasureTracking(const Evaluation& e, const Sequence& sequence) {
  Workspace& workspace = *e.job->workspace;
  const Project& project = e.job->project();
  const std::vector<Camera> cameras = EstimationCamerasOf(project.capture);
  const std::vector<int> indices = project.capture.EstimationCameras();
  Series iou;
  Series distances;
  for (int frame = 0; frame < sequence.count; ++frame) {
    e.Progress(frame, sequence.count);
    const std::vector<Vec3f> positions = workspace.Positions(sequence.name, frame);
    std::vector<std::optional<double>> overlap(cameras.size());
    ParallelFor(cameras.size(), [&](std::size_t i) {
      if (!HasFrame(project.capture, sequence, indices[i], frame)) return;
      const VisibilityBuffer view = See(cameras[i], positions, workspace.skin_triangles());
      ImageU8 rendered(view.width, view.height, 1);
      for (std::size_t p = 0; p < rendered.data.size(); ++p)
        rendered.data[p] = view.triangle[p] >= 0 ? 255 : 0;
      overlap[i] = Iou(rendered, RecordedMask(e, sequence, indices[i], frame));
    });
    for (const std::optional<double>& value : overlap) {
      if (value) iou.Add(*value);
    }
    const std::filesystem::path truth =
        e.truth ? e.truth->MeshPath(sequence, frame) : std::filesystem::path();
    if (truth.empty() || !std::filesystem::exists(truth)) continue;
    const TriangleMesh mesh = ReadPly(truth);
    AddDistances(mesh.positions,
                 SeenVertices(cameras, mesh.positions, mesh.triangles),
                 ClosestPointTree(positions, workspace.skin_triangles()),
                 distances);
    AddDistances(positions,
                 SeenVertices(cameras, positions, workspace.skin_triangles()),
                 ClosestPointTree(mesh.positions, mesh.triangles),
                 distances);
  }
  const std::string group = "tracking." + sequence.name;
  e.metrics->Set(group + ".iou", iou.Mean());
  e.metrics->Set(group + ".iou_worst", iou.Min());
  e.metrics->Set(group + ".surface_mm", 1000 * distances.Mean());
  e.metrics->Set(group + ".surface_p95_mm", 1000 * distances.Percentile(0.95));
}

namespace {

// Degrees between normals, over pixels that both passes cover; and the albedo's squared errors.
struct PassErrors {
  Series normal, base, one_lamp, one_lamp_base;
  double albedo_squares = 0;
  double albedo_count = 0;
};

// Which of a frame's lamps reach a point of the surface.
struct LampsOnSurface {
  LampsOnSurface(std::vector<Light> lamps,
                 const std::vector<Vec3f>& positions,
                 std::span<const Triangle> triangles,
                 int size)
      : lights(std::move(lamps)) {
    for (const Light& light : lights)
      shadows.push_back(MakeShadowMap(light, positions, triangles, size));
  }
  // `base` is the surface's own smooth normal, `normal` the true one.
  [[nodiscard]] int Count(const Vec3f& x, const Vec3f& normal, const Vec3f& base) const {
    int count = 0;
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const Illumination light = Illuminate(lights[l], x);
      const bool reached =
          normal.dot(light.to_light) > 0 && light.cone > 0 && shadows[l].Visible(x, base) > 0.5F;
      count += reached ? 1 : 0;
    }
    return count;
  }

  std::vector<Light> lights;
  std::vector<ShadowMap> shadows;
};

double AngleDeg(const Vec3f& a, const Vec3f& b) {
  return static_cast<double>(std::acos(std::clamp(a.dot(b), -1.0F, 1.0F)) * 180 / kPi);
}

Vec3f VectorAt(const ImageF& image, int x, int y) {
  return {image.At(x, y, 0), image.At(x, y, 1), image.At(x, y, 2)};
}

// `own` holds the normal, diffuse and depth pass; `smooth` the model's own normals.
void AddPassErrors(const Camera& camera,
                   const TruthPasses& truth,
                   const std::vector<ImageF>& own,
                   const ImageF& smooth,
                   const LampsOnSurface& lamps,
                   PassErrors& errors) {
  const Vec3d axis = camera.cam_from_world.rotation.row(2).transpose();
  const Vec3d centre = camera.Center();
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const float coverage = own[0].At(x, y, 3);
      const Vec3f true_normal = VectorAt(truth.normal, x, y);
      if (coverage <= 0 || true_normal.squaredNorm() < 0.25F) continue;
      const Vec3f t = true_normal.normalized();
      const Vec3f n = VectorAt(own[0], x, y).normalized();
      const Vec3f b = VectorAt(smooth, x, y).normalized();
      errors.normal.Add(AngleDeg(n, t));
      errors.base.Add(AngleDeg(b, t));
      const Vec3d ray = camera.Ray({x + 0.5, y + 0.5});
      const Vec3d point = centre + ray * (static_cast<double>(own[2].At(x, y, 0)) / ray.dot(axis));
      if (lamps.Count(point.cast<float>(), t, b) == 1) {
        errors.one_lamp.Add(AngleDeg(n, t));
        errors.one_lamp_base.Add(AngleDeg(b, t));
      }
      if (truth.albedo.empty()) continue;
      for (int c = 0; c < 3; ++c) {
        const auto d =
            static_cast<double>(own[1].At(x, y, c) / coverage - truth.albedo.At(x, y, c));
        errors.albedo_squares += d * d;
        errors.albedo_count += 1;
      }
    }
  }
}

}  // namespace

void MeasurePasses(const Evaluation& e, const Sequence& sequence) {
  if (!e.truth) return;
  Workspace& workspace = *e.job->workspace;
  const Project& project = e.job->project();
  const Capture& capture = project.capture;
  const FrameMaps maps(e, sequence);
  RenderOptions options = project.options.render;
  options.samples = 1;  // a pass is compared at pixel centres, not averaged over an edge
  PassErrors errors;
  for (int frame = 0; frame < sequence.count; ++frame) {
    e.Progress(frame, sequence.count);
    std::vector<int> cameras;
    for (int c = 0; c < static_cast<int>(capture.cameras.size()); ++c) {
      const std::vector<int> frames = e.truth->PassFrames(capture, sequence, c);
      if (std::find(frames.begin(), frames.end(), frame) != frames.end()) cameras.push_back(c);
    }
    if (cameras.empty()) continue;
    const PosedSurface surface = workspace.Posed(sequence.name, frame);
    const ImageF normal_map = maps.NormalMap(frame);
    const RenderSurface shown{
        &workspace.atlas(), &surface, &maps.maps(), e.base_normals ? nullptr : &normal_map};
    const RenderSurface base{&workspace.atlas(), &surface, &maps.maps(), nullptr};
    const LampsOnSurface lamps(capture.LightsOf(sequence, frame),
                               workspace.Positions(sequence.name, frame),
                               workspace.skin_triangles(),
                               options.shadow_size);
    const PreparedLighting dark(shown, {}, options);
    for (const int c : cameras) {
      const Camera& camera = capture.cameras[static_cast<std::size_t>(c)];
      const TruthPasses truth = e.truth->Passes(capture, sequence, c, frame);
      if (truth.normal.empty()) continue;
      const std::vector<Pass> wanted = {Pass::kNormal, Pass::kDiffuse, Pass::kDepth};
      const std::vector<ImageF> own = RenderPasses(shown, camera, dark, wanted, options);
      const std::vector<Pass> normal_only = {Pass::kNormal};
      const ImageF smooth = RenderPasses(base, camera, dark, normal_only, options)[0];
      AddPassErrors(camera, truth, own, smooth, lamps, errors);
    }
  }
  if (errors.normal.empty()) return;
  const std::string group = "normals." + sequence.name;
  e.metrics->Set(group + ".normal_deg", errors.normal.Mean());
  e.metrics->Set(group + ".normal_median_deg", errors.normal.Percentile(0.5));
  e.metrics->Set(group + ".share_11", errors.normal.ShareBelow(11.25));
  e.metrics->Set(group + ".share_22", errors.normal.ShareBelow(22.5));
  e.metrics->Set(group + ".base_deg", errors.base.Mean());
  e.metrics->Set(group + ".one_lamp_deg", errors.one_lamp.Mean());
  e.metrics->Set(group + ".one_lamp_base_deg", errors.one_lamp_base.Mean());
  e.metrics->Set("albedo." + sequence.name + ".albedo_psnr",
                 -10 * std::log10(errors.albedo_squares / errors.albedo_count));
}

}  // namespace dyxel
