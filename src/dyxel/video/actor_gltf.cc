#include "dyxel/video/actor_gltf.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"

namespace dyxel {
namespace internal {
namespace {

constexpr int kMost = std::numeric_limits<int>::max();

Json Numbers(const Vec3d& x) { return {x.x(), x.y(), x.z()}; }

Vec3d ReadVector(const GlbFile& glb, const Json& object, const char* key) {
  const std::vector<double> v = glb.Numbers(object, key, 3);
  return {v[0], v[1], v[2]};
}

Json DofExtras(const Joint& joint) {
  Json dofs = Json::array();
  for (const Dof& dof : joint.dofs) {
    dofs.push_back(
        {{"name", dof.name}, {"axis", Numbers(dof.axis)}, {"min", dof.min}, {"max", dof.max}});
  }
  Json extras = {{"dofs", dofs}};
  for (const JointShare& share : joint.follows) {
    extras["follows"].push_back({{"joint", share.joint}, {"weight", share.weight}});
  }
  return extras;
}

}  // namespace

void CheckActor(const Actor& actor) {
  const std::size_t n = actor.skin.positions.size();
  Require(n > 0 && actor.joint_indices.size() == n && actor.joint_weights.size() == n,
          Fault::kUsage,
          "actor: {} skin vertices, {} joint indices and {} weights must be as many",
          n,
          actor.joint_indices.size(),
          actor.joint_weights.size());
  const auto joints = static_cast<int>(actor.skeleton.joints.size());
  Require(joints > 0 && joints < 65536, Fault::kUsage, "actor: {} joints", joints);
  for (int j = 0; j < joints; ++j) {
    const int parent = actor.skeleton.joints[static_cast<std::size_t>(j)].parent;
    Require(j == 0 ? parent == -1 : parent >= 0 && parent < j,
            Fault::kUsage,
            "actor: joint {} has the parent {}, which does not come before it",
            j,
            parent);
  }
  for (const std::array<int, 4>& indices : actor.joint_indices) {
    for (const int j : indices) {
      Require(j >= 0 && j < joints, Fault::kUsage, "actor: influence of joint {} of {}", j, joints);
    }
  }
}

int AddWorldNode(GlbBuilder& glb, const Vec3d& up) {
  const Quatd turn = Quatd::FromTwoVectors(up.normalized(), Vec3d::UnitY());
  Json& nodes = glb.root()["nodes"];
  nodes.push_back({{"name", "world"},
                   {"rotation", {turn.x(), turn.y(), turn.z(), turn.w()}},
                   {"children", Json::array()}});
  return static_cast<int>(nodes.size()) - 1;
}

SkeletonNodes AddSkeleton(GlbBuilder& glb, const Skeleton& skeleton, const Vec3d& up) {
  SkeletonNodes out;
  out.world = AddWorldNode(glb, up);
  Json& nodes = glb.root()["nodes"];
  const int first = static_cast<int>(nodes.size());
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const Joint& joint = skeleton.joints[j];
    const int node = first + static_cast<int>(j);
    out.joints.push_back(node);
    nodes.push_back({{"name", joint.name},
                     {"translation", Numbers(joint.offset)},
                     {"extras", DofExtras(joint)}});
    const int parent = joint.parent < 0 ? out.world : first + joint.parent;
    nodes[static_cast<std::size_t>(parent)]["children"].push_back(node);
  }
  std::vector<float> inverse_bind;
  for (const Vec3d& rest : skeleton.RestPositions()) {
    Mat4f m = Mat4f::Identity();
    m.block<3, 1>(0, 3) = -rest.cast<float>();
    inverse_bind.insert(inverse_bind.end(), m.data(), m.data() + 16);  // column major, as glTF
  }
  const int matrices = glb.AddFloats(inverse_bind, 16, GlbTarget::kNone);
  glb.root()["skins"].push_back(
      {{"inverseBindMatrices", matrices}, {"joints", out.joints}, {"skeleton", out.joints[0]}});
  out.skin = static_cast<int>(glb.root()["skins"].size()) - 1;
  return out;
}

void AddInfluences(GlbBuilder& glb,
                   const Actor& actor,
                   std::span<const int> vertices,
                   Json& attributes) {
  std::vector<std::uint16_t> joints;
  std::vector<float> weights;
  joints.reserve(4 * vertices.size());
  weights.reserve(4 * vertices.size());
  for (const int vertex : vertices) {
    const auto v = static_cast<std::size_t>(vertex);
    for (std::size_t k = 0; k < 4; ++k) {
      const float weight = actor.joint_weights[v][k];
      weights.push_back(weight);
      joints.push_back(weight != 0 ? static_cast<std::uint16_t>(actor.joint_indices[v][k])
                                   : std::uint16_t{0});
    }
  }
  attributes["JOINTS_0"] = glb.AddJoints(joints);
  attributes["WEIGHTS_0"] = glb.AddFloats(weights, 4, GlbTarget::kVertices);
}

Skeleton ReadSkeleton(const GlbFile& glb, int skin_index) {
  const Json& skin = glb.Element("skins", skin_index);
  const std::vector<double> nodes = glb.Numbers(skin, "joints", -1);
  if (nodes.empty()) glb.Fail("has a skin without joints");
  std::vector<int> joint_of(glb.Member(glb.root(), "nodes").size(), -1);
  Skeleton skeleton;
  for (std::size_t j = 0; j < nodes.size(); ++j) {
    if (!(nodes[j] >= 0 && nodes[j] < static_cast<double>(joint_of.size()))) {
      glb.Fail("has a joint that is no node");
    }
    const auto n = static_cast<std::size_t>(nodes[j]);
    if (joint_of[n] >= 0) glb.Fail("has a joint twice");
    joint_of[n] = static_cast<int>(j);
    const Json& node = glb.Element("nodes", static_cast<int>(n));
    Joint joint;
    joint.name = glb.Text(node, "name");
    joint.offset = ReadVector(glb, node, "translation");
    const Json& dofs = glb.Member(glb.Member(node, "extras"), "dofs");
    if (!dofs.is_array()) glb.Fail("has no list of dofs");
    for (const Json& dof : dofs) {
      joint.dofs.push_back({glb.Text(dof, "name"),
                            ReadVector(glb, dof, "axis"),
                            glb.Number(dof, "min"),
                            glb.Number(dof, "max")});
      const double length = joint.dofs.back().axis.norm();
      if (!(std::abs(length - 1) < 1e-3)) glb.Fail("has a hinge whose axis is no unit vector");
    }
    const Json& extras = glb.Member(node, "extras");
    if (extras.contains("follows")) {
      const Json& follows = glb.Member(extras, "follows");
      if (!follows.is_array() || !joint.dofs.empty()) glb.Fail("has a node that is no node");
      double sum = 0;
      for (const Json& share : follows) {
        joint.follows.push_back(
            {glb.Int(share, "joint", 0, static_cast<int>(j) - 1), glb.Number(share, "weight")});
        sum += joint.follows.back().weight;
      }
      if (!(std::abs(sum - 1) < 1e-4)) glb.Fail("has a node whose weights do not sum to 1");
    }
    skeleton.joints.push_back(std::move(joint));
  }
  // Parents: from the nodes' children; every joint but the first hangs under an earlier one.
  for (std::size_t n = 0; n < joint_of.size(); ++n) {
    if (joint_of[n] < 0) continue;
    const Json& node = glb.Element("nodes", static_cast<int>(n));
    if (!node.contains("children")) continue;
    for (const double child : glb.Numbers(node, "children", -1)) {
      if (!(child >= 0 && child < static_cast<double>(joint_of.size()))) {
        glb.Fail("has a child that is no node");
      }
      const int j = joint_of[static_cast<std::size_t>(child)];
      if (j < 0) continue;
      Joint& joint = skeleton.joints[static_cast<std::size_t>(j)];
      if (joint.parent >= 0 || joint_of[n] >= j) glb.Fail("has joints that form no tree in order");
      joint.parent = joint_of[n];
    }
  }
  for (std::size_t j = 1; j < skeleton.joints.size(); ++j) {
    if (skeleton.joints[j].parent < 0) glb.Fail("has a joint without a parent");
  }
  return skeleton;
}

Influences ReadInfluences(const GlbFile& glb,
                          const Json& attributes,
                          std::size_t count,
                          int joints) {
  const std::vector<int> j = glb.Integers(glb.Int(attributes, "JOINTS_0", 0, kMost), 4, joints - 1);
  const std::vector<float> w = glb.Floats(glb.Int(attributes, "WEIGHTS_0", 0, kMost), 4);
  if (j.size() != 4 * count || w.size() != 4 * count) {
    glb.Fail("has not as many influences as vertices");
  }
  Influences out;
  out.joints.resize(count);
  out.weights.resize(count);
  for (std::size_t i = 0; i < 4 * count; ++i) {
    out.joints[i / 4][i % 4] = j[i];
    out.weights[i / 4][i % 4] = w[i];
  }
  return out;
}

std::vector<float> Flatten(std::span<const Vec3f> vectors) {
  std::vector<float> out(3 * vectors.size());
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    for (std::size_t a = 0; a < 3; ++a) out[3 * i + a] = vectors[i][static_cast<int>(a)];
  }
  return out;
}

