#include "dyxel/pipeline/stage_inputs.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "dyxel/base/parallel.h"
#include "dyxel/pipeline/atlas_files.h"
#include "dyxel/pipeline/reflectance_files.h"
#include "dyxel/texture/texture_files.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

constexpr double kCropMargin = 8;  // pixels

void Append(std::vector<fs::path>& to, const std::vector<fs::path>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

struct FrameRange {
  std::string sequence;
  int begin, end;
};

DyxelSource MakeSource(const Job& job, const std::vector<FrameRange>& ranges) {
  const Capture& capture = job.project().capture;
  std::vector<DyxelStep> steps;
  for (const FrameRange& range : ranges) {
    const Sequence& sequence = capture.FindSequence(range.sequence);
    for (int frame = range.begin; frame < range.end; ++frame) {
      steps.push_back({job.TextureFolder(sequence, frame), {}, capture.LightsOf(sequence, frame)});
      steps.back().surface = job.workspace->Posed(range.sequence, frame);
    }
  }
  return MakeDyxelSource(job.workspace->atlas(),
                         job.workspace->grid(),
                         EstimationCamerasOf(capture),
                         std::move(steps));
}

}  // namespace

const std::vector<ImageF>& PlateCache::Get(int camera) {
  const std::scoped_lock lock(mutex_);
  auto [entry, added] = plates_.try_emplace(camera);
  if (added) entry->second = ReadPlates(capture_, sequence_, camera);
  return entry->second;
}

bool IsLit(const Sequence& sequence) {
  return sequence.environment || !sequence.lights.empty() || !sequence.frame_lights.empty();
}

bool HasLamps(const Sequence& sequence) { return IsLit(sequence) && !sequence.environment; }

SilhouetteOptions SilhouetteOptionsOf(const Project& project, const Sequence& sequence) {
  SilhouetteOptions options = project.options.silhouettes;
  if (sequence.environment) options.shadow_tolerance = std::min(options.shadow_tolerance, 0.5);
  return options;
}

std::vector<Camera> EstimationCamerasOf(const Capture& capture) {
  std::vector<Camera> cameras;
  for (const int c : capture.EstimationCameras())
    cameras.push_back(capture.cameras[static_cast<std::size_t>(c)]);
  return cameras;
}

std::vector<std::string> EstimationCameraNames(const Capture& capture) {
  std::vector<std::string> names;
  for (const Camera& camera : EstimationCamerasOf(capture)) names.push_back(camera.name);
  return names;
}

Rect CropAround(const Camera& camera, std::span<const Vec3f> positions) {
  double x0 = camera.width;
  double y0 = camera.height;
  double x1 = 0;
  double y1 = 0;
  for (const Vec3f& x : positions) {
    const Vec3d world = x.cast<double>();
    if (camera.Depth(world) <= 0) continue;
    const Vec2d p = camera.Project(world);
    x0 = std::min(x0, p.x());
    x1 = std::max(x1, p.x());
    y0 = std::min(y0, p.y());
    y1 = std::max(y1, p.y());
  }
  const int left = std::max(0, static_cast<int>(std::floor(x0 - kCropMargin)));
  const int top = std::max(0, static_cast<int>(std::floor(y0 - kCropMargin)));
  const int right = std::min(camera.width, static_cast<int>(std::ceil(x1 + kCropMargin)));
  const int bottom = std::min(camera.height, static_cast<int>(std::ceil(y1 + kCropMargin)));
  if (right <= left || bottom <= top) return {};
  return {left, top, right - left, bottom - top};
}

std::vector<Picture> ReadCrops(const Capture& capture,
                               const Sequence& sequence,
                               int frame,
                               std::span<const Vec3f> positions) {
  const std::vector<int> cameras = capture.EstimationCameras();
  std::vector<Picture> pictures(cameras.size());
  ParallelFor(cameras.size(), [&](std::size_t i) {
    const Rect crop = CropAround(capture.cameras[static_cast<std::size_t>(cameras[i])], positions);
    if (crop.width == 0 || !HasFrame(capture, sequence, cameras[i], frame)) return;
    pictures[i] = ReadFrame(capture, sequence, cameras[i], frame, crop, Clipped::kNoValue);
  });
  return pictures;
}

