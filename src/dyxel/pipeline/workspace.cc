#include "dyxel/pipeline/workspace.h"

#include <algorithm>

#include "dyxel/base/error.h"
#include "dyxel/body/motion_io.h"
#include "dyxel/body/nodes.h"
#include "dyxel/mesh/texel_grid.h"
#include "dyxel/pipeline/atlas_files.h"
#include "dyxel/pipeline/stage_inputs.h"
#include "dyxel/video/actor_gltf.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

// Loads `slot` once by f().
template <class T, class F>
const T& Lazy(std::recursive_mutex& mutex, std::unique_ptr<T>& slot, F&& f) {
  const std::scoped_lock lock(mutex);
  if (!slot) slot = std::make_unique<T>(f());
  return *slot;
}

}  // namespace

const Actor& Workspace::bones() {
  return Lazy(mutex_, bones_, [&] { return ReadActor(ActorFile()); });
}

const Actor& Workspace::actor() {
  return Lazy(mutex_, actor_, [&] { return WithNodes(bones()); });
}

const Motion& Workspace::motion(const std::string& sequence) {
  const std::scoped_lock lock(mutex_);
  return Lazy(mutex_, motions_[sequence], [&] {
    const fs::path file = SurfaceMotionFile(sequence);
    Motion motion = ReadMotion(file, actor().skeleton);
    const int count = project_.capture.FindSequence(sequence).count;
    if (static_cast<int>(motion.poses.size()) != count) {
      throw FileError(file,
                      fmt::format("has {} poses for {} frames", motion.poses.size(), count),
                      "Delete it and run again");
    }
    return motion;
  });
}

bool Workspace::IsRegistered(const std::string& sequence) const {
  if (project_.HasGivenGeometry() || project_.options.registration.rounds == 0) return false;
  const std::vector<std::string> fitted = project_.ReflectanceSequences();
  const std::vector<std::string> dynamic = project_.DynamicSequences();
  const auto has = [&](const std::vector<std::string>& names) {
    return std::find(names.begin(), names.end(), sequence) != names.end();
  };
  return !fitted.empty() && !has(fitted) && has(dynamic) &&
         HasLamps(project_.capture.FindSequence(sequence));
}

const Atlas& Workspace::atlas() {
  return Lazy(mutex_, atlas_, [&] { return ReadAtlas(AtlasFolder()); });
}

const TexelGrid& Workspace::grid() {
  return Lazy(mutex_, grid_, [&] { return MakeTexelGrid(atlas()); });
}

const TexelGraph& Workspace::graph() {
  return Lazy(mutex_, graph_, [&] { return TexelGraph{TexelNeighbours(atlas(), grid())}; });
}

const std::vector<Triangle>& Workspace::skin_triangles() {
  return Lazy(mutex_, triangles_, [&] {
    if (!project_.HasGivenGeometry()) return actor().skin.triangles;
    return ReadPly(GivenMesh(project_.ActorSequence().name, 0)).triangles;
  });
}

fs::path Workspace::MaskFile(const std::string& sequence, int camera, int frame) const {
  const Sequence& s = project_.capture.FindSequence(sequence);
  return project_.folder / "silhouettes" / sequence /
         project_.capture.cameras[static_cast<std::size_t>(camera)].name /
         (Project::FrameName(s, frame) + ".png");
}

fs::path Workspace::GivenMesh(const std::string& sequence, int frame) const {
  const Sequence& s = project_.capture.FindSequence(sequence);
  return project_.inputs.geometry / sequence / (Project::FrameName(s, frame) + ".ply");
}

std::vector<Vec3f> Workspace::Positions(const std::string& sequence, int frame) {
  if (!project_.HasGivenGeometry()) {
    return SkinPositions(actor(), motion(sequence).poses[static_cast<std::size_t>(frame)]);
  }
  const fs::path file = GivenMesh(sequence, frame);
  TriangleMesh mesh = ReadPly(file);
  if (mesh.triangles != skin_triangles()) {
    throw FileError(file,
                    "has other triangles than the first mesh of the reflectance sequence",
                    "Give meshes of one topology throughout");
  }
  return std::move(mesh.positions);
}

std::vector<Vec3f> Workspace::NormalPositions(std::span<const Vec3f> positions) {
  if (project_.inputs.smooth_normals == 0) return {};
  return SmoothPositions(positions, skin_triangles(), project_.inputs.smooth_normals);
}

PosedSurface Workspace::Posed(const std::string& sequence, int frame) {
  const std::vector<Vec3f> positions = Positions(sequence, frame);
  return PoseSurface(atlas(), skin_triangles(), positions, NormalPositions(positions));
}

void Workspace::Forget() {
  const std::scoped_lock lock(mutex_);
  bones_.reset();
  actor_.reset();
  motions_.clear();
  atlas_.reset();
  grid_.reset();
  graph_.reset();
  triangles_.reset();
}

}  // namespace dyxel
