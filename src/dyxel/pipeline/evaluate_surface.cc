// Figures of the textured surface over time: alignment (M10) and flicker (M11); docs/method.md.
#include <algorithm>
#include <cmath>

#include "dyxel/base/parallel.h"
#include "dyxel/capture/truth.h"
#include "dyxel/image/metrics.h"
#include "dyxel/mesh/closest_point.h"
#include "dyxel/pipeline/evaluate_parts.h"
#include "dyxel/pipeline/reflectance_files.h"
#include "dyxel/pipeline/stage_inputs.h"
#include "dyxel/render/renderer.h"
#include "dyxel/texture/blend.h"
#include "dyxel/texture/texture_files.h"

namespace dyxel {
namespace {

// Share of seen texels from which a pixel of the textured model counts.
constexpr float kWhollySeen = 0.98F;

// The textures of a frame, or nothing where the stage has none of it.
std::optional<MvvTextures> TexturesOf(const Job& job, const Sequence& sequence, int frame) {
  const Capture& capture = job.project().capture;
  const std::vector<std::string> cameras = EstimationCameraNames(capture);
  const std::filesystem::path folder = job.TextureFolder(sequence, frame);
  for (const auto& file : MvvTextureFiles(folder, cameras)) {
    if (!std::filesystem::exists(file)) return std::nullopt;
  }
  const TexelGrid& grid = job.workspace->grid();
  return ReadMvvTextures(folder,
                         cameras,
                         static_cast<int>(capture.LightsOf(sequence, frame).size()),
                         grid,
                         0,
                         static_cast<int>(grid.count()));
}

// The model as a camera sees it, textured with `blend`: radiance [h][w][3], and where all of a
// pixel's texels are seen.
struct TexturedView {
  ImageF radiance;
  ImageU8 mask;
};
TexturedView ViewTextured(Workspace& workspace,
                          const PosedSurface& surface,
                          const BlendedTexture& blend,
                          const Camera& camera,
                          RenderOptions options) {
  std::vector<float> seen(blend.weight.size());
  std::transform(blend.weight.begin(), blend.weight.end(), seen.begin(), [](float w) {
    return w > 0 ? 1.0F : 0.0F;
  });
  // The diffuse pass shows a map as it is.
  MaterialMaps maps;
  maps.model = "phong";
  maps.diffuse = TexelImage(workspace.grid(), blend.radiance, 3);
  maps.confidence = TexelImage(workspace.grid(), seen, 1);
  maps.specular = ImageF(maps.diffuse.width, maps.diffuse.height, 2, 1.0F);
  options.samples = 1;
  const RenderSurface shown{&workspace.atlas(), &surface, &maps, nullptr};
  const std::vector<Pass> wanted = {Pass::kDiffuse, Pass::kConfidence};
  const std::vector<ImageF> passes =
      RenderPasses(shown, camera, PreparedLighting(shown, {}, options), wanted, options);
  TexturedView view{ImageF(camera.width, camera.height, 3),
                    ImageU8(camera.width, camera.height, 1)};
  for (std::size_t i = 0; i < view.mask.data.size(); ++i) {
    std::copy_n(&passes[0].data[4 * i], 3, &view.radiance.data[3 * i]);
    view.mask.data[i] = passes[1].data[4 * i] >= kWhollySeen ? 255 : 0;
  }
  return view;
}

// Which triangle's frame a texel has, and where it is.
Vec3f TexelPosition(const PosedSurface& surface, const Triangle& triangle, const Vec3f& bary) {
  Vec3f x = Vec3f::Zero();
  for (int i = 0; i < 3; ++i) {
    x += bary[i] *
         surface.positions[static_cast<std::size_t>(triangle[static_cast<std::size_t>(i)])];
  }
  return x;
}

// The true surface's normal nearest to each `wanted` texel, in the model's tangent frame (K); zero
// for others.
std::vector<Vec3f> TrueTexelNormals(Workspace& workspace,
                                    const PosedSurface& surface,
                                    const TriangleMesh& truth,
                                    std::span<const char> wanted) {
  const TexelGrid& grid = workspace.grid();
  const ClosestPointTree tree(truth.positions, truth.triangles);
  std::vector<Vec3f> normals(grid.count(), Vec3f::Zero());
  ParallelForBlocks(grid.count(), 1024, [&](std::size_t begin, std::size_t end) {
    int guess = -1;
    for (std::size_t k = begin; k < end; ++k) {
      if (wanted[k] == 0) continue;
      const Triangle& t = workspace.atlas().triangles[static_cast<std::size_t>(grid.triangle[k])];
      const ClosestPoint nearest = tree.Find(TexelPosition(surface, t, grid.bary[k]), guess);
      guess = nearest.triangle;
      const Triangle& face = truth.triangles[static_cast<std::size_t>(nearest.triangle)];
      const auto corner = [&](std::size_t i) -> const Vec3f& {
        return truth.positions[static_cast<std::size_t>(face[i])];
      };
      const Vec3f n = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
      normals[k] = TangentFrame(surface, t, grid.bary[k]).transpose() * n;
    }
  });
  return normals;
}

// Drops the texels that no camera sees in a frame.
void KeepSeen(const MvvTextures& textures, std::vector<char>& seen) {
  for (std::size_t k = 0; k < seen.size(); ++k) {
    const auto by = [&](const std::vector<float>& weight) { return weight[k] > 0; };
    if (seen[k] != 0 && std::none_of(textures.weight.begin(), textures.weight.end(), by))
      seen[k] = 0;
  }
}

// Texels (K) that are seen in every frame; none where a frame has no textures.
const std::vector<char>& SeenThroughout(const Evaluation& e, const Sequence& sequence) {
  std::vector<char>& seen = (*e.seen)[e.job->TextureFolder(sequence, 0)];
  if (!seen.empty()) return seen;
  seen.assign(e.job->workspace->grid().count(), 1);
  for (int frame = 0; frame < sequence.count; ++frame) {
    const std::optional<MvvTextures> textures = TexturesOf(*e.job, sequence, frame);
    if (textures) {
      KeepSeen(*textures, seen);
    } else {
      std::fill(seen.begin(), seen.end(), char{0});
    }
  }
  return seen;
}

}  // namespace

void MeasureAlignment(const Evaluation& e, const Sequence& sequence) {
  Workspace& workspace = *e.job->workspace;
  const Capture& capture = e.job->project().capture;
  const std::vector<int> indices = capture.EstimationCameras();
  const std::vector<Camera> cameras = EstimationCamerasOf(capture);
  double length = 0;
  double pixels = 0;
  std::vector<char> seen(workspace.grid().count(), 1);
  bool all = true;
  for (int frame = 0; frame < sequence.count; ++frame) {
    e.Progress(frame, sequence.count);
    const std::optional<MvvTextures> textures = TexturesOf(*e.job, sequence, frame);
    all = all && textures;
    if (!textures) continue;
    KeepSeen(*textures, seen);
    const PosedSurface surface = workspace.Posed(sequence.name, frame);
    const std::vector<std::vector<float>> weights =
        BlendWeights(workspace.atlas(), workspace.grid(), surface, cameras, *textures);
    std::vector<FlowMeasure> flows(cameras.size());
    ParallelFor(cameras.size(), [&](std::size_t c) {
      if (!HasFrame(capture, sequence, indices[c], frame)) return;
      const ImageF recorded = ReadFrame(capture, sequence, indices[c], frame).image;
      const ImageU8 mask = RecordedMask(e, sequence, indices[c], frame);
      const double scale = DisplayScale(recorded, mask);
      if (!std::isfinite(scale)) return;
      // What the other cameras saw.
      const BlendedTexture others = BlendTexture(*textures, weights, static_cast<int>(c));
      const TexturedView view =
          ViewTextured(workspace, surface, others, cameras[c], e.job->project().options.render);
      flows[c] = MeasureFlow(recorded, mask, view.radiance, view.mask, scale);
    });
    for (const FlowMeasure& flow : flows) {
      if (flow.pixels <= 0) continue;
      length += flow.mean_px * flow.pixels;
      pixels += flow.pixels;
    }
  }
  if (all) (*e.seen)[e.job->TextureFolder(sequence, 0)] = std::move(seen);
  if (pixels > 0) e.metrics->Set("tracking." + sequence.name + ".flow_px", length / pixels);
}

void Flicker::Add(std::span<const Vec3f> vectors) {
  if (frames_ == 0) sum_.assign(vectors.size(), 0.0);
  for (std::size_t k = 0; frames_ >= 2 && k < vectors.size(); ++k) {
    sum_[k] += static_cast<double>((older_[k] - 2.0F * last_[k] + vectors[k]).norm());
  }
  older_ = std::move(last_);
  last_.assign(vectors.begin(), vectors.end());
  ++frames_;
}

double Flicker::MeanDeg(std::span<const char> counted) const {
  Series lengths;
  for (std::size_t k = 0; k < sum_.size(); ++k) {
    if (frames_ >= 3 && counted[k] != 0) lengths.Add(sum_[k] / (frames_ - 2));
  }
  return lengths.Mean() * 180 / kPiD;
}

void MeasureFlicker(const Evaluation& e, const Sequence& sequence) {
  if (NormalFiles(*e.job, sequence).empty()) return;
  Workspace& workspace = *e.job->workspace;
  const TexelGrid& grid = workspace.grid();
  const FrameMaps maps(e, sequence);
  const auto truth_of = [&](int frame) {
    return e.truth ? e.truth->MeshPath(sequence, frame) : std::filesystem::path();
  };
  bool true_normals = true;
  for (int frame = 0; frame < sequence.count; ++frame) {
    const std::filesystem::path file = truth_of(frame);
    true_normals = true_normals && !file.empty() && std::filesystem::exists(file);
  }
  const std::vector<char>& seen = SeenThroughout(e, sequence);
  Flicker flicker;
  for (int frame = 0; frame < sequence.count; ++frame) {
    e.Progress(frame, sequence.count);
    const ImageF map = maps.NormalMap(frame);
    std::vector<Vec3f> normals(grid.count());
    for (std::size_t k = 0; k < normals.size(); ++k) {
      normals[k] = Eigen::Map<const Vec3f>(&map.data[3 * static_cast<std::size_t>(grid.pixel[k])]);
    }
    if (true_normals) {
      const std::vector<Vec3f> truth = TrueTexelNormals(
          workspace, workspace.Posed(sequence.name, frame), ReadPly(truth_of(frame)), seen);
      for (std::size_t k = 0; k < normals.size(); ++k) normals[k] -= truth[k];
    }
    flicker.Add(normals);
  }
  e.metrics->Set("normals." + sequence.name + ".flicker_deg", flicker.MeanDeg(seen));
}

}  // namespace dyxel
