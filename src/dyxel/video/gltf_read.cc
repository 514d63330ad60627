#include "dyxel/video/gltf_read.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/reflectance/brdf.h"
#include "dyxel/video/actor_gltf.h"
#include "dyxel/video/glb.h"
#include "dyxel/video/map_coding.h"

namespace dyxel {
namespace {

using internal::GlbFile;
using internal::Influences;
using internal::Json;
using internal::ReadInfluences;
using internal::ReadLabels;
using internal::ReadMap;
using internal::ReadNormals;
using internal::ReadSkeleton;
using internal::ReadTriangles;
using internal::Unflatten;

constexpr int kMost = std::numeric_limits<int>::max();
constexpr int kMostTexels = 16384;  // a side

std::size_t Size(int n) { return static_cast<std::size_t>(n); }

// Reads one file. What depends on what is checked before it is used; every array's size is bounded
// by the file's, but for maps, which are bounded by kMostTexels.
class VideoReader {
 public:
  explicit VideoReader(const GlbFile& glb) : glb_(glb) {}

  RelightableVideo Read() {
    const Json& root = glb_.root();
    if (!root.contains("extensions") || !root["extensions"].is_object() ||
        !root["extensions"].contains("DYXEL_relightable_video")) {
      throw FileError(glb_.path(),
                      "is a glTF file without DYXEL_relightable_video",
                      "Give the .glb that dyxel run writes to PROJECT/video");
    }
    extension_ = &root["extensions"]["DYXEL_relightable_video"];
    const int version = glb_.Int(*extension_, "version", 0, kMost);
    if (version != 1) {
      throw FileError(glb_.path(),
                      fmt::format("is of version {} of DYXEL_relightable_video", version),
                      "This Dyxel reads version 1: take a newer Dyxel");
    }
    ReadHead();
    ReadMesh();
    if (extension_->contains("skin")) {
      ReadActorMotion();
    } else {
      ReadSurfaces();
    }
    ReadMaps();
    ReadNormalKeys();
    return std::move(video_);
  }

 private:
  void ReadHead() {
    const Json& e = *extension_;
    video_.name = glb_.Text(e, "name");
    video_.sequence = glb_.Text(e, "sequence");
    video_.fps = glb_.Number(e, "fps");
    if (!(video_.fps > 0)) glb_.Fail("has no positive fps");
    const std::vector<double> up = glb_.Numbers(e, "up", 3);
    video_.up = {up[0], up[1], up[2]};
    if (!(std::abs(video_.up.norm() - 1) < 1e-3)) glb_.Fail("has an up that is no unit vector");
    frames_ = glb_.Int(e, "frames", 1, 1 << 24);
    video_.atlas.size = glb_.Int(e, "atlasSize", 1, kMostTexels);
  }

  void ReadMesh() {
    const Json& mesh = glb_.Element("meshes", glb_.Int(*extension_, "mesh", 0, kMost));
    const Json& primitives = glb_.Member(mesh, "primitives");
    if (!primitives.is_array() || primitives.size() != 1) glb_.Fail("has not one mesh of one part");
    primitive_ = &primitives[0];
    attributes_ = &glb_.Member(*primitive_, "attributes");
    positions_ = Unflatten(Attribute("POSITION", 3));
    const std::size_t cut = positions_.size();
    if (cut == 0 || cut > Size(kMost) / 4) glb_.Fail("has no vertices");
    Atlas& atlas = video_.atlas;
    atlas.triangles =
        ReadTriangles(glb_, glb_.Int(*primitive_, "indices", 0, kMost), static_cast<int>(cut));
    atlas.uv_i = ReadUv("TEXCOORD_0");
    if (attributes_->contains("TEXCOORD_1")) atlas.uv_ii = ReadUv("TEXCOORD_1");
    atlas.skin_vertex =
        glb_.Integers(glb_.Int(*extension_, "skinVertex", 0, kMost), 1, static_cast<int>(cut) - 1);
    if (atlas.skin_vertex.size() != cut) glb_.Fail("has not as many skin vertices as vertices");
    num_skin_ = Size(*std::max_element(atlas.skin_vertex.begin(), atlas.skin_vertex.end())) + 1;
    for (const Triangle& t : atlas.triangles) {
      video_.skin_triangles.push_back({atlas.skin_vertex[Size(t[0])],
                                       atlas.skin_vertex[Size(t[1])],
                                       atlas.skin_vertex[Size(t[2])]});
    }
  }

  [[nodiscard]] std::vector<float> Attribute(const char* name, int width) const {
    return glb_.Floats(glb_.Int(*attributes_, name, 0, kMost), width);
  }

