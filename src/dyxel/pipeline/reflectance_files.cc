#include "dyxel/pipeline/reflectance_files.h"

#include <nlohmann/json.hpp>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/image/exr.h"
#include "dyxel/image/image_io.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

constexpr const char* kMend = "Delete the folder's files and run again";
const std::vector<std::string> kNormalChannels = {"X", "Y", "Z"};

std::vector<std::vector<float>> FromMap(const ImageF& map,
                                        const TexelGrid& grid,
                                        const fs::path& file) {
  if (map.width != grid.size || map.height != grid.size) {
    throw FileError(
        file,
        fmt::format(
            "has {}×{} texels, the atlas {}×{}", map.width, map.height, grid.size, grid.size),
        kMend);
  }
  std::vector<std::vector<float>> channels(static_cast<std::size_t>(map.channels),
                                           std::vector<float>(grid.count()));
  for (std::size_t k = 0; k < grid.count(); ++k) {
    for (std::size_t c = 0; c < channels.size(); ++c) {
      channels[c][k] = map.data[static_cast<std::size_t>(grid.pixel[k] * map.channels) + c];
    }
  }
  return channels;
}

std::vector<std::vector<float>> FromVectors(const std::vector<Vec3f>& v) {
  std::vector<std::vector<float>> channels(3, std::vector<float>(v.size()));
  for (std::size_t k = 0; k < v.size(); ++k) {
    for (int c = 0; c < 3; ++c) channels[static_cast<std::size_t>(c)][k] = v[k][c];
  }
  return channels;
}

std::vector<Vec3f> ToVectors(const std::vector<std::vector<float>>& channels) {
  std::vector<Vec3f> v(channels[0].size());
  for (std::size_t k = 0; k < v.size(); ++k) {
    const Vec3f n(channels[0][k], channels[1][k], channels[2][k]);
    v[k] = n.squaredNorm() > 0 ? Vec3f(n.normalized()) : Vec3f(0, 0, 1);
  }
  return v;
}

ImageU8 ToLabels(const TexelGrid& grid, const std::vector<float>& values) {
  const ImageF map = ToMap(grid, {values});
  ImageU8 labels(map.width, map.height, 1);
  for (std::size_t i = 0; i < map.data.size(); ++i) {
    labels.data[i] = static_cast<std::uint8_t>(std::lround(map.data[i]));
  }
  return labels;
}

std::vector<float> AsFloats(const auto& values) { return {values.begin(), values.end()}; }

struct Header {
  std::string model;
  std::vector<std::string> specular_names;
  std::vector<Material> materials;
};

Header ReadHeader(const fs::path& file) {
  const auto json = nlohmann::json::parse(ReadFile(file), nullptr, false);
  Header header;
  try {
    header.model = json.at("model").get<std::string>();
    for (const auto& entry : json.at("materials")) {
      Material m;
      m.name = entry.at("name").get<std::string>();
      m.specular = entry.at("specular").get<std::vector<float>>();
      const auto mean = entry.at("mean_diffuse").get<std::array<float, 3>>();
      m.mean_diffuse = Rgb(mean[0], mean[1], mean[2]);
      m.texels = entry.at("texels").get<int>();
      header.materials.push_back(std::move(m));
    }
  } catch (const nlohmann::json::exception& e) {
    throw FileError(file, fmt::format("can't be understood ({})", e.what()), kMend);
  }
  if (header.materials.empty()) throw FileError(file, "names no material", kMend);
  return header;
}

}  // namespace

ImageF ToMap(const TexelGrid& grid, const std::vector<std::vector<float>>& channels) {
  ImageF map(grid.size, grid.size, static_cast<int>(channels.size()));
  for (std::size_t k = 0; k < grid.count(); ++k) {
    for (std::size_t c = 0; c < channels.size(); ++c) {
      map.data[static_cast<std::size_t>(grid.pixel[k]) * channels.size() + c] = channels[c][k];
    }
  }
  FillGutters(grid, map);
  return map;
}

std::vector<fs::path> ReflectanceFiles(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const char* name : {"diffuse.exr",
                           "specular.exr",
                           "normal.exr",
                           "confidence.exr",
                           "material.png",
                           "filled.png",
                           "materials.json"}) {
    files.push_back(folder / name);
  }
  return files;
}

