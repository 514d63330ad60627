// glTF 2.0 binary files (.glb): building one, and reading one that may be damaged. Knows chunks,
// buffer views, accessors and images, and nothing of what they mean.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace dyxel::internal {

using Json = nlohmann::json;

enum class GlbTarget { kNone = 0, kVertices = 34962, kIndices = 34963 };

// Collects JSON and binary data. The same calls give the same bytes.
class GlbBuilder {
 public:
  // The root object; asset, buffers, bufferViews, accessors, images and textures are the builder's.
  [[nodiscard]] Json& root() { return root_; }

  // Indices of what was added. `stride` is the elements' spacing in bytes, 0 for packed.
  int AddBufferView(std::string_view bytes, GlbTarget target = GlbTarget::kNone, int stride = 0);
  // `width` floats an element: 1 SCALAR, 2 VEC2, 3 VEC3, 4 VEC4, 16 MAT4. `bounds`: with min and
  // max.
  int AddFloats(std::span<const float> values, int width, GlbTarget target, bool bounds = false);
  int AddIndices(std::span<const std::uint32_t> values, GlbTarget target);
  // (N × 4) joints, 8 bits each where all fit, else 16.
  int AddJoints(std::span<const std::uint16_t> values);
  // (N × 3) normalised bytes, each element padded to four.
  int AddNormalizedBytes(std::span<const std::int8_t> values, GlbTarget target);
  // A PNG file's bytes as an image; with `texture` the index is that of a texture of it.
  int AddPng(std::string_view png, const std::string& name, bool texture = false);

  // The whole file. Throws Error(kStage) beyond the 4 GB that a .glb can hold.
  [[nodiscard]] std::string Finish(const std::string& generator, const Json& extras);

 private:
  int AddAccessor(Json accessor);
  Json root_ = Json::object();
  std::string binary_;
};

// A parsed .glb. All member functions throw Error(kInput), naming the file, where what they are
// asked for is not there, has another type, or lies outside the file.
class GlbFile {
 public:
  GlbFile(std::string bytes, std::filesystem::path path);

  [[nodiscard]] const Json& root() const { return root_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  // Throws the error that the file is damaged: "FILE: WHAT. …".
  [[noreturn]] void Fail(const std::string& what) const;

  // Member `key` of an object.
  [[nodiscard]] const Json& Member(const Json& object, const char* key) const;
  // Element `index` of the root's array `key`.
  [[nodiscard]] const Json& Element(const char* key, int index) const;
  [[nodiscard]] int Int(const Json& object, const char* key, int low, int high) const;
  [[nodiscard]] int IntOr(const Json& object, const char* key, int low, int high, int value) const;
  [[nodiscard]] double Number(const Json& object, const char* key) const;  // finite
  [[nodiscard]] std::string Text(const Json& object, const char* key) const;
  // `count` finite numbers; any number of them for -1.
  [[nodiscard]] std::vector<double> Numbers(const Json& object, const char* key, int count) const;

  [[nodiscard]] std::string_view BufferView(int index) const;
  // An accessor of `width` components, converted to float (normalised integers to [-1, 1]); all
  // values must be finite. [count][width].
  [[nodiscard]] std::vector<float> Floats(int accessor, int width) const;
  // An accessor of unsigned integers of `width` components, all <= `largest`.
  [[nodiscard]] std::vector<int> Integers(int accessor, int width, int largest) const;
  // The PNG bytes of an image.
  [[nodiscard]] std::string_view Image(int index) const;

 private:
  struct View {
    std::size_t count, stride, component_size;
    int component_type, width;
    bool normalized;
    const char* data;
  };
  [[nodiscard]] View FindAccessor(int index, int width) const;

  std::string bytes_;
  std::filesystem::path path_;
  Json root_;
  std::string_view binary_;
};

}  // namespace dyxel::internal
