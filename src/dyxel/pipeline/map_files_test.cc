// Atlas and reflectance files: what is written comes back, what is damaged is named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/mesh/given_atlas.h"
#include "dyxel/mesh/test_meshes.h"
#include "dyxel/pipeline/atlas_files.h"
#include "dyxel/pipeline/reflectance_files.h"

namespace dyxel {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class MapFilesTest : public ::testing::Test {
 protected:
  MapFilesTest() : folder_(fs::path(::testing::TempDir()) / "dyxel_map_files_test") {
    fs::remove_all(folder_);
    const TriangleMesh mesh = MakeSphere(Vec3f(0, 0, 1), 0.5F, 8);
    positions_ = mesh.positions;
    atlas_ = MakeGivenAtlas(mesh.positions, mesh.triangles, {}, {.size = 64});
    grid_ = MakeTexelGrid(atlas_);
  }
  // What reading is refused with.
  template <class Read>
  static std::string Refusal(Read&& read) {
    try {
      read();
    } catch (const Error& error) {
      EXPECT_EQ(error.fault(), Fault::kInput);
      return error.what();
    }
    return "";
  }

  fs::path folder_;
  std::vector<Vec3f> positions_;
  Atlas atlas_;
  TexelGrid grid_;
};

TEST_F(MapFilesTest, AnAtlasComesBack) {
  atlas_.uv_ii = atlas_.uv_i;
  for (Vec2f& uv : atlas_.uv_ii) uv = Vec2f(uv.y(), 1 - uv.x());
  WriteAtlas(folder_, positions_, atlas_);
  for (const fs::path& file : AtlasFiles(folder_, true)) EXPECT_TRUE(fs::exists(file)) << file;
  const Atlas read = ReadAtlas(folder_);
  EXPECT_EQ(read.size, atlas_.size);
  EXPECT_EQ(read.triangles, atlas_.triangles);
  EXPECT_EQ(read.skin_vertex, atlas_.skin_vertex);
  ASSERT_EQ(read.uv_i.size(), atlas_.uv_i.size());
  for (std::size_t c = 0; c < read.uv_i.size(); ++c) {
    EXPECT_EQ(read.uv_i[c], atlas_.uv_i[c]);
    EXPECT_LT((read.uv_ii[c] - atlas_.uv_ii[c]).norm(), 1e-6F);
  }
}

TEST_F(MapFilesTest, ADamagedAtlasIsNamed) {
  WriteAtlas(folder_, positions_, atlas_);
  const std::string text = ReadFile(folder_ / "I.obj");
  WriteFile(folder_ / "I.obj", text + "f 1/1 2/2 99999/99999\n");
  EXPECT_THAT(Refusal([&] { (void)ReadAtlas(folder_); }), HasSubstr("I.obj"));
  WriteFile(folder_ / "I.obj", text + "f one two three\n");
  EXPECT_THAT(Refusal([&] { (void)ReadAtlas(folder_); }), HasSubstr("I.obj: is damaged"));
}

class ReflectanceFilesTest : public MapFilesTest {
 protected:
  ReflectanceFilesTest() {
    const std::size_t k = grid_.count();
    r_.model = "phong";
    r_.materials = {{"material0", {0.25F, 8}, Rgb(0.5F, 0.25F, 0.125F), 7},
                    {"material1", {0.5F, 16}, Rgb(0.1F, 0.2F, 0.3F), 3}};
    for (std::vector<float>& channel : r_.diffuse) channel.assign(k, 0.0F);
    r_.specular.assign(2, std::vector<float>(k));
    for (std::size_t i = 0; i < k; ++i) {
      const auto x = static_cast<float>(i % 64) / 64;  // exact in half floats
      r_.diffuse[0][i] = x;
      r_.diffuse[1][i] = 1 - x;
      r_.diffuse[2][i] = 0.5F;
      r_.specular[0][i] = x;
      r_.specular[1][i] = 16 * x;
      r_.material.push_back(static_cast<int>(i % 2));
      r_.normal.push_back(Vec3f(x, 0, 1).normalized());
      r_.confidence.push_back(x);
      r_.filled.push_back(i % 3 == 0 ? 1 : 0);
    }
    WriteReflectance(folder_, grid_, r_);
  }
  Reflectance r_;
};

TEST_F(ReflectanceFilesTest, ComeBack) {
  const Reflectance read = ReadReflectance(folder_, grid_);
  EXPECT_EQ(read.model, "phong");
  ASSERT_EQ(read.materials.size(), 2U);
  EXPECT_EQ(read.materials[1].name, "material1");
  EXPECT_EQ(read.materials[1].specular, r_.materials[1].specular);
  EXPECT_EQ(read.materials[1].texels, 3);
  EXPECT_EQ(read.diffuse, r_.diffuse);
  EXPECT_EQ(read.specular, r_.specular);
  EXPECT_EQ(read.material, r_.material);
  EXPECT_EQ(read.filled, r_.filled);
  EXPECT_EQ(read.confidence, r_.confidence);
  for (std::size_t i = 0; i < read.normal.size(); ++i) {
    ASSERT_LT((read.normal[i] - r_.normal[i]).norm(), 1e-3F);
  }
  const MaterialMaps maps = ReadMaterialMaps(folder_);
  EXPECT_EQ(maps.diffuse.width, 64);
  EXPECT_EQ(maps.specular.channels, 2);
}

TEST_F(ReflectanceFilesTest, ALabelOfNoMaterialIsNamed) {
  r_.material[0] = 5;
  WriteReflectance(folder_, grid_, r_);
  EXPECT_THAT(Refusal([&] { (void)ReadReflectance(folder_, grid_); }),
              AllOf(HasSubstr("material.png"), HasSubstr("names material 5")));
}

TEST_F(ReflectanceFilesTest, MapsOfAnotherAtlasAreNamed) {
  Atlas other = atlas_;
  other.size = 32;
  EXPECT_THAT(Refusal([&] { (void)ReadReflectance(folder_, MakeTexelGrid(other)); }),
              AllOf(HasSubstr("diffuse.exr"), HasSubstr("64×64 texels, the atlas 32×32")));
}

TEST_F(ReflectanceFilesTest, NormalsComeBack) {
  WriteNormals(folder_ / "key.exr", grid_, r_.normal, r_.confidence);
  const ImageF map = ReadNormals(folder_ / "key.exr");
  for (std::size_t i = 0; i < grid_.count(); ++i) {
    const Vec3f n =
        Eigen::Map<const Vec3f>(&map.data[3 * static_cast<std::size_t>(grid_.pixel[i])]);
    ASSERT_LT((n - r_.normal[i]).norm(), 1e-3F);
  }
}

}  // namespace
}  // namespace dyxel