void WriteReflectance(const fs::path& folder, const TexelGrid& grid, const Reflectance& r) {
  WriteExr(folder / "diffuse.exr",
           ToMap(grid, {r.diffuse[0], r.diffuse[1], r.diffuse[2]}),
           {"R", "G", "B"});
  std::vector<std::string> names;
  for (std::size_t p = 0; p < r.specular.size(); ++p) names.push_back(fmt::format("p{}", p));
  WriteExr(folder / "specular.exr", ToMap(grid, r.specular), names);
  WriteExr(folder / "normal.exr", ToMap(grid, FromVectors(r.normal)), kNormalChannels);
  WriteExr(folder / "confidence.exr", ToMap(grid, {r.confidence}), {"Y"});
  WritePng(folder / "material.png", ToLabels(grid, AsFloats(r.material)));
  std::vector<float> filled = AsFloats(r.filled);
  for (float& f : filled) f *= 255;
  WritePng(folder / "filled.png", ToLabels(grid, filled));

  nlohmann::json json;
  json["model"] = r.model;
  json["materials"] = nlohmann::json::array();
  for (const Material& m : r.materials) {
    json["materials"].push_back(
        {{"name", m.name},
         {"specular", m.specular},
         {"mean_diffuse", {m.mean_diffuse[0], m.mean_diffuse[1], m.mean_diffuse[2]}},
         {"texels", m.texels}});
  }
  WriteFile(folder / "materials.json", json.dump(1) + "\n");
}

Reflectance ReadReflectance(const fs::path& folder, const TexelGrid& grid) {
  const Header header = ReadHeader(folder / "materials.json");
  Reflectance r;
  r.model = header.model;
  r.materials = header.materials;
  const auto diffuse =
      FromMap(ReadExr(folder / "diffuse.exr", {"R", "G", "B"}).image, grid, folder / "diffuse.exr");
  for (std::size_t c = 0; c < 3; ++c) r.diffuse[c] = diffuse[c];
  const ExrImage specular = ReadExr(folder / "specular.exr");
  r.specular = FromMap(specular.image, grid, folder / "specular.exr");
  if (r.specular.size() != header.materials[0].specular.size()) {
    throw FileError(folder / "specular.exr", "does not fit materials.json", kMend);
  }
  const auto normal =
      FromMap(ReadExr(folder / "normal.exr", kNormalChannels).image, grid, folder / "normal.exr");
  r.normal = ToVectors(normal);
  r.confidence =
      FromMap(ReadExr(folder / "confidence.exr").image, grid, folder / "confidence.exr")[0];
  const ImageU8 material = ReadPngMask(folder / "material.png");
  const ImageU8 filled = ReadPngMask(folder / "filled.png");
  for (const auto& [image, name] :
       {std::pair(&material, "material.png"), std::pair(&filled, "filled.png")}) {
    if (image->width != grid.size || image->height != grid.size || image->channels != 1) {
      throw FileError(folder / name, "is not one channel in the atlas' size", kMend);
    }
  }
  r.material.resize(grid.count());
  r.filled.resize(grid.count());
  for (std::size_t k = 0; k < grid.count(); ++k) {
    const auto at = static_cast<std::size_t>(grid.pixel[k]);
    r.material[k] = material.data[at];
    r.filled[k] = filled.data[at] > 127 ? 1 : 0;
    if (r.material[k] >= static_cast<int>(r.materials.size())) {
      throw FileError(
          folder / "material.png",
          fmt::format(
              "names material {}, materials.json has {}", r.material[k], r.materials.size()),
          "Use only labels that are there");
    }
  }
  return r;
}

MaterialMaps ReadMaterialMaps(const fs::path& folder) {
  Header header = ReadHeader(folder / "materials.json");
  MaterialMaps maps;
  maps.model = header.model;
  maps.materials = std::move(header.materials);
  maps.diffuse = ReadExr(folder / "diffuse.exr", {"R", "G", "B"}).image;
  maps.specular = ReadExr(folder / "specular.exr").image;
  maps.confidence = ReadExr(folder / "confidence.exr").image;
  maps.normal = ReadNormals(folder / "normal.exr");
  maps.material = ReadPngMask(folder / "material.png");
  return maps;
}

void WriteNormals(const fs::path& file,
                  const TexelGrid& grid,
                  const std::vector<Vec3f>& normals,
                  const std::vector<float>& confidence) {
  auto channels = FromVectors(normals);
  channels.push_back(confidence);
  WriteExr(file, ToMap(grid, channels), {"X", "Y", "Z", "confidence"});
}

ImageF ReadNormals(const fs::path& file) {
  const ImageF map = ReadExr(file, kNormalChannels).image;
  ImageF normals(map.width, map.height, 3);
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      Vec3f n(map.At(x, y, 0), map.At(x, y, 1), map.At(x, y, 2));
      n = n.squaredNorm() > 0 ? Vec3f(n.normalized()) : Vec3f(0, 0, 1);
      for (int c = 0; c < 3; ++c) normals.At(x, y, c) = n[c];
    }
  }
  return normals;
}

}  // namespace dyxel
