#include <cmath>
#include <cstring>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/base/random.h"
#include "dyxel/body/nodes.h"
#include "dyxel/video/actor_gltf.h"
#include "dyxel/video/glb.h"
#include "dyxel/video/gltf_read.h"
#include "dyxel/video/gltf_write.h"
#include "dyxel/video/video_scene.h"

namespace dyxel {
namespace {

using internal::GlbFile;
using internal::Json;
using test_scene::MakeEgg;
using test_scene::MakeSurfaceEgg;

class GltfTest : public testing::Test {
 public:
  GltfTest()
      : folder_(std::filesystem::path(testing::TempDir()) /
                testing::UnitTest::GetInstance()->current_test_info()->name()) {
    std::filesystem::create_directories(folder_);
  }
  ~GltfTest() override { std::filesystem::remove_all(folder_); }

 protected:
  std::filesystem::path folder_;
};

void ExpectNear(const ImageF& a, const ImageF& b, float tolerance) {
  ASSERT_EQ(a.data.size(), b.data.size());
  ASSERT_EQ(a.channels, b.channels);
  float worst = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    worst = std::max(worst, std::abs(a.data[i] - b.data[i]));
  }
  EXPECT_LE(worst, tolerance);
}

void ExpectSameMaps(const RelightableVideo& a, const RelightableVideo& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.sequence, b.sequence);
  EXPECT_EQ(a.fps, b.fps);
  EXPECT_EQ(a.up, b.up);
  EXPECT_EQ(a.atlas.skin_vertex, b.atlas.skin_vertex);
  EXPECT_EQ(a.atlas.triangles, b.atlas.triangles);
  EXPECT_EQ(a.atlas.uv_i, b.atlas.uv_i);
  EXPECT_EQ(a.atlas.uv_ii, b.atlas.uv_ii);
  EXPECT_EQ(a.atlas.size, b.atlas.size);
  EXPECT_EQ(a.skin_triangles, b.skin_triangles);
  EXPECT_EQ(a.maps.model, b.maps.model);
  ASSERT_EQ(a.maps.materials.size(), b.maps.materials.size());
  for (std::size_t m = 0; m < a.maps.materials.size(); ++m) {
    EXPECT_EQ(a.maps.materials[m].name, b.maps.materials[m].name);
    EXPECT_EQ(a.maps.materials[m].specular, b.maps.materials[m].specular);
    EXPECT_TRUE((a.maps.materials[m].mean_diffuse == b.maps.materials[m].mean_diffuse).all());
    EXPECT_EQ(a.maps.materials[m].texels, b.maps.materials[m].texels);
  }
  EXPECT_EQ(a.maps.material.data, b.maps.material.data);
  ExpectNear(a.maps.diffuse, b.maps.diffuse, 1e-5F);
  ExpectNear(a.maps.confidence, b.maps.confidence, 0.5F / 255 + 1e-6F);
  ExpectNear(a.maps.normal, b.maps.normal, 1.5e-3F);
  ASSERT_EQ(a.normals.size(), b.normals.size());
  for (std::size_t k = 0; k < a.normals.size(); ++k) {
    EXPECT_EQ(a.normals[k].frame, b.normals[k].frame);
    ExpectNear(a.normals[k].normal, b.normals[k].normal, 1.5e-3F);
  }
}

TEST_F(GltfTest, SkinnedVideoRoundTrips) {
  const RelightableVideo video = MakeEgg(12, 20, 64);
  WriteVideo(folder_ / "v.glb", video);
  const RelightableVideo back = ReadVideo(folder_ / "v.glb");
  ExpectSameMaps(video, back);
  EXPECT_EQ(back.maps.specular.data, video.maps.specular.data);
  ASSERT_TRUE(back.actor.has_value());
  EXPECT_EQ(back.actor->skin.positions, video.actor->skin.positions);
  EXPECT_EQ(back.actor->skin.triangles, video.actor->skin.triangles);
  EXPECT_EQ(back.actor->joint_indices, video.actor->joint_indices);
  EXPECT_EQ(back.actor->joint_weights, video.actor->joint_weights);
  ASSERT_EQ(back.NumFrames(), 5);
  EXPECT_EQ(back.motion.confidence, video.motion.confidence);
  for (std::size_t f = 0; f < 5; ++f) {
    EXPECT_EQ(back.motion.poses[f].root_translation, video.motion.poses[f].root_translation);
    EXPECT_EQ(back.motion.poses[f].root_rotation.coeffs(),
              video.motion.poses[f].root_rotation.coeffs());
    EXPECT_EQ(back.motion.poses[f].angles, video.motion.poses[f].angles);
  }
  EXPECT_EQ(SkinPositionsAt(back, 2.5), SkinPositionsAt(video, 2.5));
}

