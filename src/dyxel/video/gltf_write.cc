#include "dyxel/video/gltf_write.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/image/png_file.h"
#include "dyxel/image/sampling.h"
#include "dyxel/reflectance/brdf.h"
#include "dyxel/video/actor_gltf.h"
#include "dyxel/video/base_look.h"
#include "dyxel/video/glb.h"
#include "dyxel/video/map_coding.h"

namespace dyxel {
namespace {

using internal::AddInfluences;
using internal::AddLabels;
using internal::AddMap16;
using internal::AddMap8;
using internal::AddNormals;
using internal::AddSkeleton;
using internal::AddWorldNode;
using internal::CheckActor;
using internal::EncodeNormals;
using internal::Flatten;
using internal::FlattenTriangles;
using internal::GlbBuilder;
using internal::GlbTarget;
using internal::Json;
using internal::SkeletonNodes;

std::size_t Size(int n) { return static_cast<std::size_t>(n); }

void Check(const RelightableVideo& video, const WriteVideoOptions& options) {
  const auto require = [&](bool ok, const char* what) {
    Require(ok, Fault::kUsage, "relightable video '{}': {}", video.name, what);
  };
  const Atlas& atlas = video.atlas;
  require(options.normal_bits >= 8 && options.normal_bits <= 16, "normal_bits must be 8 to 16");
  require(video.fps > 0 && std::isfinite(video.fps), "fps must be positive");
  require(video.up.norm() > 0.5, "has no up");
  require(video.NumFrames() > 0, "has no frames");
  const std::size_t cut = atlas.skin_vertex.size();
  require(cut > 0 && atlas.uv_i.size() == cut && (atlas.uv_ii.empty() || atlas.uv_ii.size() == cut),
          "the atlas's arrays disagree");
  require(!atlas.triangles.empty() && video.skin_triangles.size() == atlas.triangles.size(),
          "the atlas and the skin have different triangles");
  const std::size_t skin =
      video.actor ? video.actor->skin.positions.size() : video.positions[0].size();
  for (const int v : atlas.skin_vertex) {
    require(v >= 0 && Size(v) < skin, "the atlas copies a skin vertex that is not there");
  }
  for (std::size_t f = 0; f < atlas.triangles.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int c = atlas.triangles[f][k];
      require(c >= 0 && Size(c) < cut && atlas.skin_vertex[Size(c)] == video.skin_triangles[f][k],
              "a triangle of the atlas is not that of the skin");
    }
  }
  if (video.actor) {
    CheckActor(*video.actor);
    for (const Pose& pose : video.motion.poses) {
      require(pose.angles.size() == Size(video.actor->skeleton.NumDofs()),
              "a pose has not as many angles as the skeleton has dofs");
      require(pose.shifts.empty() || pose.shifts.size() == Size(video.actor->skeleton.NumNodes()),
              "a pose has not as many shifts as the skeleton has nodes");
    }
    require(video.motion.confidence.empty() ||
                video.motion.confidence.size() == video.motion.poses.size(),
            "not as many confidences as poses");
  }
  for (const auto& frame : video.positions) {
    require(frame.size() == skin, "not every frame has as many positions");
  }
  require(video.normal_positions.empty() || video.normal_positions.size() == video.positions.size(),
          "normal_positions has another number of frames");
  for (const auto& frame : video.normal_positions) {
    require(frame.size() == skin, "not every frame has as many normal positions");
  }
  const auto sized = [&](const auto& map, int channels, const char* what) {
    require(map.width == atlas.size && map.height == atlas.size &&
                (channels == 0 ? map.channels >= 1 : map.channels == channels),
            what);
  };
  const MaterialMaps& maps = video.maps;
  sized(maps.diffuse, 3, "the diffuse map has another size than the atlas");
  sized(maps.specular,
        static_cast<int>(SpecularParameters(maps.model).size()),
        "the specular map has another size or other parameters than the atlas and model");
  sized(maps.material, 1, "the material map has another size than the atlas");
  sized(maps.confidence, 1, "the confidence map has another size than the atlas");
  sized(maps.normal, 3, "the normal map has another size than the atlas");
  for (const NormalKey& key : video.normals) {
    sized(key.normal, 3, "a normal key has another size than the atlas");
  }
  for (std::size_t k = 1; k < video.normals.size(); ++k) {
    require(video.normals[k - 1].frame < video.normals[k].frame,
            "the normal keys are not in order");
  }
  require(!maps.materials.empty(), "has no materials");
  for (const Material& material : maps.materials) {
    require(material.specular.size() == Size(maps.specular.channels),
            "a material has other specular parameters than the map");
  }
  for (const std::uint8_t m : maps.material.data) {
    require(m < maps.materials.size(), "the material map names a material that is not there");
  }
}

std::vector<float> Flatten4(const PosedSurface& surface) {
  std::vector<float> out;
  out.reserve(4 * surface.tangents.size());
  for (std::size_t i = 0; i < surface.tangents.size(); ++i) {
    for (int a = 0; a < 3; ++a) out.push_back(surface.tangents[i][a]);
    out.push_back(surface.handedness[i]);
  }
  return out;
}

std::vector<float> FlattenUv(const std::vector<Vec2f>& uv) {
  std::vector<float> out;
  out.reserve(2 * uv.size());
  for (const Vec2f& x : uv) {
    out.push_back(x.x());
    out.push_back(x.y());
  }
  return out;
}

std::string_view BytesOf(const std::vector<double>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double)};
}

