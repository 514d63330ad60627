// What several stages and commands read of a project, loaded once: actor, motion, atlas, surfaces.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "dyxel/body/actor.h"
#include "dyxel/mesh/atlas.h"
#include "dyxel/mesh/surface.h"
#include "dyxel/pipeline/project.h"
#include "dyxel/reflectance/dyxels.h"

namespace dyxel {

// Loads on first use and keeps; thread-safe. Forget() after a stage has rewritten its files.
class Workspace {
 public:
  explicit Workspace(const Project& project) : project_(project) {}

  [[nodiscard]] const Project& project() const { return project_; }
  // What actor.glb holds: the skin on its bones.
  [[nodiscard]] const Actor& bones();
  // The same with the nodes that motions shift (body/nodes.h).
  [[nodiscard]] const Actor& actor();
  // What SurfaceMotionFile() holds.
  [[nodiscard]] const Motion& motion(const std::string& sequence);
  [[nodiscard]] const Atlas& atlas();
  [[nodiscard]] const TexelGrid& grid();
  [[nodiscard]] const TexelGraph& graph();
  // Triangles of the skin: the actor's, or the given meshes'.
  [[nodiscard]] const std::vector<Triangle>& skin_triangles();

  // World positions of the skin (V) in a frame. Throws Error(kInput) where a given mesh is missing
  // or of another topology.
  [[nodiscard]] std::vector<Vec3f> Positions(const std::string& sequence, int frame);
  // The same with normals and tangents; smoothed normals where the project says so.
  [[nodiscard]] PosedSurface Posed(const std::string& sequence, int frame);
  // Given surfaces whose normals are of a smoothed surface: that surface (V); empty otherwise.
  [[nodiscard]] std::vector<Vec3f> NormalPositions(std::span<const Vec3f> positions);

  void Forget();

  // Paths of the project folder.
  [[nodiscard]] std::filesystem::path ActorFile() const {
    return project_.folder / "actor" / "actor.glb";
  }
  // The poses that the actor was fitted in.
  [[nodiscard]] std::filesystem::path ActorMotionFile() const {
    return project_.folder / "actor" / "motion.json";
  }
  [[nodiscard]] std::filesystem::path MotionFile(const std::string& sequence) const {
    return project_.folder / "motion" / (sequence + ".json");
  }
  [[nodiscard]] std::filesystem::path RegistrationFile(const std::string& sequence) const {
    return project_.folder / "registration" / (sequence + ".json");
  }
  // True for a DSS under lamps whose tracked surface is registered to its pictures.
  [[nodiscard]] bool IsRegistered(const std::string& sequence) const;
  // The motion that poses a sequence's surface: the registered one, or the tracked one.
  [[nodiscard]] std::filesystem::path SurfaceMotionFile(const std::string& sequence) const {
    return IsRegistered(sequence) ? RegistrationFile(sequence) : MotionFile(sequence);
  }
  [[nodiscard]] std::filesystem::path AtlasFolder() const { return project_.folder / "atlas"; }
  [[nodiscard]] std::filesystem::path MaskFile(const std::string& sequence,
                                               int camera,
                                               int frame) const;
  [[nodiscard]] std::filesystem::path GivenMesh(const std::string& sequence, int frame) const;

 private:
  const Project& project_;
  std::recursive_mutex mutex_;
  std::unique_ptr<Actor> bones_;
  std::unique_ptr<Actor> actor_;
  std::map<std::string, std::unique_ptr<Motion>> motions_;
  std::unique_ptr<Atlas> atlas_;
  std::unique_ptr<TexelGrid> grid_;
  std::unique_ptr<TexelGraph> graph_;
  std::unique_ptr<std::vector<Triangle>> triangles_;
};

}  // namespace dyxel