TEST_F(GltfTest, GivenSurfacesRoundTrip) {
  const RelightableVideo video = MakeSurfaceEgg(12, 20, 64);
  WriteVideo(folder_ / "v.glb", video);
  const RelightableVideo back = ReadVideo(folder_ / "v.glb");
  ExpectSameMaps(video, back);
  EXPECT_FALSE(back.actor.has_value());
  ASSERT_EQ(back.NumFrames(), 5);
  for (std::size_t f = 0; f < 5; ++f) {
    for (std::size_t v = 0; v < video.positions[f].size(); ++v) {
      ASSERT_LT((back.positions[f][v] - video.positions[f][v]).norm(), 1e-6F);
      ASSERT_LT((back.normal_positions[f][v] - video.normal_positions[f][v]).norm(), 1e-5F);
    }
  }
}

TEST_F(GltfTest, SpecularTexelByTexelRoundTrips) {
  RelightableVideo video = MakeEgg(8, 12, 32);
  Random random(1);
  for (float& x : video.maps.specular.data) x *= 0.5F + random.Uniform();
  WriteVideo(folder_ / "v.glb", video);
  ExpectNear(ReadVideo(folder_ / "v.glb").maps.specular, video.maps.specular, 2e-5F);
}

TEST_F(GltfTest, MoreNormalBitsAreFiner) {
  const RelightableVideo video = MakeEgg(8, 12, 64);
  WriteVideo(folder_ / "v.glb", video, {.normal_bits = 16});
  ExpectNear(ReadVideo(folder_ / "v.glb").maps.normal, video.maps.normal, 3e-5F);
  WriteVideo(folder_ / "v.glb", video, {.normal_bits = 8});
  ExpectNear(ReadVideo(folder_ / "v.glb").maps.normal, video.maps.normal, 6e-3F);
}

TEST_F(GltfTest, SameVideoSameBytes) {
  const RelightableVideo video = MakeEgg(8, 12, 32);
  WriteVideo(folder_ / "a.glb", video);
  WriteVideo(folder_ / "b.glb", video);
  EXPECT_EQ(ReadFile(folder_ / "a.glb"), ReadFile(folder_ / "b.glb"));
}

