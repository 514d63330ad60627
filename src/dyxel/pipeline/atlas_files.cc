#include "dyxel/pipeline/atlas_files.h"

#include <algorithm>
#include <charconv>
#include <string_view>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/image/exr.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kMend = "Delete the atlas folder and run again";

void WriteObj(const fs::path& path,
              std::span<const Vec3f> positions,
              const Atlas& atlas,
              std::span<const Vec2f> uv) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "# Dyxel atlas: vt v=0 is the texture's bottom row, as OBJ has it\n");
  for (const Vec3f& x : positions)
    fmt::format_to(out, "v {:.9g} {:.9g} {:.9g}\n", x.x(), x.y(), x.z());
  for (const Vec2f& t : uv) {
    fmt::format_to(out, "vt {:.9g} {:.12g}\n", t.x(), 1.0 - static_cast<double>(t.y()));
  }
  for (const Triangle& t : atlas.triangles) {
    fmt::format_to(out, "f");
    for (const int c : t) {
      fmt::format_to(out, " {}/{}", atlas.skin_vertex[static_cast<std::size_t>(c)] + 1, c + 1);
    }
    fmt::format_to(out, "\n");
  }
  WriteFile(path, std::string_view(text.data(), text.size()));
}

struct Obj {
  std::size_t positions = 0;
  std::vector<Vec2f> uv;
  std::vector<Triangle> position_of, uv_of;
};

Obj ReadObj(const fs::path& path) {
  const std::string text = ReadFile(path);
  Obj obj;
  const char* at = text.data();
  const char* const end = at + text.size();
  const auto fail = [&] { throw FileError(path, "is damaged", std::string(kMend)); };
  const auto number = [&](auto& value) {
    while (at < end && (*at == ' ' || *at == '/')) ++at;
    const auto result = std::from_chars(at, end, value);
    if (result.ec != std::errc()) fail();
    at = result.ptr;
  };
  while (at < end) {
    const char* line_end = std::find(at, end, '\n');
    const std::string_view line(at, static_cast<std::size_t>(line_end - at));
    if (line.starts_with("v ")) {
      ++obj.positions;
    } else if (line.starts_with("vt ")) {
      at += 3;
      double u = 0;
      double v = 0;
      number(u);
      number(v);
      obj.uv.emplace_back(static_cast<float>(u), static_cast<float>(1.0 - v));
    } else if (line.starts_with("f ")) {
      at += 2;
      Triangle p{};
      Triangle t{};
      for (int k = 0; k < 3; ++k) {
        number(p[static_cast<std::size_t>(k)]);
        number(t[static_cast<std::size_t>(k)]);
      }
      for (std::size_t k = 0; k < 3; ++k) {
        if (--p[k] < 0 || --t[k] < 0) fail();
      }
      obj.position_of.push_back(p);
      obj.uv_of.push_back(t);
    }
    at = line_end == end ? end : line_end + 1;
  }
  if (obj.position_of.empty()) fail();
  return obj;
}

}  // namespace

std::vector<fs::path> AtlasFiles(const fs::path& folder, bool with_second) {
  std::vector<fs::path> files = {folder / "I.obj", folder / "texels.exr"};
  if (with_second) files.push_back(folder / "II.obj");
  return files;
}

void WriteAtlas(const fs::path& folder, std::span<const Vec3f> skin_positions, const Atlas& atlas) {
  WriteObj(folder / "I.obj", skin_positions, atlas, atlas.uv_i);
  const bool second = !atlas.uv_ii.empty();
  if (second) WriteObj(folder / "II.obj", skin_positions, atlas, atlas.uv_ii);

  const TexelGrid grid = MakeTexelGrid(atlas);
  const std::vector<Vec2f> in_second = second ? TexelsInSecond(atlas, grid) : std::vector<Vec2f>();
  ExrImage texels;
  texels.channels = {"triangle", "bary0", "bary1"};
  if (second) texels.channels.insert(texels.channels.end(), {"II.u", "II.v"});
  texels.image = ImageF(atlas.size, atlas.size, second ? 5 : 3, -1.0F);
  for (std::size_t k = 0; k < grid.count(); ++k) {
    float* to = &texels.image.At(grid.pixel[k] % atlas.size, grid.pixel[k] / atlas.size);
    to[0] = static_cast<float>(grid.triangle[k]);
    to[1] = grid.bary[k][0];
    to[2] = grid.bary[k][1];
    if (second) {
      to[3] = in_second[k].x();
      to[4] = in_second[k].y();
    }
  }
  WriteExr(folder / "texels.exr", texels.image, texels.channels, ExrType::kFloat);
}

Atlas ReadAtlas(const fs::path& folder) {
  const auto check = [&](bool ok, const char* file) {
    if (!ok)
      throw FileError(
          folder / file, "does not fit the other files of the atlas", std::string(kMend));
  };
  Obj first = ReadObj(folder / "I.obj");
  Atlas atlas;
  atlas.uv_i = std::move(first.uv);
  atlas.triangles = std::move(first.uv_of);
  atlas.skin_vertex.assign(atlas.uv_i.size(), -1);
  for (std::size_t f = 0; f < atlas.triangles.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      const int c = atlas.triangles[f][k];
      const int v = first.position_of[f][k];
      check(c < static_cast<int>(atlas.uv_i.size()) && v < static_cast<int>(first.positions),
            "I.obj");
      int& skin = atlas.skin_vertex[static_cast<std::size_t>(c)];
      check(skin == -1 || skin == v, "I.obj");
      skin = v;
    }
  }
  for (const int v : atlas.skin_vertex) check(v >= 0, "I.obj");
  if (fs::exists(folder / "II.obj")) {
    Obj second = ReadObj(folder / "II.obj");
    check(second.uv_of == atlas.triangles && second.uv.size() == atlas.uv_i.size(), "II.obj");
    atlas.uv_ii = std::move(second.uv);
  }
  atlas.size = ReadExrInfo(folder / "texels.exr").width;
  return atlas;
}

}  // namespace dyxel