std::vector<fs::path> SurfaceFiles(const Job& job, const Sequence& sequence, int frame) {
  std::vector<fs::path> files =
      AtlasFiles(job.workspace->AtlasFolder(), !job.project().HasGivenGeometry());
  if (job.project().HasGivenGeometry()) {
    files.push_back(job.workspace->GivenMesh(sequence.name, frame));
  } else {
    files.push_back(job.workspace->ActorFile());
    files.push_back(job.workspace->SurfaceMotionFile(sequence.name));
  }
  return files;
}

std::vector<fs::path> TextureInputs(const Job& job, const Sequence& sequence, int begin, int end) {
  std::vector<fs::path> files;
  for (int frame = begin; frame < end; ++frame) {
    Append(files, SurfaceFiles(job, sequence, frame));
    Append(files,
           MvvTextureFiles(job.TextureFolder(sequence, frame),
                           EstimationCameraNames(job.project().capture)));
  }
  std::sort(files.begin(), files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  return files;
}

std::vector<fs::path> NormalFiles(const Job& job, const Sequence& sequence) {
  std::vector<fs::path> files;
  const bool dynamic =
      std::find(job.dynamic.begin(), job.dynamic.end(), sequence.name) != job.dynamic.end();
  if (!dynamic || !HasLamps(sequence)) return files;
  for (const Chunk& chunk : Chunks(sequence.count, job.project().options.normals.chunk)) {
    files.push_back(job.NormalFile(sequence.name, chunk.centre));
  }
  return files;
}

std::vector<NormalKey> ReadNormalKeys(const Job& job, const Sequence& sequence) {
  std::vector<NormalKey> keys;
  if (NormalFiles(job, sequence).empty()) return keys;
  for (const Chunk& chunk : Chunks(sequence.count, job.project().options.normals.chunk)) {
    keys.push_back({static_cast<double>(chunk.begin + chunk.end - 1) / 2,
                    ReadNormals(job.NormalFile(sequence.name, chunk.centre))});
  }
  return keys;
}

DyxelSource SourceOf(const Job& job, const std::string& sequence_name, int begin, int end) {
  return MakeSource(job, {{sequence_name, begin, end}});
}

DyxelSource SourceOf(const Job& job, const std::vector<std::string>& sequences) {
  std::vector<FrameRange> ranges;
  ranges.reserve(sequences.size());
  for (const std::string& name : sequences) {
    ranges.push_back({name, 0, job.project().capture.FindSequence(name).count});
  }
  return MakeSource(job, ranges);
}

RelightableVideo AssembleVideo(const Job& job, const std::string& sequence_name) {
  const Project& project = job.project();
  Workspace& workspace = *job.workspace;
  const Sequence& sequence = project.capture.FindSequence(sequence_name);
  RelightableVideo video;
  video.name = project.capture.name;
  video.sequence = sequence_name;
  video.fps = project.capture.fps;
  video.up = project.capture.up;
  video.atlas = workspace.atlas();
  video.skin_triangles = workspace.skin_triangles();
  if (project.HasGivenGeometry()) {
    for (int frame = 0; frame < sequence.count; ++frame) {
      video.positions.push_back(workspace.Positions(sequence_name, frame));
      if (project.inputs.smooth_normals > 0) {
        video.normal_positions.push_back(workspace.NormalPositions(video.positions.back()));
      }
    }
  } else {
    video.actor = workspace.actor();
    video.motion = workspace.motion(sequence_name);
  }
  video.maps = ReadMaterialMaps(job.ReflectanceFolder());
  video.normals = ReadNormalKeys(job, sequence);
  return video;
}

}  // namespace dyxel