// Plays the file as glTF says: the node hierarchy with the animation's values of a frame, the
// skin's inverse bind matrices, blended by the weights. Independent of Skeleton and SkinPositions.
std::vector<Vec3f> PlayGltf(const GlbFile& glb, std::size_t frame) {
  const Json& root = glb.root();
  const std::size_t n = root["nodes"].size();
  std::vector<Eigen::Vector3f> translation(n, Eigen::Vector3f::Zero());
  std::vector<Quatf> rotation(n, Quatf::Identity());
  std::vector<int> parent(n, -1);
  for (std::size_t i = 0; i < n; ++i) {
    const Json& node = root["nodes"][i];
    if (node.contains("translation")) {
      for (int a = 0; a < 3; ++a)
        translation[i][a] = node["translation"][static_cast<std::size_t>(a)];
    }
    if (node.contains("rotation")) {
      const auto q = node["rotation"].get<std::vector<float>>();
      rotation[i] = Quatf(q[3], q[0], q[1], q[2]);
    }
    if (node.contains("children")) {
      for (const std::size_t c : node["children"]) parent[c] = static_cast<int>(i);
    }
  }
  const Json& animation = root["animations"][0];
  for (const Json& channel : animation["channels"]) {
    const Json& sampler = animation["samplers"][channel["sampler"].get<std::size_t>()];
    const std::size_t node = channel["target"]["node"];
    if (channel["target"]["path"] == "rotation") {
      const std::vector<float> q = glb.Floats(sampler["output"], 4);
      rotation[node] = Quatf(q[4 * frame + 3], q[4 * frame], q[4 * frame + 1], q[4 * frame + 2]);
    } else {
      const std::vector<float> t = glb.Floats(sampler["output"], 3);
      translation[node] = {t[3 * frame], t[3 * frame + 1], t[3 * frame + 2]};
    }
  }
  const auto global = [&](std::size_t node) {
    Mat4f m = Mat4f::Identity();
    for (int i = static_cast<int>(node); i >= 0; i = parent[static_cast<std::size_t>(i)]) {
      Mat4f local = Mat4f::Identity();
      local.topLeftCorner<3, 3>() = rotation[static_cast<std::size_t>(i)].toRotationMatrix();
      local.block<3, 1>(0, 3) = translation[static_cast<std::size_t>(i)];
      m = local * m;
    }
    return m;
  };
  const Json& skin = root["skins"][0];
  const std::vector<float> inverse = glb.Floats(skin["inverseBindMatrices"], 16);
  std::vector<Mat4f> matrices;
  for (std::size_t j = 0; j < skin["joints"].size(); ++j) {
    matrices.push_back(global(skin["joints"][j]) * Eigen::Map<const Mat4f>(&inverse[16 * j]));
  }
  const Json& attributes = root["meshes"][0]["primitives"][0]["attributes"];
  const std::vector<float> x = glb.Floats(attributes["POSITION"], 3);
  const std::vector<int> j = glb.Integers(attributes["JOINTS_0"], 4, 255);
  const std::vector<float> w = glb.Floats(attributes["WEIGHTS_0"], 4);
  std::vector<Vec3f> out;
  for (std::size_t v = 0; v < x.size() / 3; ++v) {
    Vec4f sum = Vec4f::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      sum += w[4 * v + k] * (matrices[static_cast<std::size_t>(j[4 * v + k])] *
                             Vec4f(x[3 * v], x[3 * v + 1], x[3 * v + 2], 1));
    }
    out.emplace_back(sum.head<3>());
  }
  return out;
}

TEST_F(GltfTest, AnyViewerPlaysTheMotionWithYUp) {
  const RelightableVideo video = MakeEgg(12, 20, 32);
  WriteVideo(folder_ / "v.glb", video);
  const GlbFile glb(ReadFile(folder_ / "v.glb"), "v.glb");
  for (const std::size_t frame : {0U, 3U}) {
    const std::vector<Vec3f> played = PlayGltf(glb, frame);
    const std::vector<Vec3f> skin = SkinPositionsAt(video, static_cast<double>(frame));
    for (std::size_t c = 0; c < played.size(); ++c) {
      const Vec3f& x = skin[static_cast<std::size_t>(video.atlas.skin_vertex[c])];
      ASSERT_LT((played[c] - Vec3f(x.x(), x.z(), -x.y())).norm(), 1e-5F) << frame << " " << c;
    }
  }
}

TEST_F(GltfTest, NodesRoundTripAndPlayInAnyViewer) {
  RelightableVideo video = MakeEgg(12, 20, 32);
  video.actor = WithNodes(*video.actor, 0.2);
  const int nodes = video.actor->skeleton.NumNodes();
  ASSERT_GT(nodes, 3);
  Random random(11);
  const auto units = [&] { return kShiftUnit * std::round(3000 * random.Normal()); };
  for (Pose& pose : video.motion.poses) {
    for (int k = 0; k < nodes; ++k) pose.shifts.emplace_back(units(), units(), units());
  }
  WriteVideo(folder_ / "v.glb", video);
  const RelightableVideo back = ReadVideo(folder_ / "v.glb");
  ASSERT_EQ(back.motion.poses.size(), video.motion.poses.size());
  for (std::size_t f = 0; f < video.motion.poses.size(); ++f) {
    EXPECT_EQ(back.motion.poses[f].shifts, video.motion.poses[f].shifts);
  }
  EXPECT_EQ(SkinPositionsAt(back, 2.5), SkinPositionsAt(video, 2.5));
  const GlbFile glb(ReadFile(folder_ / "v.glb"), "v.glb");
  const std::vector<Vec3f> played = PlayGltf(glb, 3);
  const std::vector<Vec3f> skin = SkinPositionsAt(video, 3);
  for (std::size_t c = 0; c < played.size(); ++c) {
    const Vec3f& x = skin[static_cast<std::size_t>(video.atlas.skin_vertex[c])];
    ASSERT_LT((played[c] - Vec3f(x.x(), x.z(), -x.y())).norm(), 2e-5F) << c;
  }
}

