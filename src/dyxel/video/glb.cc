#include "dyxel/video/glb.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "dyxel/base/error.h"

namespace dyxel::internal {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF's numbers are little endian");

constexpr std::uint32_t kMagic = 0x46546C67;      // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
constexpr std::uint32_t kBinChunk = 0x004E4942;   // "BIN\0"

constexpr int kByte = 5120;
constexpr int kUnsignedByte = 5121;
constexpr int kShort = 5122;
constexpr int kUnsignedShort = 5123;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;

const char* TypeName(int width) {
  switch (width) {
    case 1:
      return "SCALAR";
    case 2:
      return "VEC2";
    case 3:
      return "VEC3";
    case 4:
      return "VEC4";
    default:
      return "MAT4";
  }
}

std::size_t ComponentSize(int type) {
  switch (type) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

template <class T>
std::string_view Bytes(std::span<const T> values) {
  return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

void AppendWord(std::string& out, std::uint32_t word) {
  out.append(reinterpret_cast<const char*>(&word), sizeof(word));
}

void PadTo4(std::string& out, char fill) {
  while (out.size() % 4 != 0) out.push_back(fill);
}

template <class T>
T Load(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return value;
}

}  // namespace

int GlbBuilder::AddBufferView(std::string_view bytes, GlbTarget target, int stride) {
  PadTo4(binary_, '\0');
  Json view = {{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", bytes.size()}};
  if (target != GlbTarget::kNone) view["target"] = static_cast<int>(target);
  if (stride > 0) view["byteStride"] = stride;
  binary_.append(bytes);
  root_["bufferViews"].push_back(std::move(view));
  return static_cast<int>(root_["bufferViews"].size()) - 1;
}

int GlbBuilder::AddAccessor(Json accessor) {
  root_["accessors"].push_back(std::move(accessor));
  return static_cast<int>(root_["accessors"].size()) - 1;
}

int GlbBuilder::AddFloats(std::span<const float> values, int width, GlbTarget target, bool bounds) {
  const auto w = static_cast<std::size_t>(width);
  Json accessor = {{"bufferView", AddBufferView(Bytes(values), target)},
                   {"componentType", kFloat},
                   {"count", values.size() / w},
                   {"type", TypeName(width)}};
  if (bounds && !values.empty()) {
    std::vector<float> low(values.begin(), values.begin() + width);
    std::vector<float> high = low;
    for (std::size_t i = 0; i < values.size(); ++i) {
      low[i % w] = std::min(low[i % w], values[i]);
      high[i % w] = std::max(high[i % w], values[i]);
    }
    accessor["min"] = low;
    accessor["max"] = high;
  }
  return AddAccessor(std::move(accessor));
}

int GlbBuilder::AddIndices(std::span<const std::uint32_t> values, GlbTarget target) {
  return AddAccessor({{"bufferView", AddBufferView(Bytes(values), target)},
                      {"componentType", kUnsignedInt},
                      {"count", values.size()},
                      {"type", "SCALAR"}});
}

int GlbBuilder::AddJoints(std::span<const std::uint16_t> values) {
  const bool narrow = std::ranges::all_of(values, [](std::uint16_t j) { return j < 256; });
  std::vector<std::uint8_t> bytes;
  if (narrow) {
    for (const std::uint16_t j : values) bytes.push_back(static_cast<std::uint8_t>(j));
  }
  const std::string_view data =
      narrow ? Bytes(std::span<const std::uint8_t>(bytes)) : Bytes(values);
  return AddAccessor({{"bufferView", AddBufferView(data, GlbTarget::kVertices)},
                      {"componentType", narrow ? kUnsignedByte : kUnsignedShort},
                      {"count", values.size() / 4},
                      {"type", "VEC4"}});
}

int GlbBuilder::AddNormalizedBytes(std::span<const std::int8_t> values, GlbTarget target) {
  std::vector<std::int8_t> padded(values.size() / 3 * 4, 0);
  for (std::size_t i = 0; i < values.size(); ++i) padded[i / 3 * 4 + i % 3] = values[i];
  const int view = AddBufferView(Bytes(std::span<const std::int8_t>(padded)), target, 4);
  return AddAccessor({{"bufferView", view},
                      {"componentType", kByte},
                      {"normalized", true},
                      {"count", values.size() / 3},
                      {"type", "VEC3"}});
}

int GlbBuilder::AddPng(std::string_view png, const std::string& name, bool texture) {
  const int view = AddBufferView(png);
  root_["images"].push_back({{"bufferView", view}, {"mimeType", "image/png"}, {"name", name}});
  const int image = static_cast<int>(root_["images"].size()) - 1;
  if (!texture) return image;
  if (!root_.contains("samplers")) {
    // Linear; no repeat: the atlas ends at its edges.
    root_["samplers"].push_back(
        {{"magFilter", 9729}, {"minFilter", 9987}, {"wrapS", 33071}, {"wrapT", 33071}});
  }
  root_["textures"].push_back({{"source", image}, {"sampler", 0}, {"name", name}});
  return static_cast<int>(root_["textures"].size()) - 1;
}

std::string GlbBuilder::Finish(const std::string& generator, const Json& extras) {
  root_["asset"] = {{"version", "2.0"}, {"generator", generator}};
  if (!extras.empty()) root_["asset"]["extras"] = extras;
  PadTo4(binary_, '\0');
  if (!binary_.empty()) root_["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
  // Names may hold anything: bytes that are no UTF-8 become U+FFFD.
  std::string json = root_.dump(-1, ' ', false, Json::error_handler_t::replace);
  PadTo4(json, ' ');
  const std::size_t total = 12 + 8 + json.size() + (binary_.empty() ? 0 : 8 + binary_.size());
  Require(total <= std::numeric_limits<std::uint32_t>::max(),
          Fault::kStage,
          "The relightable video would have {} bytes, and a .glb file can hold 4294967295. Choose "
          "fewer frames or a smaller atlas.",
          total);
  std::string out;
  out.reserve(total);
  AppendWord(out, kMagic);
  AppendWord(out, 2);
  AppendWord(out, static_cast<std::uint32_t>(total));
  AppendWord(out, static_cast<std::uint32_t>(json.size()));
  AppendWord(out, kJsonChunk);
  out += json;
  if (!binary_.empty()) {
    AppendWord(out, static_cast<std::uint32_t>(binary_.size()));
    AppendWord(out, kBinChunk);
    out += binary_;
  }
  return out;
}

GlbFile::GlbFile(std::string bytes, std::filesystem::path path)
    : bytes_(std::move(bytes)), path_(std::move(path)) {
  if (bytes_.size() < 20 || Load<std::uint32_t>(bytes_.data()) != kMagic) {
    Fail("is no binary glTF file");
  }
  if (Load<std::uint32_t>(bytes_.data() + 4) != 2) Fail("is not of glTF version 2");
  const std::size_t length = Load<std::uint32_t>(bytes_.data() + 8);
  if (length > bytes_.size()) {
    Fail(fmt::format("has {} bytes of the {} that it should have", bytes_.size(), length));
  }
  bool has_json = false;
  for (std::size_t at = 12; at + 8 <= length;) {
    const std::size_t size = Load<std::uint32_t>(bytes_.data() + at);
    const auto type = Load<std::uint32_t>(bytes_.data() + at + 4);
    at += 8;
    if (size > length - at) Fail("has a chunk that reaches beyond its end");
    const std::string_view chunk = std::string_view(bytes_).substr(at, size);
    if (type == kJsonChunk && !has_json) {
      root_ = Json::parse(chunk, nullptr, false);
      has_json = true;
    } else if (type == kBinChunk && binary_.empty()) {
      binary_ = chunk;
    }
    at += size;
  }
  if (!has_json || !root_.is_object()) Fail("holds no readable JSON");
}

void GlbFile::Fail(const std::string& what) const {
  throw FileError(path_, what, "Write it again with dyxel run, or copy it again");
}

const Json& GlbFile::Member(const Json& object, const char* key) const {
  if (!object.is_object()) Fail(fmt::format("has no object where '{}' should be", key));
  const auto found = object.find(key);
  if (found == object.end()) Fail(fmt::format("lacks '{}'", key));
  return *found;
}

const Json& GlbFile::Element(const char* key, int index) const {
  const Json& array = Member(root_, key);
  if (!array.is_array() || index < 0 || static_cast<std::size_t>(index) >= array.size()) {
    Fail(fmt::format("has no {}[{}]", key, index));
  }
  return array[static_cast<std::size_t>(index)];
}

int GlbFile::Int(const Json& object, const char* key, int low, int high) const {
  const Json& value = Member(object, key);
  if (!value.is_number()) Fail(fmt::format("has no number as '{}'", key));
  const double number = value.get<double>();
  if (!(number >= low && number <= high) || number != std::floor(number)) {
    Fail(fmt::format("has '{}' = {}, must be a whole number in [{}, {}]", key, number, low, high));
  }
  return static_cast<int>(number);
}

int GlbFile::IntOr(const Json& object, const char* key, int low, int high, int value) const {
  return object.is_object() && object.contains(key) ? Int(object, key, low, high) : value;
}

double GlbFile::Number(const Json& object, const char* key) const {
  const Json& value = Member(object, key);
  if (!value.is_number()) Fail(fmt::format("has no number as '{}'", key));
  const auto number = value.get<double>();
  if (!std::isfinite(number)) Fail(fmt::format("has '{}' = {}", key, number));
  return number;
}

std::string GlbFile::Text(const Json& object, const char* key) const {
  const Json& value = Member(object, key);
  if (!value.is_string()) Fail(fmt::format("has no text as '{}'", key));
  return value.get<std::string>();
}

std::vector<double> GlbFile::Numbers(const Json& object, const char* key, int count) const {
  const Json& value = Member(object, key);
  if (!value.is_array() || (count >= 0 && value.size() != static_cast<std::size_t>(count))) {
    Fail(fmt::format("has no list of {} numbers as '{}'", count, key));
  }
  std::vector<double> numbers;
  for (const Json& element : value) {
    if (!element.is_number() || !std::isfinite(element.get<double>())) {
      Fail(fmt::format("has something else than numbers in '{}'", key));
    }
    numbers.push_back(element.get<double>());
  }
  return numbers;
}

std::string_view GlbFile::BufferView(int index) const {
  const Json& view = Element("bufferViews", index);
  constexpr int kMost = std::numeric_limits<int>::max();
  (void)Int(view, "buffer", 0, 0);  // the binary chunk is the only buffer
  // Up to 4 GB: beyond an int.
  const double offset = view.contains("byteOffset") ? Number(view, "byteOffset") : 0.0;
  const double length = Number(view, "byteLength");
  if (!(offset >= 0 && length >= 0 && offset <= 2.0 * kMost && length <= 2.0 * kMost) ||
      static_cast<std::size_t>(offset) + static_cast<std::size_t>(length) > binary_.size()) {
    Fail(fmt::format("has bufferViews[{}] beyond its end", index));
  }
  return binary_.substr(static_cast<std::size_t>(offset), static_cast<std::size_t>(length));
}

GlbFile::View GlbFile::FindAccessor(int index, int width) const {
  const Json& accessor = Element("accessors", index);
  if (accessor.contains("sparse")) Fail("has a sparse accessor, which Dyxel never writes");
  View view = {};
  view.width = width;
  view.component_type = Int(accessor, "componentType", 0, 65535);
  view.component_size = ComponentSize(view.component_type);
  if (view.component_size == 0 || Text(accessor, "type") != TypeName(width)) {
    Fail(fmt::format("has accessors[{}] of another type than {}", index, TypeName(width)));
  }
  const Json* normalized = accessor.contains("normalized") ? &accessor["normalized"] : nullptr;
  view.normalized = normalized != nullptr && normalized->is_boolean() && normalized->get<bool>();
  constexpr int kMost = std::numeric_limits<int>::max();
  view.count = static_cast<std::size_t>(Int(accessor, "count", 0, kMost));
  const int buffer_view = Int(accessor, "bufferView", 0, kMost);
  const std::string_view bytes = BufferView(buffer_view);
  const std::size_t element = view.component_size * static_cast<std::size_t>(width);
  view.stride = static_cast<std::size_t>(IntOr(Element("bufferViews", buffer_view),
                                               "byteStride",
                                               static_cast<int>(element),
                                               252,
                                               static_cast<int>(element)));
  const auto offset = static_cast<std::size_t>(IntOr(accessor, "byteOffset", 0, kMost, 0));
  // All below 2^40: no overflow.
  if (view.count > 0 && offset + (view.count - 1) * view.stride + element > bytes.size()) {
    Fail(fmt::format("has accessors[{}] beyond its buffer view", index));
  }
  view.data = bytes.data() + (view.count > 0 ? offset : 0);
  return view;
}

std::vector<float> GlbFile::Floats(int accessor, int width) const {
  const View view = FindAccessor(accessor, width);
  const auto w = static_cast<std::size_t>(width);
  if (view.component_type != kFloat && !view.normalized) {
    Fail(fmt::format("has accessors[{}] of whole numbers", accessor));
  }
  std::vector<float> values(view.count * w);
  for (std::size_t i = 0; i < view.count; ++i) {
    for (std::size_t k = 0; k < w; ++k) {
      const char* at = view.data + i * view.stride + k * view.component_size;
      float value = 0;
      switch (view.component_type) {
        case kFloat:
          value = Load<float>(at);
          break;
        case kByte:
          value = std::max(-1.0F, static_cast<float>(Load<std::int8_t>(at)) / 127);
          break;
        case kUnsignedByte:
          value = static_cast<float>(Load<std::uint8_t>(at)) / 255;
          break;
        case kShort:
          value = std::max(-1.0F, static_cast<float>(Load<std::int16_t>(at)) / 32767);
          break;
        case kUnsignedShort:
          value = static_cast<float>(Load<std::uint16_t>(at)) / 65535;
          break;
        default:
          Fail(fmt::format("has accessors[{}] of a type without fractions", accessor));
      }
      if (!std::isfinite(value)) Fail(fmt::format("has accessors[{}] with no numbers", accessor));
      values[i * w + k] = value;
    }
  }
  return values;
}

std::vector<int> GlbFile::Integers(int accessor, int width, int largest) const {
  const View view = FindAccessor(accessor, width);
  const auto w = static_cast<std::size_t>(width);
  std::vector<int> values(view.count * w);
  for (std::size_t i = 0; i < view.count; ++i) {
    for (std::size_t k = 0; k < w; ++k) {
      const char* at = view.data + i * view.stride + k * view.component_size;
      std::uint32_t value = 0;
      switch (view.component_type) {
        case kUnsignedByte:
          value = Load<std::uint8_t>(at);
          break;
        case kUnsignedShort:
          value = Load<std::uint16_t>(at);
          break;
        case kUnsignedInt:
          value = Load<std::uint32_t>(at);
          break;
        default:
          Fail(fmt::format("has accessors[{}] that are no indices", accessor));
      }
      if (value > static_cast<std::uint32_t>(std::max(0, largest))) {
        Fail(fmt::format("has {} in accessors[{}], at most {} exist", value, accessor, largest));
      }
      values[i * w + k] = static_cast<int>(value);
    }
  }
  return values;
}

std::string_view GlbFile::Image(int index) const {
  const Json& image = Element("images", index);
  if (Text(image, "mimeType") != "image/png") Fail(fmt::format("has images[{}] not PNG", index));
  return BufferView(Int(image, "bufferView", 0, std::numeric_limits<int>::max()));
}

}  // namespace dyxel::internal
