#include "dyxel/capture/manifest.h"

#include <algorithm>
#include <map>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/capture/manifest_fields.h"
#include "dyxel/image/image_io.h"

namespace dyxel {
namespace internal {

std::string Describe(const Json& value) {
  // Never dump(): it recurses, and a hostile list may be nested a million deep.
  if (value.is_object()) return "an object";
  if (value.is_array()) return fmt::format("a list of {}", value.size());
  if (value.is_null()) return "null";
  if (value.is_string()) return "\"" + value.get<std::string>().substr(0, 60) + "\"";
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::string Nearest(const std::string& name, const std::vector<std::string>& known) {
  if (name.size() > 100) return "";
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, name.size() / 3) + 1;
  for (const std::string& other : known) {
    // Levenshtein's distance, one row at a time.
    std::vector<std::size_t> row(other.size() + 1);
    for (std::size_t j = 0; j < row.size(); ++j) row[j] = j;
    for (std::size_t i = 0; i < name.size(); ++i) {
      std::size_t diagonal = row[0];
      row[0] = i + 1;
      for (std::size_t j = 0; j < other.size(); ++j) {
        const std::size_t substitute = diagonal + (name[i] == other[j] ? 0 : 1);
        diagonal = row[j + 1];
        row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, substitute});
      }
    }
    // A short name that shares nothing is not near.
    if (row.back() < best_distance && row.back() < std::max(name.size(), other.size())) {
      best_distance = row.back();
      best = other;
    }
  }
  return best;
}

}  // namespace internal

namespace {

using internal::Describe;
using internal::Fields;
using internal::Json;
using internal::Nearest;

constexpr double kFar = 1e6;      // metres or pixels: beyond is a mistake
constexpr double kBright = 1e12;  // radiance units

Vec3d ToVector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }
Rgb ToRgb(const std::array<double, 3>& v) { return ToVector(v).cast<float>(); }

void CheckName(Fields& fields, const std::string& name, std::map<std::string, int>& seen) {
  if (name.empty() || name == "." || name == ".." ||
      name.find_first_of(std::string("/\\{}\0", 5)) != std::string::npos) {
    fields.Fail(fmt::format("{} can't be a name (it becomes part of file names)",
                            fields.Place("name") + " = \"" + name + "\""),
                "Use letters, digits, _ and -");
  }
  if (++seen[name] == 2) {
    fields.Fail(fmt::format("the name \"{}\" is given twice", name), "Give each its own name");
  }
}

void ReadCamera(Fields& fields, Camera& camera) {
  fields.Integer("width", camera.width, 1, 65536, true);
  fields.Integer("height", camera.height, 1, 65536, true);
  fields.Number("fx", camera.fx, 1e-3, kFar, true);
  fields.Number("fy", camera.fy, 1e-3, kFar, true);
  fields.Number("cx", camera.cx, -kFar, kFar, true);
  fields.Number("cy", camera.cy, -kFar, kFar, true);
  fields.Numbers("distortion", camera.distortion, -1e3, 1e3);
  fields.Flag("holdout", camera.holdout);
  std::array<double, 3> translation{};
  if (fields.Numbers("translation", translation, -kFar, kFar, true)) {
    camera.cam_from_world.translation = ToVector(translation);
  }
  std::array<double, 9> numbers{};
  using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  if (fields.Numbers("rotation", numbers, -2, 2, true)) {
    const Mat3d rotation = Eigen::Map<const RowMajor>(numbers.data());
    const double error = (rotation * rotation.transpose() - Mat3d::Identity()).norm();
    if (error > 1e-3) {
      fields.Fail(fmt::format("{} is no rotation: R·Rᵀ is {:.3g} away from the identity",
                              fields.Place("rotation"),
                              error),
                  "Write the nine numbers row by row, rows of length 1 at right angles");
    } else if (rotation.determinant() < 0) {
      fields.Fail(fmt::format("{} mirrors: its determinant is -1", fields.Place("rotation")),
                  "Use x right, y down, z forward, all right-handed: turn one axis round");
    } else {
      // Rounded numbers are made a rotation again; exact ones stay what they are.
      camera.cam_from_world.rotation =
          error > 1e-9 ? Quatd(rotation).normalized().toRotationMatrix() : rotation;
    }
  }
  if (fields.Numbers("color_matrix", numbers, -1e3, 1e3)) {
    camera.color_matrix = Eigen::Map<const RowMajor>(numbers.data());
    if (std::abs(camera.color_matrix.determinant()) < 1e-6) {
      fields.Fail(fields.Place("color_matrix") + " can't be inverted",
                  "Write the 3x3 matrix from camera RGB to BT.709, row by row");
    }
  }
}