TEST_F(GltfTest, ActorRoundTripsExactly) {
  const Actor actor = *MakeEgg(12, 20, 8).actor;
  WriteActor(folder_ / "actor.glb", actor);
  const Actor back = ReadActor(folder_ / "actor.glb");
  EXPECT_EQ(back.skin.positions, actor.skin.positions);
  EXPECT_EQ(back.skin.triangles, actor.skin.triangles);
  EXPECT_EQ(back.joint_indices, actor.joint_indices);
  EXPECT_EQ(back.joint_weights, actor.joint_weights);
  ASSERT_EQ(back.skeleton.joints.size(), actor.skeleton.joints.size());
  for (std::size_t j = 0; j < 2; ++j) {
    const Joint& a = actor.skeleton.joints[j];
    const Joint& b = back.skeleton.joints[j];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.parent, b.parent);
    EXPECT_EQ(a.offset, b.offset);
    ASSERT_EQ(a.dofs.size(), b.dofs.size());
    for (std::size_t d = 0; d < a.dofs.size(); ++d) {
      EXPECT_EQ(a.dofs[d].name, b.dofs[d].name);
      EXPECT_EQ(a.dofs[d].axis, b.dofs[d].axis);
      EXPECT_EQ(a.dofs[d].min, b.dofs[d].min);
      EXPECT_EQ(a.dofs[d].max, b.dofs[d].max);
    }
  }
  WriteActor(folder_ / "again.glb", back);
  EXPECT_EQ(ReadFile(folder_ / "actor.glb"), ReadFile(folder_ / "again.glb"));
}

TEST_F(GltfTest, OtherFilesAreRefusedByName) {
  const auto message = [&](const std::string& bytes) -> std::string {
    WriteFile(folder_ / "x.glb", bytes);
    try {
      (void)ReadVideo(folder_ / "x.glb");
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::kInput);
      return error.what();
    }
    return "read";
  };
  EXPECT_THAT(message(""), testing::HasSubstr("x.glb"));
  EXPECT_THAT(message("this is some text, not a binary glTF file"),
              testing::HasSubstr("no binary glTF"));
  WriteActor(folder_ / "actor.glb", *MakeEgg(6, 8, 8).actor);
  EXPECT_THAT(message(ReadFile(folder_ / "actor.glb")),
              testing::HasSubstr("without DYXEL_relightable_video"));
  EXPECT_THROW((void)ReadVideo(folder_ / "absent.glb"), Error);
}

// Reads, counts what was refused; anything but success or Error(kInput) fails the test or crashes.
bool Refused(const std::filesystem::path& path) {
  try {
    (void)ReadVideo(path);
    return false;
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), Fault::kInput) << error.what();
    return true;
  }
}

TEST_F(GltfTest, DamagedFilesAreRefusedAndNeverCrash) {
  RelightableVideo skinned = MakeEgg(5, 6, 8);
  Random random(7);
  for (float& x : skinned.maps.specular.data) x *= 0.5F + random.Uniform();
  const std::filesystem::path path = folder_ / "x.glb";
  for (const RelightableVideo& video : {skinned, MakeSurfaceEgg(5, 6, 8)}) {
    WriteVideo(path, video);
    const std::string whole = ReadFile(path);
    std::uint32_t json_size = 0;
    std::memcpy(&json_size, whole.data() + 12, 4);
    for (int i = 0; i < 60; ++i) {
      WriteFile(path, whole.substr(0, random.Below(static_cast<std::uint32_t>(whole.size()))));
      EXPECT_TRUE(Refused(path));
    }
    int refused = 0;
    for (int i = 0; i < 800; ++i) {
      std::string bytes = whole;
      const bool in_json = i % 4 != 0;
      const int changes = 1 + static_cast<int>(random.Below(3));
      for (int k = 0; k < changes; ++k) {
        const std::size_t at = in_json ? 20 + random.Below(json_size)
                                       : random.Below(static_cast<std::uint32_t>(bytes.size()));
        // Digits for digits keep the JSON readable and its meaning wrong.
        const bool digit = bytes[at] >= '0' && bytes[at] <= '9';
        bytes[at] = digit ? static_cast<char>('0' + random.Below(10))
                          : static_cast<char>(random.Below(256));
      }
      WriteFile(path, bytes);
      refused += Refused(path) ? 1 : 0;
    }
    EXPECT_GT(refused, 200);
  }
}