std::vector<Vec3f> Unflatten(std::span<const float> values) {
  std::vector<Vec3f> out(values.size() / 3);
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
  }
  return out;
}

std::vector<std::uint32_t> FlattenTriangles(std::span<const Triangle> triangles) {
  std::vector<std::uint32_t> out;
  out.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) {
    for (const int v : t) out.push_back(static_cast<std::uint32_t>(v));
  }
  return out;
}

std::vector<Triangle> ReadTriangles(const GlbFile& glb, int accessor, int vertices) {
  const std::vector<int> indices = glb.Integers(accessor, 1, vertices - 1);
  if (indices.empty() || indices.size() % 3 != 0) glb.Fail("has indices that form no triangles");
  std::vector<Triangle> out(indices.size() / 3);
  for (std::size_t i = 0; i < indices.size(); ++i) out[i / 3][i % 3] = indices[i];
  return out;
}

}  // namespace internal

void WriteActor(const std::filesystem::path& path, const Actor& actor) {
  using internal::AddInfluences;
  using internal::AddSkeleton;
  using internal::CheckActor;
  using internal::Flatten;
  using internal::FlattenTriangles;
  using internal::GlbBuilder;
  using internal::GlbTarget;
  using internal::Json;
  using internal::SkeletonNodes;
  CheckActor(actor);
  GlbBuilder glb;
  const std::vector<Vec3f>& positions = actor.skin.positions;
  Json attributes;
  attributes["POSITION"] = glb.AddFloats(Flatten(positions), 3, GlbTarget::kVertices, true);
  std::vector<Vec3f> normals = VertexNormals(positions, actor.skin.triangles);
  for (Vec3f& n : normals) {
    if (n.isZero(0.0F)) n = Vec3f::UnitZ();  // glTF asks for unit normals
  }
  attributes["NORMAL"] = glb.AddFloats(Flatten(normals), 3, GlbTarget::kVertices);
  std::vector<int> all(positions.size());
  std::iota(all.begin(), all.end(), 0);
  AddInfluences(glb, actor, all, attributes);
  const int indices = glb.AddIndices(FlattenTriangles(actor.skin.triangles), GlbTarget::kIndices);
  glb.root()["meshes"].push_back(
      {{"name", "skin"},
       {"primitives", Json::array({{{"attributes", attributes}, {"indices", indices}}})}});
  glb.root()["nodes"].push_back({{"name", "actor"}, {"mesh", 0}});
  const SkeletonNodes nodes = AddSkeleton(glb, actor.skeleton, Vec3d::UnitZ());
  glb.root()["nodes"][0]["skin"] = nodes.skin;
  glb.root()["scenes"].push_back({{"nodes", {0, nodes.world}}});
  glb.root()["scene"] = 0;
  WriteFile(path, glb.Finish("Dyxel", {{"dyxel", "actor"}}));
}