std::uint8_t Byte(float x) {
  return static_cast<std::uint8_t>(x > 0 ? std::lround(std::min(x, 1.0F) * 255) : 0);
}

// Builds the file of one video.
class VideoWriter {
 public:
  VideoWriter(const RelightableVideo& video, const WriteVideoOptions& options)
      : video_(video), options_(options) {}

  std::string Write() {
    AddMesh();
    if (video_.actor) {
      AddActorScene();
    } else {
      AddMorphScene();
    }
    AddMaterial();
    AddExtension();
    Json extras = {{"capture", video_.name}, {"sequence", video_.sequence}};
    for (const auto& entry : options_.provenance) extras[entry.first] = entry.second;
    return glb_.Finish("Dyxel", extras);
  }

 private:
  Json& root() { return glb_.root(); }

  void AddMesh() {
    base_ = video_.actor
                ? PoseSurface(video_.atlas, video_.skin_triangles, video_.actor->skin.positions)
                : SurfaceAt(video_, 0);
    Json attributes;
    attributes["POSITION"] =
        glb_.AddFloats(Flatten(base_.positions), 3, GlbTarget::kVertices, true);
    attributes["NORMAL"] = glb_.AddFloats(Flatten(base_.normals), 3, GlbTarget::kVertices);
    attributes["TANGENT"] = glb_.AddFloats(Flatten4(base_), 4, GlbTarget::kVertices);
    attributes["TEXCOORD_0"] =
        glb_.AddFloats(FlattenUv(video_.atlas.uv_i), 2, GlbTarget::kVertices);
    if (!video_.atlas.uv_ii.empty()) {
      attributes["TEXCOORD_1"] =
          glb_.AddFloats(FlattenUv(video_.atlas.uv_ii), 2, GlbTarget::kVertices);
    }
    if (video_.actor) AddInfluences(glb_, *video_.actor, video_.atlas.skin_vertex, attributes);
    const int indices =
        glb_.AddIndices(FlattenTriangles(video_.atlas.triangles), GlbTarget::kIndices);
    root()["meshes"].push_back(
        {{"name", "person"},
         {"primitives",
          Json::array({{{"attributes", attributes}, {"indices", indices}, {"material", 0}}})}});
    root()["nodes"].push_back({{"name", "person"}, {"mesh", 0}});
  }

  // Times of the frames in seconds, as an animation's input.
  int AddTimes() {
    std::vector<float> times;
    for (int f = 0; f < video_.NumFrames(); ++f) {
      times.push_back(static_cast<float>(f / video_.fps));
    }
    return glb_.AddFloats(times, 1, GlbTarget::kNone, true);
  }

  static void AddChannel(Json& animation, int input, int output, int node, const char* path) {
    animation["channels"].push_back(
        {{"sampler", animation["samplers"].size()}, {"target", {{"node", node}, {"path", path}}}});
    animation["samplers"].push_back(
        {{"input", input}, {"output", output}, {"interpolation", "LINEAR"}});
  }