void ReadDirection(Fields& fields, Vec3d& direction) {
  std::array<double, 3> numbers{};
  if (!fields.Numbers("direction", numbers, -kFar, kFar, true)) return;
  const double length = ToVector(numbers).norm();
  if (length < 1e-9) {
    fields.Fail(fields.Place("direction") + " has no length", "Write the way the light travels");
  } else {
    direction = ToVector(numbers) / length;
  }
}

void ReadLight(Fields& fields, Light& light) {
  std::string type;
  if (!fields.Text("type", type, true)) return;
  std::array<double, 3> numbers{};
  const bool spot = type == "spot";
  if (spot || type == "point") {
    light.type = spot ? LightType::kSpot : LightType::kPoint;
    if (fields.Numbers("position", numbers, -kFar, kFar, true)) light.position = ToVector(numbers);
    if (fields.Numbers("intensity", numbers, 0, kBright, true)) light.intensity = ToRgb(numbers);
    if (spot) {
      ReadDirection(fields, light.direction);
      fields.Number("cone_inner", light.cone_inner, 0, kPiD, true);
      if (fields.Number("cone_outer", light.cone_outer, 0, kPiD, true) &&
          light.cone_inner > light.cone_outer) {
        fields.Fail(fmt::format("{} = {} is wider than cone_outer = {}",
                                fields.Place("cone_inner"),
                                light.cone_inner,
                                light.cone_outer),
                    "Both are half-angles in radians, the inner one smaller");
      }
    }
  } else if (type == "directional") {
    light.type = LightType::kDirectional;
    ReadDirection(fields, light.direction);
    if (fields.Numbers("irradiance", numbers, 0, kBright, true)) light.irradiance = ToRgb(numbers);
  } else {
    fields.Fail(fmt::format("{} is \"{}\"", fields.Place("type"), type),
                "Write spot, point or directional");
    // Its other keys can't be judged.
    for (const char* key :
         {"position", "direction", "intensity", "irradiance", "cone_inner", "cone_outer"}) {
      (void)fields.Find(key);
    }
    return;
  }
  // Keys of other types of light do no harm.
  for (const char* key : {"position", "direction"}) (void)fields.Find(key);
  const Rgb& power = light.type == LightType::kDirectional ? light.irradiance : light.intensity;
  if (!(power.maxCoeff() > 0)) {
    fields.Warn(fmt::format("the light \"{}\" is black", light.name),
                "Give its measured strength, or leave it out");
  }
}

// The pattern's fields in braces: {camera}, {frame} and {frame:0N}, and no others.
void CheckPattern(Fields& fields,
                  const std::string& key,
                  const std::string& pattern,
                  bool cameras) {
  bool has_camera = false;
  for (std::size_t open = pattern.find('{'); open != std::string::npos;
       open = pattern.find('{', open + 1)) {
    const std::size_t close = pattern.find('}', open);
    const std::string field =
        close == std::string::npos ? "" : pattern.substr(open + 1, close - open - 1);
    bool good = field == "camera" || field == "frame";
    if (field.rfind("frame:0", 0) == 0) {
      good = field.size() == 8 && field[7] >= '1' && field[7] <= '9';
    }
    has_camera = has_camera || field == "camera";
    if (!good) {
      fields.Fail(fmt::format("{} = \"{}\" has a field {{{}}}", fields.Place(key), pattern, field),
                  "Known are {camera}, {frame} and {frame:04}");
    }
  }
  if (cameras && !has_camera) {
    fields.Fail(fmt::format("{} = \"{}\" is the same for all cameras", fields.Place(key), pattern),
                "Put {camera} into it");
  }
}

class SequenceReader {
 public:
  SequenceReader(const Capture& capture, Fields& fields, Sequence& sequence)
      : capture_(capture), fields_(fields), sequence_(sequence) {
    for (const Light& light : capture.lights) light_names_.push_back(light.name);
  }

