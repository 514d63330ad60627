// PLY in and out. Every count and index of a file is checked before it is used.
#include <charconv>
#include <cstring>
#include <string>
#include <string_view>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/mesh/triangle_mesh.h"

namespace dyxel {
namespace {

enum class Type { kI8, kU8, kI16, kU16, kI32, kU32, kF32, kF64 };

struct Property {
  std::string name;
  Type type = Type::kF32;
  bool is_list = false;
  Type count_type = Type::kU8;
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

std::size_t SizeOf(Type type) {
  switch (type) {
    case Type::kI8:
    case Type::kU8:
      return 1;
    case Type::kI16:
    case Type::kU16:
      return 2;
    case Type::kI32:
    case Type::kU32:
    case Type::kF32:
      return 4;
    case Type::kF64:
      return 8;
  }
  return 0;
}

template <class T>
double Load(const char* from) {
  T value;
  std::memcpy(&value, from, sizeof(T));
  return static_cast<double>(value);
}

class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path), bytes_(ReadFile(path)) {
    ReadHeader();
  }

  [[nodiscard]] const std::vector<Element>& elements() const { return elements_; }

  // Next number of the body.
  double Next(Type type) {
    if (ascii_) return NextAscii();
    const std::size_t size = SizeOf(type);
    if (bytes_.size() - at_ < size) throw Truncated();
    const char* from = bytes_.data() + at_;
    at_ += size;
    switch (type) {
      case Type::kI8:
        return Load<std::int8_t>(from);
      case Type::kU8:
        return Load<std::uint8_t>(from);
      case Type::kI16:
        return Load<std::int16_t>(from);
      case Type::kU16:
        return Load<std::uint16_t>(from);
      case Type::kI32:
        return Load<std::int32_t>(from);
      case Type::kU32:
        return Load<std::uint32_t>(from);
      case Type::kF32:
        return static_cast<double>(Load<float>(from));
      case Type::kF64:
        return Load<double>(from);
    }
    return 0;
  }

  // The length of a list, at most what the file can still hold.
  std::size_t NextCount(const Property& property) {
    const double count = Next(property.count_type);
    const double room = static_cast<double>(bytes_.size() - at_);
    if (!(count >= 0 && count <= room)) {
      throw Damaged(fmt::format("a list of {} items", count));
    }
    return static_cast<std::size_t>(count);
  }

  void Skip(const Property& property) {
    const std::size_t count = property.is_list ? NextCount(property) : 1;
    for (std::size_t i = 0; i < count; ++i) Next(property.type);
  }

  [[nodiscard]] Error Damaged(const std::string& what) const {
    return FileError(path_, "damaged PLY file: " + what, "Write the file again.");
  }

 private:
  [[nodiscard]] Error Truncated() const { return Damaged("it ends too early"); }

  double NextAscii() {
    while (at_ < bytes_.size() && std::isspace(static_cast<unsigned char>(bytes_[at_])) != 0) {
      ++at_;
    }
    if (at_ >= bytes_.size()) throw Truncated();
    double value = 0;
    const char* begin = bytes_.data() + at_;
    if (*begin == '+') ++begin;
    const auto parsed = std::from_chars(begin, bytes_.data() + bytes_.size(), value);
    if (parsed.ec != std::errc()) {
      throw Damaged(fmt::format("no number at byte {}", at_));
    }
    at_ = static_cast<std::size_t>(parsed.ptr - bytes_.data());
    return value;
  }

  std::string_view NextLine() {
    const std::size_t end = bytes_.find('\n', at_);
    if (end == std::string::npos) throw Damaged("its header does not end");
    std::string_view line(bytes_.data() + at_, end - at_);
    at_ = end + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    return line;
  }

  static std::vector<std::string_view> Words(std::string_view line) {
    std::vector<std::string_view> words;
    std::size_t at = 0;
    while (true) {
      const std::size_t begin = line.find_first_not_of(" \t", at);
      if (begin == std::string_view::npos) return words;
      const std::size_t end = std::min(line.find_first_of(" \t", begin), line.size());
      words.push_back(line.substr(begin, end - begin));
      at = end;
    }
  }

  [[nodiscard]] Type ParseType(std::string_view word) const {
    if (word == "char" || word == "int8") return Type::kI8;
    if (word == "uchar" || word == "uint8") return Type::kU8;
    if (word == "short" || word == "int16") return Type::kI16;
    if (word == "ushort" || word == "uint16") return Type::kU16;
    if (word == "int" || word == "int32") return Type::kI32;
    if (word == "uint" || word == "uint32") return Type::kU32;
    if (word == "float" || word == "float32") return Type::kF32;
    if (word == "double" || word == "float64") return Type::kF64;
    throw Damaged(fmt::format("unknown type '{}'", word));
  }