TEST_F(GltfTest, WrongReferencesAreRefused) {
  WriteVideo(folder_ / "v.glb", MakeEgg(5, 6, 8));
  const std::string whole = ReadFile(folder_ / "v.glb");
  std::uint32_t json_size = 0;
  std::memcpy(&json_size, whole.data() + 12, 4);
  const Json original = Json::parse(whole.substr(20, json_size));
  const std::string binary = whole.substr(20 + json_size);
  const auto refused = [&](const std::function<void(Json&)>& change) {
    Json json = original;
    change(json);
    std::string text = json.dump();
    while (text.size() % 4 != 0) text += ' ';
    std::string bytes = whole.substr(0, 8);
    const auto word = [&](std::size_t x) {
      const auto w = static_cast<std::uint32_t>(x);
      bytes.append(reinterpret_cast<const char*>(&w), 4);
    };
    word(20 + text.size() + binary.size());
    word(text.size());
    bytes += whole.substr(16, 4) + text + binary;
    WriteFile(folder_ / "x.glb", bytes);
    return Refused(folder_ / "x.glb");
  };
  const auto extension = [](Json& j) -> Json& {
    return j["extensions"]["DYXEL_relightable_video"];
  };
  EXPECT_FALSE(refused([](Json&) {}));
  EXPECT_TRUE(refused([&](Json& j) { extension(j)["version"] = 2; }));
  EXPECT_TRUE(refused([&](Json& j) { extension(j)["atlasSize"] = 1 << 30; }));
  EXPECT_TRUE(refused([&](Json& j) { extension(j)["atlasSize"] = 16; }));
  EXPECT_TRUE(refused([&](Json& j) { extension(j)["frames"] = 6; }));
  EXPECT_TRUE(refused([&](Json& j) { extension(j)["model"] = "velvet"; }));
  EXPECT_TRUE(refused([&](Json& j) { extension(j)["skinVertex"] = 0; }));
  EXPECT_TRUE(refused([&](Json& j) { extension(j)["parameters"]["diffuse"]["image"] = 999; }));
  EXPECT_TRUE(refused([&](Json& j) { extension(j)["normalKeys"][1]["frame"] = -1; }));
  EXPECT_TRUE(refused([&](Json& j) { extension(j)["materials"].erase(1); }));
  EXPECT_TRUE(refused([](Json& j) { j["bufferViews"][0]["byteLength"] = 4e9; }));
  EXPECT_TRUE(refused([](Json& j) { j["bufferViews"][0]["byteOffset"] = -4; }));
  EXPECT_TRUE(refused([](Json& j) { j["accessors"][0]["count"] = 2147483647; }));
  EXPECT_TRUE(refused([](Json& j) { j["skins"][0]["joints"][1] = 0; }));
  EXPECT_TRUE(refused([](Json& j) { j["nodes"] = 3; }));
  EXPECT_TRUE(refused([](Json& j) { j["meshes"] = Json::array(); }));
}

TEST_F(GltfTest, PartsThatDisagreeAreNotWritten) {
  RelightableVideo video = MakeEgg(5, 6, 8);
  video.maps.material.data[3] = 2;
  EXPECT_THROW(WriteVideo(folder_ / "x.glb", video), Error);
  video = MakeEgg(5, 6, 8);
  video.motion.poses[1].angles.pop_back();
  EXPECT_THROW(WriteVideo(folder_ / "x.glb", video), Error);
  video = MakeEgg(5, 6, 8);
  video.normals[0].normal = ImageF(4, 4, 3);
  EXPECT_THROW(WriteVideo(folder_ / "x.glb", video), Error);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x.glb"));
}

}  // namespace
}  // namespace dyxel