  void Read() {
    std::string kind;
    if (fields_.Text("kind", kind, true)) {
      if (kind == "reflectance") {
        sequence_.kind = SequenceKind::kReflectance;
      } else if (kind == "dynamic") {
        sequence_.kind = SequenceKind::kDynamic;
      } else if (kind == "validation") {
        sequence_.kind = SequenceKind::kValidation;
      } else {
        fields_.Fail(fmt::format("{} is \"{}\"", fields_.Place("kind"), kind),
                     "Write reflectance, dynamic or validation");
      }
    }
    fields_.Integer("first", sequence_.first, 0, kMaxCount);
    fields_.Integer("count", sequence_.count, 1, kMaxCount, true);
    fields_.Flag("allow_missing", sequence_.allow_missing);
    fields_.Number("white_level", sequence_.white_level, 1e-9, 1e9);
    std::string transfer = "linear";
    if (fields_.Text("transfer", transfer)) {
      if (transfer != "linear" && transfer != "srgb") {
        fields_.Fail(fmt::format("{} is \"{}\"", fields_.Place("transfer"), transfer),
                     "Write linear or srgb");
      }
      sequence_.srgb = transfer == "srgb";
    }
    ReadLights();
    ReadPatterns();
  }

 private:
  void CheckLights(const std::vector<std::string>& names, const std::string& place) {
    for (const std::string& name : names) {
      if (std::find(light_names_.begin(), light_names_.end(), name) != light_names_.end()) continue;
      const std::string nearest = Nearest(name, light_names_);
      fields_.Fail(fmt::format("{} names the light \"{}\", which is not there", place, name),
                   nearest.empty()
                       ? "Describe it under \"lights\", or take it out"
                       : fmt::format("Write \"{}\", if that is what was meant", nearest));
    }
  }

  void ReadLights() {
    if (const Json* lights = fields_.Find("lights")) {
      if (fields_.Texts(*lights, fields_.Place("lights"), sequence_.lights)) {
        CheckLights(sequence_.lights, fields_.Place("lights"));
      }
    }
    if (const Json* frames = fields_.Find("frame_lights")) {
      const std::string place = fields_.Place("frame_lights");
      if (!frames->is_array() || frames->size() != static_cast<std::size_t>(sequence_.count)) {
        fields_.Fail(
            fmt::format(
                "{} is {}, not a list of {} (count)", place, Describe(*frames), sequence_.count),
            "Write one list of light names a frame");
      } else {
        sequence_.frame_lights.resize(frames->size());
        for (std::size_t i = 0; i < frames->size(); ++i) {
          const std::string frame_place = fmt::format("{}[{}]", place, i);
          if (fields_.Texts((*frames)[i], frame_place, sequence_.frame_lights[i])) {
            CheckLights(sequence_.frame_lights[i], frame_place);
          }
        }
      }
    }
    if (const Json* json = fields_.Find("environment")) {
      Fields environment(items(), *json, fields_.Place("environment"));
      EnvironmentRef ref;
      std::string file;
      if (environment.Text("file", file, true)) ref.file = file;
      environment.Number("rotation", ref.rotation, -1e3, 1e3);
      environment.ReportUnknown();
      sequence_.environment = ref;
      if (!sequence_.lights.empty() || !sequence_.frame_lights.empty()) {
        fields_.Fail(fields_.Place("environment") + " stands beside lights",
                     "A sequence is lit by lights or by an environment: take one out");
      }
    }
  }

  void ReadPatterns() {
    const bool several = capture_.cameras.size() > 1;
    if (fields_.Text("images", sequence_.images, true)) {
      CheckPattern(fields_, "images", sequence_.images, several);
      if (!HasFrameField(sequence_.images) && IsPictureName(sequence_.images) &&
          sequence_.count > 1) {
        fields_.Fail(fmt::format("{} = \"{}\" is one picture for {} frames",
                                 fields_.Place("images"),
                                 sequence_.images,
                                 sequence_.count),
                     "Put {frame:04} into it, or name a video");
      }
    }
    if (fields_.Text("background", sequence_.background)) {
      CheckPattern(fields_, "background", sequence_.background, several);
    }
    fields_.Integer("background_count", sequence_.background_count, 1, 10000);
    if (HasFrameField(sequence_.background) != (sequence_.background_count > 0)) {
      fields_.Fail(fmt::format("{} = \"{}\" with background_count = {}",
                               fields_.Place("background"),
                               sequence_.background,
                               sequence_.background_count),
                   "Several plates need both: {frame} in the pattern and background_count");
    }
    if (fields_.Text("masks", sequence_.masks)) {
      CheckPattern(fields_, "masks", sequence_.masks, several);
      if (!HasFrameField(sequence_.masks) && sequence_.count > 1) {
        fields_.Fail(fmt::format("{} = \"{}\" is one mask for {} frames",
                                 fields_.Place("masks"),
                                 sequence_.masks,
                                 sequence_.count),
                     "Put {frame:04} into it");
      }
    }
  }