  void ReadHeader() {
    if (!bytes_.starts_with("ply")) {
      throw FileError(path_, "not a PLY file", "It must begin with 'ply'.");
    }
    NextLine();
    bool has_format = false;
    while (true) {
      const std::vector<std::string_view> words = Words(NextLine());
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") break;
      if (words[0] == "format" && words.size() >= 2) {
        has_format = true;
        ascii_ = words[1] == "ascii";
        if (!ascii_ && words[1] != "binary_little_endian") {
          throw FileError(path_,
                          fmt::format("PLY format '{}' is not read", words[1]),
                          "Write it as ascii or binary_little_endian.");
        }
      } else if (words[0] == "element" && words.size() == 3) {
        Element element;
        element.name = words[1];
        const auto parsed =
            std::from_chars(words[2].data(), words[2].data() + words[2].size(), element.count);
        if (parsed.ec != std::errc() || element.count > bytes_.size()) {
          throw Damaged(fmt::format("it claims {} elements '{}'", words[2], words[1]));
        }
        elements_.push_back(element);
      } else if (words[0] == "property" && !elements_.empty() && words.size() == 3) {
        elements_.back().properties.push_back(
            {std::string(words[2]), ParseType(words[1]), false, Type::kU8});
      } else if (words[0] == "property" && !elements_.empty() && words.size() == 5 &&
                 words[1] == "list") {
        elements_.back().properties.push_back(
            {std::string(words[4]), ParseType(words[3]), true, ParseType(words[2])});
      } else {
        throw Damaged(fmt::format("header line with '{}' not understood", words[0]));
      }
    }
    if (!has_format) throw Damaged("its header names no format");
  }

  std::filesystem::path path_;
  std::string bytes_;
  std::size_t at_ = 0;
  bool ascii_ = false;
  std::vector<Element> elements_;
};

void ReadFace(Reader& reader,
              const Element& element,
              std::size_t num_vertices,
              std::vector<Triangle>& triangles) {
  for (const Property& property : element.properties) {
    if (!property.is_list ||
        (property.name != "vertex_indices" && property.name != "vertex_index")) {
      reader.Skip(property);
      continue;
    }
    const std::size_t corners = reader.NextCount(property);
    Triangle fan = {0, 0, 0};
    for (std::size_t c = 0; c < corners; ++c) {
      const double index = reader.Next(property.type);
      if (!(index >= 0 && index < static_cast<double>(num_vertices))) {
        throw reader.Damaged(fmt::format("a face names vertex {} of {}", index, num_vertices));
      }
      const int v = static_cast<int>(index);
      if (c == 0) fan[0] = v;
      fan[1] = fan[2];
      fan[2] = v;
      if (c >= 2) triangles.push_back(fan);
    }
  }
}

}  // namespace

TriangleMesh ReadPly(const std::filesystem::path& path) {
  Reader reader(path);
  TriangleMesh mesh;
  bool has_vertices = false;
  for (const Element& element : reader.elements()) {
    if (element.name == "vertex") {
      has_vertices = true;
      int axes_found = 0;
      for (const Property& p : element.properties) {
        if (!p.is_list && (p.name == "x" || p.name == "y" || p.name == "z")) ++axes_found;
      }
      if (axes_found != 3) throw reader.Damaged("its vertices have no x, y, z");
      mesh.positions.assign(element.count, Vec3f::Zero());
      for (Vec3f& x : mesh.positions) {
        for (const Property& p : element.properties) {
          if (p.is_list || p.name.size() != 1 || p.name[0] < 'x' || p.name[0] > 'z') {
            reader.Skip(p);
          } else {
            x[p.name[0] - 'x'] = static_cast<float>(reader.Next(p.type));
          }
        }
        if (!x.allFinite()) throw reader.Damaged("a vertex is not finite");
      }
    } else if (element.name == "face") {
      for (std::size_t f = 0; f < element.count; ++f) {
        ReadFace(reader, element, mesh.positions.size(), mesh.triangles);
      }
    } else {
      for (std::size_t i = 0; i < element.count; ++i) {
        for (const Property& p : element.properties) reader.Skip(p);
      }
    }
  }
  if (!has_vertices) throw reader.Damaged("it has no vertices");
  return mesh;
}

std::vector<std::vector<float>> ReadPlyVertexProperties(const std::filesystem::path& path,
                                                        std::span<const std::string> names) {
  Reader reader(path);
  for (const Element& element : reader.elements()) {
    if (element.name != "vertex") {
      for (std::size_t i = 0; i < element.count; ++i) {
        for (const Property& p : element.properties) reader.Skip(p);
      }
      continue;
    }
    std::vector<int> column;  // of each property, or -1
    std::size_t found = 0;
    for (const Property& p : element.properties) {
      column.push_back(-1);
      for (std::size_t n = 0; n < names.size(); ++n) {
        if (!p.is_list && p.name == names[n]) {
          column.back() = static_cast<int>(n);
          ++found;
        }
      }
    }
    if (found != names.size()) return {};
    std::vector<std::vector<float>> values(names.size(), std::vector<float>(element.count));
    for (std::size_t v = 0; v < element.count; ++v) {
      for (std::size_t i = 0; i < column.size(); ++i) {
        const Property& p = element.properties[i];
        if (column[i] < 0) {
          reader.Skip(p);
        } else {
          values[static_cast<std::size_t>(column[i])][v] = static_cast<float>(reader.Next(p.type));
        }
      }
    }
    return values;
  }
  return {};
}

void WritePly(const std::filesystem::path& path, const TriangleMesh& mesh) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\n"
      "property float y\nproperty float z\nelement face {}\n"
      "property list uchar int vertex_indices\nend_header\n",
      mesh.positions.size(),
      mesh.triangles.size());
  std::size_t at = bytes.size();
  bytes.resize(at + mesh.positions.size() * 12 + mesh.triangles.size() * 13);
  for (const Vec3f& x : mesh.positions) {
    std::memcpy(bytes.data() + at, x.data(), 12);
    at += 12;
  }
  for (const Triangle& t : mesh.triangles) {
    bytes[at] = 3;
    std::memcpy(bytes.data() + at + 1, t.data(), 12);
    at += 13;
  }
  WriteFile(path, bytes);
}

}  // namespace dyxel