  // One channel of rotations a joint, and of translations for the root and the nodes.
  void AddActorScene() {
    const Skeleton& skeleton = video_.actor->skeleton;
    const SkeletonNodes nodes = AddSkeleton(glb_, skeleton, video_.up);
    root()["nodes"][0]["skin"] = nodes.skin;
    root()["scenes"].push_back({{"nodes", {0, nodes.world}}});
    root()["scene"] = 0;

    const std::size_t num_frames = video_.motion.poses.size();
    std::vector<std::vector<float>> rotations(skeleton.joints.size());
    std::vector<std::vector<float>> translations(skeleton.joints.size());
    for (std::size_t f = 0; f < num_frames; ++f) {
      const Pose& pose = video_.motion.poses[f];
      const std::vector<Rigid> world_from_joint = skeleton.Forward(pose);
      for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
        const int parent = skeleton.joints[j].parent;
        const Mat3d local = parent < 0 ? world_from_joint[j].rotation
                                       : Mat3d(world_from_joint[Size(parent)].rotation.transpose() *
                                               world_from_joint[j].rotation);
        Eigen::Vector4f q = Quatd(local).normalized().coeffs().cast<float>();  // x, y, z, w
        std::vector<float>& out = rotations[j];
        if (f > 0) {  // the nearer of q and -q: the same turn
          const Eigen::Map<const Eigen::Vector4f> before(&out[4 * (f - 1)]);
          if (before.dot(q) < 0) q = -q;
        }
        out.insert(out.end(), q.data(), q.data() + 4);
        if (parent >= 0 && !skeleton.joints[j].IsNode()) continue;
        const Vec3d place = parent < 0 ? pose.root_translation
                                       : Vec3d(world_from_joint[Size(parent)].rotation.transpose() *
                                               (world_from_joint[j].translation -
                                                world_from_joint[Size(parent)].translation));
        for (int a = 0; a < 3; ++a) translations[j].push_back(static_cast<float>(place[a]));
      }
    }
    Json animation = {{"name", video_.sequence.empty() ? "motion" : video_.sequence},
                      {"samplers", Json::array()},
                      {"channels", Json::array()}};
    const int times = AddTimes();
    for (std::size_t j = 0; j < rotations.size(); ++j) {
      const int output = glb_.AddFloats(rotations[j], 4, GlbTarget::kNone);
      AddChannel(animation, times, output, nodes.joints[j], "rotation");
      if (translations[j].empty()) continue;
      const int places = glb_.AddFloats(translations[j], 3, GlbTarget::kNone);
      AddChannel(animation, times, places, nodes.joints[j], "translation");
    }
    root()["animations"].push_back(animation);
  }

  // Every frame but the first is a morph target; weights go linearly from one to the next.
  void AddMorphScene() {
    root()["nodes"].back()["name"] = "person";
    const int world = AddWorldNode(glb_, video_.up);
    root()["nodes"][Size(world)]["children"].push_back(0);
    root()["scenes"].push_back({{"nodes", {world}}});
    root()["scene"] = 0;
    const std::size_t num_frames = video_.positions.size();
    if (num_frames < 2) return;

    Json targets = Json::array();
    Json names = Json::array();
    for (std::size_t f = 1; f < num_frames; ++f) {
      const PosedSurface surface = SurfaceAt(video_, static_cast<double>(f));
      std::vector<float> positions = Flatten(surface.positions);
      std::vector<std::int8_t> normals(positions.size());
      for (std::size_t i = 0; i < positions.size(); ++i) {
        const auto a = static_cast<int>(i % 3);
        positions[i] -= base_.positions[i / 3][a];
        const float turn = surface.normals[i / 3][a] - base_.normals[i / 3][a];
        normals[i] = static_cast<std::int8_t>(std::lround(std::clamp(turn, -1.0F, 1.0F) * 127));
      }
      targets.push_back({{"POSITION", glb_.AddFloats(positions, 3, GlbTarget::kVertices, true)},
                         {"NORMAL", glb_.AddNormalizedBytes(normals, GlbTarget::kVertices)}});
      names.push_back("frame" + std::to_string(f));
    }
    Json& mesh = root()["meshes"][0];
    mesh["primitives"][0]["targets"] = targets;
    mesh["weights"] = std::vector<int>(num_frames - 1, 0);
    mesh["extras"] = {{"targetNames", names}};
    Use("KHR_mesh_quantization", true);

    std::vector<float> weights(num_frames * (num_frames - 1), 0.0F);
    for (std::size_t f = 1; f < num_frames; ++f) weights[f * (num_frames - 1) + f - 1] = 1;
    Json animation = {{"name", video_.sequence.empty() ? "motion" : video_.sequence},
                      {"samplers", Json::array()},
                      {"channels", Json::array()}};
    const int times = AddTimes();
    AddChannel(animation, times, glb_.AddFloats(weights, 1, GlbTarget::kNone), 0, "weights");
    root()["animations"].push_back(animation);
  }

  void Use(const char* extension, bool required = false) {
    root()["extensionsUsed"].push_back(extension);
    if (required) root()["extensionsRequired"].push_back(extension);
  }

  // The look of plain viewers: diffuse by its gain, roughness and specular by material.
  void AddMaterial() {
    const MaterialMaps& maps = video_.maps;
    const BaseLooks base = FitBaseLooks(maps.model, maps.materials);
    const int n = video_.atlas.size;
    ImageU8 color(n, n, 3);
    ImageU8 rough(n, n, 3);  // glTF: roughness in green, metallic in blue
    ImageU8 specular(n, n, 4);
    for (std::size_t i = 0; i < maps.material.data.size(); ++i) {
      const BaseLook& look = base.looks[maps.material.data[i]];
      for (std::size_t c = 0; c < 3; ++c) {
        color.data[3 * i + c] =
            Byte(SrgbFromLinear(look.diffuse_gain * maps.diffuse.data[3 * i + c]));
      }
      rough.data[3 * i + 1] = Byte(look.roughness);
      specular.data[4 * i + 3] = Byte(look.specular);
    }
    const ImageF& normal = video_.normals.empty() ? maps.normal : video_.normals.front().normal;
    ImageU8 normals(n, n, 3);
    for (std::size_t i = 0; i < normals.data.size(); ++i) {
      normals.data[i] = Byte(0.5F + 0.5F * normal.data[i]);
    }
    const int color_texture = glb_.AddPng(EncodePng(color), "base color", true);
    const int normal_texture = glb_.AddPng(EncodePng(normals), "normal", true);
    Json pbr = {{"baseColorTexture", {{"index", color_texture}}}, {"metallicFactor", 0}};
    Json khr_specular;
    if (maps.materials.size() == 1) {
      pbr["roughnessFactor"] = base.looks[0].roughness;
      khr_specular["specularFactor"] = base.looks[0].specular;
    } else {
      pbr["metallicRoughnessTexture"] = {
          {"index", glb_.AddPng(EncodePng(rough), "roughness", true)}};
      khr_specular["specularTexture"] = {
          {"index", glb_.AddPng(EncodePng(specular), "specular", true)}};
    }
    Use("KHR_materials_specular");
    Use("KHR_materials_ior");
    root()["materials"].push_back(
        {{"name", "person"},
         {"pbrMetallicRoughness", pbr},
         {"normalTexture", {{"index", normal_texture}}},
         {"doubleSided", !video_.actor},  // given surfaces may be open
         {"extensions",
          {{"KHR_materials_specular", khr_specular}, {"KHR_materials_ior", {{"ior", base.ior}}}}}});
  }

  // True where the map holds nothing but its materials' own parameters.
  [[nodiscard]] bool SpecularIsByMaterial() const {
    const MaterialMaps& maps = video_.maps;
    const std::size_t p = Size(maps.specular.channels);
    for (std::size_t i = 0; i < maps.material.data.size(); ++i) {
      const std::vector<float>& own = maps.materials[maps.material.data[i]].specular;
      if (!std::equal(own.begin(), own.end(), &maps.specular.data[i * p])) return false;
    }
    return true;
  }

  void AddExtension() {
    const MaterialMaps& maps = video_.maps;
    Json parameters;
    parameters["diffuse"] = AddMap16(glb_, maps.diffuse, "diffuse");
    parameters["material"] = AddLabels(glb_, maps.material, "material");
    parameters["confidence"] = AddMap8(glb_, maps.confidence, "confidence");
    if (!SpecularIsByMaterial()) {
      Json list = Json::array();
      const std::size_t p = Size(maps.specular.channels);
      for (std::size_t k = 0; k < p; ++k) {
        ImageF one(maps.specular.width, maps.specular.height, 1);
        for (std::size_t i = 0; i < one.data.size(); ++i)
          one.data[i] = maps.specular.data[i * p + k];
        list.push_back(AddMap16(glb_, one, "specular " + SpecularNames(maps.model)[k]));
      }
      parameters["specular"] = list;
    }
    Json materials = Json::array();
    for (const Material& material : maps.materials) {
      const Rgb& mean = material.mean_diffuse;
      materials.push_back({{"name", material.name},
                           {"specular", material.specular},
                           {"meanDiffuse", {mean[0], mean[1], mean[2]}},
                           {"texels", material.texels}});
    }

    // Compressing is what takes the time: all maps at once.
    std::vector<std::string> pngs(video_.normals.size() + 1);
    ParallelFor(pngs.size(), [&](std::size_t k) {
      pngs[k] =
          EncodeNormals(k == 0 ? maps.normal : video_.normals[k - 1].normal, options_.normal_bits);
    });
    parameters["normal"] = AddNormals(glb_, pngs[0], options_.normal_bits, "normal");
    Json keys = Json::array();
    for (std::size_t k = 1; k < pngs.size(); ++k) {
      Json key = AddNormals(glb_, pngs[k], options_.normal_bits, "normal " + std::to_string(k - 1));
      key["frame"] = video_.normals[k - 1].frame;
      keys.push_back(key);
    }

    Json extension = {{"version", 1},
                      {"name", video_.name},
                      {"sequence", video_.sequence},
                      {"fps", video_.fps},
                      {"up", {video_.up.x(), video_.up.y(), video_.up.z()}},
                      {"model", maps.model},
                      {"specularNames", SpecularNames(maps.model)},
                      {"atlasSize", video_.atlas.size},
                      {"frames", video_.NumFrames()},
                      {"mesh", 0},
                      {"skinVertex", AddSkinVertices()},
                      {"parameters", parameters},
                      {"materials", materials},
                      {"normalKeys", keys}};
    if (video_.actor) {
      extension["skin"] = 0;
      extension["poses"] = AddPoses();
    } else if (!video_.normal_positions.empty()) {
      extension["normalOffsets"] = AddNormalOffsets();
    }
    root()["extensions"]["DYXEL_relightable_video"] = extension;
    Use("DYXEL_relightable_video");
  }

  int AddSkinVertices() {
    const std::vector<int>& vertices = video_.atlas.skin_vertex;
    return glb_.AddIndices(std::vector<std::uint32_t>(vertices.begin(), vertices.end()),
                           GlbTarget::kNone);
  }

  // [frame] root translation (3), root rotation (x, y, z, w), angles (D), confidence, in double;
  // and [frame][node][3] shifts in whole kShiftUnit.
  Json AddPoses() {
    std::vector<double> values;
    for (std::size_t f = 0; f < video_.motion.poses.size(); ++f) {
      const Pose& pose = video_.motion.poses[f];
      values.insert(values.end(), pose.root_translation.data(), pose.root_translation.data() + 3);
      const Eigen::Vector4d& q = pose.root_rotation.coeffs();
      values.insert(values.end(), q.data(), q.data() + 4);
      values.insert(values.end(), pose.angles.begin(), pose.angles.end());
      values.push_back(video_.motion.confidence.empty() ? 1.0 : video_.motion.confidence[f]);
    }
    Json poses = {{"bufferView", glb_.AddBufferView(BytesOf(values))},
                  {"dofs", video_.actor->skeleton.NumDofs()}};
    const std::size_t nodes = Size(video_.actor->skeleton.NumNodes());
    if (nodes > 0) {
      std::vector<std::int16_t> shifts;
      for (const Pose& pose : video_.motion.poses) {
        for (std::size_t k = 0; k < nodes; ++k) {
          for (int a = 0; a < 3; ++a) {
            const double x = pose.shifts.empty() ? 0.0 : pose.shifts[k][a] / kShiftUnit;
            shifts.push_back(
                static_cast<std::int16_t>(std::lround(std::clamp(x, -32767.0, 32767.0))));
          }
        }
      }
      const std::string_view bytes(reinterpret_cast<const char*>(shifts.data()),
                                   shifts.size() * sizeof(std::int16_t));
      poses["nodes"] = nodes;
      poses["shifts"] = glb_.AddBufferView(bytes);
    }
    return poses;
  }

  // [frame][skin vertex][3] of normal_positions - positions in 16 bits, one scale for all.
  Json AddNormalOffsets() {
    float most = 0;
    const auto each = [&](auto&& f) {
      for (std::size_t k = 0; k < video_.positions.size(); ++k) {
        for (std::size_t v = 0; v < video_.positions[k].size(); ++v) {
          f(Vec3f(video_.normal_positions[k][v] - video_.positions[k][v]));
        }
      }
    };
    each([&](const Vec3f& d) { most = std::max(most, d.cwiseAbs().maxCoeff()); });
    most = std::max(most, 1e-9F);
    std::vector<std::int16_t> values;
    each([&](const Vec3f& d) {
      for (int a = 0; a < 3; ++a) {
        values.push_back(static_cast<std::int16_t>(std::lround(d[a] / most * 32767)));
      }
    });
    const std::string_view bytes(reinterpret_cast<const char*>(values.data()),
                                 values.size() * sizeof(std::int16_t));
    return {{"bufferView", glb_.AddBufferView(bytes)},
            {"scale", most / 32767},
            {"vertices", video_.positions[0].size()}};
  }

  const RelightableVideo& video_;
  const WriteVideoOptions& options_;
  GlbBuilder glb_;
  PosedSurface base_;
};

}  // namespace

void WriteVideo(const std::filesystem::path& path,
                const RelightableVideo& video,
                const WriteVideoOptions& options) {
  Check(video, options);
  WriteFile(path, VideoWriter(video, options).Write());
}

}  // namespace dyxel