  std::vector<CheckItem>& items() { return fields_.items(); }

  const Capture& capture_;
  Fields& fields_;
  Sequence& sequence_;
  std::vector<std::string> light_names_;
};

// Reads list `key` of the manifest: `read(fields, element)` for each. Which elements have no error.
template <class T, class Read>
std::vector<bool> ReadList(
    Fields& root, const std::string& key, bool required, std::vector<T>& target, Read&& read) {
  std::vector<bool> good;
  const Json* list = root.Find(key, required);
  if (list == nullptr) return good;
  if (!list->is_array() || list->size() > 1000) {
    root.Fail(fmt::format("{} is {}, not a list of at most 1000", key, Describe(*list)),
              "Write objects in brackets");
    return good;
  }
  if (required && list->empty()) root.Fail(key + " is empty", "Describe at least one");
  std::map<std::string, int> seen;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const auto before = static_cast<std::ptrdiff_t>(root.items().size());
    Fields fields(root.items(), (*list)[i], fmt::format("{}[{}]", key, i));
    T element;
    if (fields.Text("name", element.name, true)) {
      CheckName(fields, element.name, seen);
      fields.SetWhere(fmt::format("{}[{}] ({})", key, i, element.name.substr(0, 60)));
    }
    read(fields, element);
    fields.ReportUnknown();
    target.push_back(std::move(element));
    good.push_back(
        std::none_of(root.items().begin() + before, root.items().end(), [](const CheckItem& item) {
          return item.severity == Severity::kError;
        }));
  }
  return good;
}

void ReadRoot(const Json& json, Manifest& manifest) {
  Capture& capture = manifest.capture;
  Fields root(manifest.items, json, "");
  std::string format;
  if (root.Text("format", format, true) && format != "dyxel.capture") {
    root.Fail(fmt::format("format is \"{}\"", format), "Write \"dyxel.capture\"");
  }
  int version = 1;
  if (root.Integer("version", version, 0, kMaxCount, true) && version != 1) {
    root.Fail(fmt::format("version is {}; this program reads version 1", version),
              "Use a newer Dyxel, or write version 1");
  }
  if (!root.Text("name", capture.name)) {
    capture.name = std::filesystem::absolute(capture.folder / "x").parent_path().filename();
  }
  root.Number("fps", capture.fps, 1e-3, 1e5);
  std::array<double, 3> up{};
  if (root.Numbers("up", up, -kFar, kFar)) {
    const double length = ToVector(up).norm();
    if (length < 1e-9) {
      root.Fail("up has no length", "Write the up axis, normally [0, 0, 1]");
    } else {
      capture.up = ToVector(up) / length;
    }
  }
  manifest.good_cameras = ReadList(root, "cameras", true, capture.cameras, ReadCamera);
  manifest.good_lights = ReadList(root, "lights", false, capture.lights, ReadLight);
  (void)ReadList(
      root, "sequences", true, capture.sequences, [&](Fields& fields, Sequence& sequence) {
        SequenceReader(capture, fields, sequence).Read();
      });
  root.ReportUnknown();
}

Json ToJson(const Vec3d& v) { return {v.x(), v.y(), v.z()}; }
Json ToJson(const Rgb& v) { return ToJson(Vec3d(v.matrix().cast<double>())); }
Json ToJson(const Mat3d& m) {
  Json list = Json::array();
  for (int i = 0; i < 9; ++i) list.push_back(m(i / 3, i % 3));
  return list;
}

Json ToJson(const Camera& camera) {
  Json json = {{"name", camera.name},
               {"width", camera.width},
               {"height", camera.height},
               {"fx", camera.fx},
               {"fy", camera.fy},
               {"cx", camera.cx},
               {"cy", camera.cy},
               {"rotation", ToJson(camera.cam_from_world.rotation)},
               {"translation", ToJson(camera.cam_from_world.translation)},
               {"holdout", camera.holdout}};
  if (camera.HasDistortion()) json["distortion"] = camera.distortion;
  if (camera.color_matrix != Mat3d::Identity()) json["color_matrix"] = ToJson(camera.color_matrix);
  return json;
}