  [[nodiscard]] std::vector<Vec2f> ReadUv(const char* name) const {
    const std::vector<float> values = Attribute(name, 2);
    if (values.size() != 2 * positions_.size()) glb_.Fail("has not as many uv as vertices");
    std::vector<Vec2f> uv(positions_.size());
    for (std::size_t i = 0; i < uv.size(); ++i) uv[i] = {values[2 * i], values[2 * i + 1]};
    return uv;
  }

  // Of a value a cut vertex, those of the skin's vertices; the first for one that no vertex copies.
  template <class T>
  [[nodiscard]] std::vector<T> ToSkin(const std::vector<T>& cut) const {
    std::vector<T> skin(num_skin_, T(cut.front()));
    for (std::size_t c = 0; c < cut.size(); ++c) skin[Size(video_.atlas.skin_vertex[c])] = cut[c];
    return skin;
  }

  void ReadActorMotion() {
    Actor& actor = video_.actor.emplace();
    actor.skeleton = ReadSkeleton(glb_, glb_.Int(*extension_, "skin", 0, kMost));
    actor.skin.positions = ToSkin(positions_);
    actor.skin.triangles = video_.skin_triangles;
    const Influences influences = ReadInfluences(
        glb_, *attributes_, positions_.size(), static_cast<int>(actor.skeleton.joints.size()));
    actor.joint_indices = ToSkin(influences.joints);
    actor.joint_weights = ToSkin(influences.weights);

    const Json& poses = glb_.Member(*extension_, "poses");
    const std::size_t dofs = Size(actor.skeleton.NumDofs());
    if (Size(glb_.Int(poses, "dofs", 0, kMost)) != dofs) {
      glb_.Fail("has poses of another skeleton");
    }
    const std::size_t width = 3 + 4 + dofs + 1;
    const std::string_view bytes = glb_.BufferView(glb_.Int(poses, "bufferView", 0, kMost));
    if (bytes.size() != Size(frames_) * width * sizeof(double)) {
      glb_.Fail("has not as many poses as frames");
    }
    const std::size_t nodes = Size(actor.skeleton.NumNodes());
    constexpr std::size_t kShiftBytes = 3 * sizeof(std::int16_t);
    std::string_view shifts;
    if (nodes > 0) {
      shifts = glb_.BufferView(glb_.Int(poses, "shifts", 0, kMost));
      if (Size(glb_.Int(poses, "nodes", 0, kMost)) != nodes ||
          shifts.size() != Size(frames_) * nodes * kShiftBytes) {
        glb_.Fail("has not as many shifts as nodes and frames");
      }
    }
    std::vector<double> row(width);
    for (int f = 0; f < frames_; ++f) {
      std::memcpy(
          row.data(), bytes.data() + Size(f) * width * sizeof(double), width * sizeof(double));
      for (const double x : row) {
        if (!std::isfinite(x)) glb_.Fail("has a pose with no numbers");
      }
      Pose pose;
      pose.root_translation = {row[0], row[1], row[2]};
      pose.root_rotation = Quatd(row[6], row[3], row[4], row[5]);
      if (!(std::abs(pose.root_rotation.norm() - 1) < 1e-3)) {
        glb_.Fail("has a rotation that is no unit quaternion");
      }
      pose.angles.assign(row.begin() + 7, row.end() - 1);
      for (std::size_t k = 0; k < nodes; ++k) {
        std::array<std::int16_t, 3> units{};
        std::memcpy(units.data(), shifts.data() + (Size(f) * nodes + k) * kShiftBytes, kShiftBytes);
        pose.shifts.push_back(kShiftUnit * Vec3d(units[0], units[1], units[2]));
      }
      video_.motion.poses.push_back(std::move(pose));
      video_.motion.confidence.push_back(row.back());
    }
  }

  void ReadSurfaces() {
    video_.positions.push_back(ToSkin(positions_));
    if (frames_ > 1) {
      const Json& targets = glb_.Member(*primitive_, "targets");
      if (!targets.is_array() || targets.size() != Size(frames_ - 1)) {
        glb_.Fail("has not as many morph targets as frames");
      }
      for (const Json& target : targets) {
        std::vector<Vec3f> moved =
            Unflatten(glb_.Floats(glb_.Int(target, "POSITION", 0, kMost), 3));
        if (moved.size() != positions_.size()) glb_.Fail("has a morph target of another size");
        for (std::size_t c = 0; c < moved.size(); ++c) moved[c] += positions_[c];
        video_.positions.push_back(ToSkin(moved));
      }
    }
    if (extension_->contains("normalOffsets")) ReadNormalOffsets((*extension_)["normalOffsets"]);
  }

