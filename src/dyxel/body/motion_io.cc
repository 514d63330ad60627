#include "dyxel/body/motion_io.h"

#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"

namespace dyxel {
namespace {

using Json = nlohmann::json;

constexpr std::string_view kFormat = "dyxel-motion";
constexpr const char* kMend = "Delete the file and run the stage \"motion\" again";

// Of the bones; nodes are known by their order.
std::vector<std::string> JointNames(const Skeleton& skeleton) {
  std::vector<std::string> names;
  for (const Joint& joint : skeleton.joints) {
    if (!joint.IsNode()) names.push_back(joint.name);
  }
  return names;
}

std::vector<std::string> DofNames(const Skeleton& skeleton) {
  std::vector<std::string> names;
  for (const Joint& joint : skeleton.joints) {
    for (const Dof& dof : joint.dofs) names.push_back(dof.name);
  }
  return names;
}

// The array of `count` finite numbers under `key`.
std::vector<double> Numbers(const std::filesystem::path& path,
                            std::size_t frame,
                            const Json& object,
                            const char* key,
                            std::size_t count) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_array() || found->size() != count) {
    throw FileError(path,
                    fmt::format("frame {}: \"{}\" is not a list of {} numbers", frame, key, count),
                    kMend);
  }
  std::vector<double> numbers;
  for (const Json& number : *found) {
    if (!number.is_number() || !std::isfinite(number.get<double>())) {
      throw FileError(
          path, fmt::format("frame {}: \"{}\" has an entry that is no number", frame, key), kMend);
    }
    numbers.push_back(number.get<double>());
  }
  return numbers;
}

void RequireNames(const std::filesystem::path& path,
                  const Json& file,
                  const char* key,
                  const std::vector<std::string>& expected) {
  const auto found = file.find(key);
  if (found == file.end() || *found != Json(expected)) {
    throw FileError(path,
                    fmt::format("its \"{}\" are not the actor's {}", key, expected.size()),
                    "It belongs to another actor; delete it and run the stage \"motion\" again");
  }
}

double Confidence(const std::filesystem::path& path, std::size_t frame, const Json& object) {
  const auto found = object.find("confidence");
  if (found != object.end() && found->is_null()) return std::numeric_limits<double>::quiet_NaN();
  const double value = found != object.end() && found->is_number() ? found->get<double>() : -1.0;
  if (!(value >= 0 && value <= 1)) {
    throw FileError(
        path, fmt::format("frame {}: \"confidence\" is not between 0 and 1", frame), kMend);
  }
  return value;
}

std::string ShiftsText(const std::vector<Vec3d>& shifts) {
  std::string text = ", \"shifts\": [";
  for (std::size_t k = 0; k < shifts.size(); ++k) {
    text += fmt::format("{}{},{},{}",
                        k == 0 ? "" : ",",
                        std::llround(1 / kShiftUnit * shifts[k].x()),
                        std::llround(1 / kShiftUnit * shifts[k].y()),
                        std::llround(1 / kShiftUnit * shifts[k].z()));
  }
  return text + "]";
}

}  // namespace

void WriteMotion(const std::filesystem::path& path,
                 const Skeleton& skeleton,
                 const Motion& motion) {
  Require(motion.confidence.size() == motion.poses.size(),
          Fault::kStage,
          "{}: {} poses but {} confidences",
          path.string(),
          motion.poses.size(),
          motion.confidence.size());
  std::string text = fmt::format("{{\"format\": \"{}\", \"version\": 1,\n", kFormat);
  text += fmt::format(" \"joints\": {},\n", Json(JointNames(skeleton)).dump());
  text += fmt::format(" \"dofs\": {},\n \"frames\": [", Json(DofNames(skeleton)).dump());
  for (std::size_t i = 0; i < motion.poses.size(); ++i) {
    const Pose& pose = motion.poses[i];
    const Vec3d& t = pose.root_translation;
    const Quatd& r = pose.root_rotation;
    bool finite = t.allFinite() && r.coeffs().allFinite();
    for (const double angle : pose.angles) finite = finite && std::isfinite(angle);
    for (const Vec3d& shift : pose.shifts) finite = finite && shift.allFinite();
    const bool fits = pose.angles.size() == static_cast<std::size_t>(skeleton.NumDofs()) &&
                      (pose.shifts.empty() ||
                       pose.shifts.size() == static_cast<std::size_t>(skeleton.NumNodes()));
    Require(finite && fits,
            Fault::kStage,
            "{}: the pose of frame {} is not finite or of another skeleton",
            path.string(),
            i);
    text += fmt::format(
        "{}\n  {{\"confidence\": {}, \"translation\": {}, \"rotation\": {}, \"angles\": {}{}}}",
        i == 0 ? "" : ",",
        Json(motion.confidence[i]).dump(),
        Json{t[0], t[1], t[2]}.dump(),
        Json{r.w(), r.x(), r.y(), r.z()}.dump(),
        Json(pose.angles).dump(),
        pose.shifts.empty() ? "" : ShiftsText(pose.shifts));
  }
  text += "\n]}\n";
  WriteFile(path, text);
}

Motion ReadMotion(const std::filesystem::path& path, const Skeleton& skeleton) {
  const Json file = Json::parse(ReadFile(path), nullptr, false);
  if (!file.is_object() || file.value("format", Json()) != Json(kFormat)) {
    throw FileError(path, "not a motion, or cut off", kMend);
  }
  if (file.value("version", Json()) != Json(1)) {
    throw FileError(path, "its version is not 1", "Read it with the program that wrote it");
  }
  RequireNames(path, file, "joints", JointNames(skeleton));
  RequireNames(path, file, "dofs", DofNames(skeleton));
  const auto frames = file.find("frames");
  if (frames == file.end() || !frames->is_array()) {
    throw FileError(path, "\"frames\" is missing", kMend);
  }
  Motion motion;
  for (const Json& frame : *frames) {
    const std::size_t i = motion.poses.size();
    if (!frame.is_object()) throw FileError(path, fmt::format("frame {} is no object", i), kMend);
    const std::vector<double> t = Numbers(path, i, frame, "translation", 3);
    const std::vector<double> r = Numbers(path, i, frame, "rotation", 4);
    Pose pose;
    pose.root_translation = {t[0], t[1], t[2]};
    pose.root_rotation = Quatd(r[0], r[1], r[2], r[3]);
    if (std::abs(pose.root_rotation.norm() - 1) > 1e-3) {
      throw FileError(path,
                      fmt::format("frame {}: \"rotation\" is no unit quaternion", i),
                      "Scale its four numbers (w, x, y, z) to length 1");
    }
    pose.angles = Numbers(path, i, frame, "angles", static_cast<std::size_t>(skeleton.NumDofs()));
    if (frame.contains("shifts")) {
      const auto nodes = static_cast<std::size_t>(skeleton.NumNodes());
      const std::vector<double> units = Numbers(path, i, frame, "shifts", 3 * nodes);
      for (std::size_t k = 0; k < nodes; ++k) {
        pose.shifts.push_back(kShiftUnit * Vec3d(units[3 * k], units[3 * k + 1], units[3 * k + 2]));
      }
    }
    motion.poses.push_back(pose);
    motion.confidence.push_back(Confidence(path, i, frame));
  }
  return motion;
}

}  // namespace dyxel