Json ToJson(const Light& light) {
  Json json = {{"name", light.name}};
  if (light.type == LightType::kDirectional) {
    json["type"] = "directional";
    json["direction"] = ToJson(light.direction);
    json["irradiance"] = ToJson(light.irradiance);
    return json;
  }
  json["type"] = light.type == LightType::kSpot ? "spot" : "point";
  json["position"] = ToJson(light.position);
  json["intensity"] = ToJson(light.intensity);
  if (light.type == LightType::kSpot) {
    json["direction"] = ToJson(light.direction);
    json["cone_inner"] = light.cone_inner;
    json["cone_outer"] = light.cone_outer;
  }
  return json;
}

Json ToJson(const Sequence& sequence) {
  constexpr const char* kKinds[] = {"reflectance", "dynamic", "validation"};
  Json json = {{"name", sequence.name},
               {"kind", kKinds[static_cast<int>(sequence.kind)]},
               {"first", sequence.first},
               {"count", sequence.count},
               {"images", sequence.images}};
  if (!sequence.lights.empty()) json["lights"] = sequence.lights;
  if (!sequence.frame_lights.empty()) json["frame_lights"] = sequence.frame_lights;
  if (sequence.environment) {
    json["environment"] = {{"file", sequence.environment->file.generic_string()},
                           {"rotation", sequence.environment->rotation}};
  }
  if (!sequence.background.empty()) json["background"] = sequence.background;
  if (sequence.background_count > 0) json["background_count"] = sequence.background_count;
  if (!sequence.masks.empty()) json["masks"] = sequence.masks;
  if (sequence.srgb) json["transfer"] = "srgb";
  if (sequence.white_level > 0) json["white_level"] = sequence.white_level;
  if (sequence.allow_missing) json["allow_missing"] = true;
  return json;
}

}  // namespace

bool HasFrameField(const std::string& pattern) {
  return pattern.find("{frame") != std::string::npos;
}

std::string ExpandPattern(const std::string& pattern, const std::string& camera, int frame_number) {
  std::string result;
  for (std::size_t i = 0; i < pattern.size();) {
    const std::size_t close = pattern[i] == '{' ? pattern.find('}', i) : std::string::npos;
    if (close == std::string::npos) {
      result.push_back(pattern[i++]);
      continue;
    }
    const std::string field = pattern.substr(i + 1, close - i - 1);
    if (field == "camera") {
      result += camera;
    } else if (field == "frame") {
      result += std::to_string(frame_number);
    } else if (field.rfind("frame:0", 0) == 0 && field.size() == 8) {
      result += fmt::format("{:0{}}", frame_number, field[7] - '0');
    } else {
      result += "{" + field + "}";
    }
    i = close + 1;
  }
  return result;
}

Manifest ReadManifest(const std::filesystem::path& folder) {
  Manifest manifest;
  std::error_code error;
  const bool is_file = std::filesystem::is_regular_file(folder, error);
  const std::filesystem::path path = is_file ? folder : folder / "capture.json";
  manifest.capture.folder = is_file ? folder.parent_path() : folder;
  const auto fail = [&](std::string what, std::string mend) {
    manifest.items.push_back({Severity::kError, "capture.json", std::move(what), std::move(mend)});
    return manifest;
  };
  if (!std::filesystem::is_regular_file(path, error)) {
    return fail(fmt::format("there is no such file in {}", manifest.capture.folder.string()),
                "Name the folder of a capture; docs/capture-format.md describes it");
  }
  if (std::filesystem::file_size(path, error) > (1U << 28U) || error) {
    return fail("it is larger than 256 MB or can't be read", "Check that it is the manifest");
  }
  try {
    const Json json = Json::parse(ReadFile(path));
    ReadRoot(json, manifest);
  } catch (const Json::exception& e) {
    return fail(fmt::format("it is no JSON ({})", e.what()), "Mend it at that place");
  } catch (const Error& e) {
    return fail(e.what(), "Check the file's permissions");
  }
  return manifest;
}

void WriteManifest(const std::filesystem::path& folder, const Capture& capture) {
  Require(capture.scale == 1, Fault::kStage, "A scaled capture can't be written.");
  Json json = {{"format", "dyxel.capture"},
               {"version", 1},
               {"name", capture.name},
               {"fps", capture.fps},
               {"up", ToJson(capture.up)},
               {"cameras", Json::array()},
               {"lights", Json::array()},
               {"sequences", Json::array()}};
  for (const Camera& camera : capture.cameras) json["cameras"].push_back(ToJson(camera));
  for (const Light& light : capture.lights) json["lights"].push_back(ToJson(light));
  for (const Sequence& sequence : capture.sequences) json["sequences"].push_back(ToJson(sequence));
  WriteFile(folder / "capture.json", json.dump(1) + "\n");
}

}  // namespace dyxel