  void ReadNormalOffsets(const Json& coded) {
    // The skin may end with vertices that no triangle uses: they are not in the file.
    const std::size_t vertices = Size(glb_.Int(coded, "vertices", 0, kMost));
    const auto scale = static_cast<float>(glb_.Number(coded, "scale"));
    const std::string_view bytes = glb_.BufferView(glb_.Int(coded, "bufferView", 0, kMost));
    if (vertices < num_skin_ ||
        bytes.size() != Size(frames_) * vertices * 3 * sizeof(std::int16_t)) {
      glb_.Fail("has normal offsets of another size");
    }
    for (std::size_t f = 0; f < Size(frames_); ++f) {
      std::vector<Vec3f> frame = video_.positions[f];
      for (std::size_t v = 0; v < num_skin_; ++v) {
        std::int16_t d[3];
        std::memcpy(d, bytes.data() + (f * vertices + v) * sizeof(d), sizeof(d));
        for (int a = 0; a < 3; ++a) frame[v][a] += scale * static_cast<float>(d[a]);
      }
      video_.normal_positions.push_back(std::move(frame));
    }
  }

  void ReadMaps() {
    const Json& e = *extension_;
    MaterialMaps& maps = video_.maps;
    const int n = video_.atlas.size;
    maps.model = glb_.Text(e, "model");
    const std::vector<std::string> known = BrdfNames();
    if (std::find(known.begin(), known.end(), maps.model) == known.end()) {
      glb_.Fail(fmt::format("has the BRDF '{}', which this Dyxel does not know", maps.model));
    }
    const auto parameters = static_cast<int>(SpecularParameters(maps.model).size());
    const Json& materials = glb_.Member(e, "materials");
    if (!materials.is_array() || materials.empty() || materials.size() > 256) {
      glb_.Fail("has no list of materials");
    }
    for (const Json& json : materials) {
      Material material;
      material.name = glb_.Text(json, "name");
      for (const double x : glb_.Numbers(json, "specular", parameters)) {
        material.specular.push_back(static_cast<float>(x));
      }
      const std::vector<double> mean = glb_.Numbers(json, "meanDiffuse", 3);
      material.mean_diffuse = Eigen::Array3d(mean[0], mean[1], mean[2]).cast<float>();
      material.texels = glb_.Int(json, "texels", 0, kMost);
      maps.materials.push_back(std::move(material));
    }
    const Json& coded = glb_.Member(e, "parameters");
    maps.diffuse = ReadMap(glb_, glb_.Member(coded, "diffuse"), n, 3);
    maps.material = ReadLabels(
        glb_, glb_.Member(coded, "material"), n, static_cast<int>(maps.materials.size()) - 1);
    maps.confidence = ReadMap(glb_, glb_.Member(coded, "confidence"), n, 1);
    maps.normal = ReadNormals(glb_, glb_.Member(coded, "normal"), n);
    maps.specular = ImageF(n, n, parameters);
    ReadSpecular(coded, parameters);
  }

  void ReadSpecular(const Json& coded, int parameters) {
    MaterialMaps& maps = video_.maps;
    const std::size_t p = Size(parameters);
    if (!coded.contains("specular")) {
      for (std::size_t i = 0; i < maps.material.data.size(); ++i) {
        const std::vector<float>& own = maps.materials[maps.material.data[i]].specular;
        std::copy(own.begin(), own.end(), &maps.specular.data[i * p]);
      }
      return;
    }
    const Json& list = coded["specular"];
    if (!list.is_array() || list.size() != p)
      glb_.Fail("has not as many specular maps as the model");
    for (std::size_t k = 0; k < p; ++k) {
      const ImageF one = ReadMap(glb_, list[k], video_.atlas.size, 1);
      for (std::size_t i = 0; i < one.data.size(); ++i) maps.specular.data[i * p + k] = one.data[i];
    }
  }

  void ReadNormalKeys() {
    const Json& keys = glb_.Member(*extension_, "normalKeys");
    if (!keys.is_array()) glb_.Fail("has no list of normal keys");
    for (const Json& key : keys) {
      const double frame = glb_.Number(key, "frame");
      if (!video_.normals.empty() && !(video_.normals.back().frame < frame)) {
        glb_.Fail("has normal keys out of order");
      }
      video_.normals.push_back({frame, ReadNormals(glb_, key, video_.atlas.size)});
    }
  }

  const GlbFile& glb_;
  RelightableVideo video_;
  const Json* extension_ = nullptr;
  const Json* primitive_ = nullptr;
  const Json* attributes_ = nullptr;
  std::vector<Vec3f> positions_;  // (C) rest, or frame 0
  std::size_t num_skin_ = 0;
  int frames_ = 0;
};

}  // namespace

RelightableVideo ReadVideo(const std::filesystem::path& path) {
  const GlbFile glb(ReadFile(path), path);
  try {
    return VideoReader(glb).Read();
  } catch (const Json::exception& error) {
    glb.Fail(fmt::format("is damaged ({})", error.what()));
  } catch (const std::bad_alloc&) {
    glb.Fail("asks for more memory than there is");
  }
}

}  // namespace dyxel