Actor ReadActor(const std::filesystem::path& path) {
  using internal::GlbFile;
  using internal::Influences;
  using internal::Json;
  constexpr int kMost = std::numeric_limits<int>::max();
  using internal::ReadInfluences;
  using internal::ReadSkeleton;
  using internal::ReadTriangles;
  using internal::Unflatten;
  const GlbFile glb(ReadFile(path), path);
  try {
    const Json& primitives = glb.Member(glb.Element("meshes", 0), "primitives");
    if (!primitives.is_array() || primitives.size() != 1) glb.Fail("has not one mesh of one part");
    const Json& primitive = primitives[0];
    const Json& attributes = glb.Member(primitive, "attributes");
    Actor actor;
    actor.skin.positions = Unflatten(glb.Floats(glb.Int(attributes, "POSITION", 0, kMost), 3));
    const std::size_t count = actor.skin.positions.size();
    actor.skin.triangles =
        ReadTriangles(glb, glb.Int(primitive, "indices", 0, kMost), static_cast<int>(count));
    actor.skeleton = ReadSkeleton(glb, 0);
    Influences influences =
        ReadInfluences(glb, attributes, count, static_cast<int>(actor.skeleton.joints.size()));
    actor.joint_indices = std::move(influences.joints);
    actor.joint_weights = std::move(influences.weights);
    return actor;
  } catch (const Json::exception& error) {
    glb.Fail(fmt::format("is damaged ({})", error.what()));
  }
}

}  // namespace dyxel
