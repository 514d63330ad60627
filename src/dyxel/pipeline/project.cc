#include "dyxel/pipeline/project.h"

#include <algorithm>

#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <toml++/toml.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"
#include "dyxel/capture/manifest.h"
#include "dyxel/pipeline/stage_inputs.h"
#include "dyxel/pipeline/toml_options.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kHeading =
    "# A Dyxel project: where its capture is, and the options in force. Edit, then `dyxel run` "
    "again.\n";

std::string Quoted(const std::string& text) { return nlohmann::json(text).dump(); }

std::string WriteToml(const Project& project) {
  const ProjectInputs& in = project.inputs;
  std::string text(kHeading);
  text += "\n[capture]\npath = " + Quoted(in.capture.string()) + "\n";
  if (!in.geometry.empty()) {
    text += "geometry = " + Quoted(in.geometry.string()) + "\n";
    text += fmt::format("smooth_normals = {}\n", in.smooth_normals);
  }
  text += fmt::format("scale = {}\n", in.scale == 1 ? "1.0" : fmt::format("{}", in.scale));
  if (in.frames) text += fmt::format("frames = [{}, {}]\n", in.frames->first, in.frames->second);
  return text + WriteTomlOptions(project.options);
}

// The [capture] table but for `frames`, as options are declared.
struct InputOptions {
  std::string path, geometry;
  int smooth_normals = 0;
  double scale = 1;

  template <class Self, class Field>
  static void Describe(Self& o, Field&& field) {
    field(o.path, {.name = "path", .help = "the capture's folder"});
    field(o.geometry, {.name = "geometry", .help = "folder of given surfaces"});
    field(o.smooth_normals,
          {.name = "smooth_normals",
           .unit = "rounds",
           .min = 0,
           .max = 1000,
           .help = "smoothing of the given surfaces' normals"});
    field(o.scale, {.name = "scale", .min = 0.05, .max = 1, .help = "size of the pictures"});
  }
};

std::pair<int, int> ReadFrames(const toml::node& node, const std::string& file) {
  const toml::array* list = node.as_array();
  const bool two =
      list != nullptr && list->size() == 2 && (*list)[0].is_integer() && (*list)[1].is_integer();
  const auto first = two ? (*list)[0].as_integer()->get() : -1;
  const auto last = two ? (*list)[1].as_integer()->get() : -1;
  Require(0 <= first && first <= last && last <= kMaxCount,
          Fault::kUsage,
          "{}: capture.frames must be [A, B], file numbers with 0 <= A <= B.",
          file);
  return {static_cast<int>(first), static_cast<int>(last)};
}

// `text` is TOML that ReadTomlOptions has accepted; relative paths are below `file`'s folder.
ProjectInputs ReadInputs(const std::string& text, const fs::path& file) {
  const toml::table parsed = toml::parse(text);
  ProjectInputs in;
  const toml::table* table = parsed["capture"].as_table();
  if (table == nullptr) return in;
  toml::table others = *table;
  if (const toml::node* frames = table->get("frames")) {
    in.frames = ReadFrames(*frames, file.string());
    others.erase("frames");
  }
  InputOptions read;
  OptionTable options;
  options.Add("capture", read);
  ReadTomlTable(others, "capture.", file.string(), options);
  const auto absolute = [&](const std::string& path) {
    return path.empty() ? fs::path() : (file.parent_path() / path).lexically_normal();
  };
  in.capture = absolute(read.path);
  in.geometry = absolute(read.geometry);
  in.smooth_normals = read.smooth_normals;
  in.scale = read.scale;
  return in;
}

// Cuts dynamic sequences to the file numbers [first, last].
void CutFrames(Capture& capture, int first, int last) {
  for (Sequence& sequence : capture.sequences) {
    if (sequence.kind != SequenceKind::kDynamic) continue;
    const int from = std::max(first, sequence.first);
    const int to = std::min(last, sequence.first + sequence.count - 1);
    Require(from <= to,
            Fault::kUsage,
            "--frames {}-{}: sequence {} has frames {}-{}. Name frames that it has.",
            first,
            last,
            sequence.name,
            sequence.first,
            sequence.first + sequence.count - 1);
    if (!sequence.frame_lights.empty()) {
      const auto begin = sequence.frame_lights.begin() + (from - sequence.first);
      sequence.frame_lights = std::vector<std::vector<std::string>>(begin, begin + (to - from + 1));
    }
    sequence.first = from;
    sequence.count = to - from + 1;
  }
}

Project Finish(Project project) {
  Require(!project.inputs.capture.empty(),
          Fault::kUsage,
          "{}: no capture is named. Run `dyxel run CAPTURE -o {}` first.",
          project.folder.string(),
          project.folder.string());
  Require(!project.HasGivenGeometry() || fs::is_directory(project.inputs.geometry),
          Fault::kInput,
          "{}: is no folder. --geometry takes a folder with SEQUENCE/0000.ply files.",
          project.inputs.geometry.string());
  project.capture = LoadCapture(project.inputs.capture, project.inputs.scale);
  if (project.inputs.frames) {
    CutFrames(project.capture, project.inputs.frames->first, project.inputs.frames->second);
  }
  return project;
}

}  // namespace

std::vector<std::string> Project::ReflectanceSequences() const {
  std::vector<std::string> names = options.reflectance_sequence.sequence;
  for (const Sequence& sequence : capture.sequences) {
    if (!names.empty()) break;
    if (sequence.kind == SequenceKind::kReflectance) names = {sequence.name};
  }
  const bool all_lit = std::all_of(names.begin(), names.end(), [&](const std::string& name) {
    return HasLamps(capture.FindSequence(name));
  });
  return all_lit ? names : std::vector<std::string>();
}

std::string Project::WhyNoReflectance() const {
  if (!ReflectanceSequences().empty()) return "";
  const std::vector<std::string>& named = options.reflectance_sequence.sequence;
  const std::string manifest = (inputs.capture / "capture.json").string();
  if (!named.empty()) {
    return fmt::format(
        "{}: no lamps fall on {}, so there is no reflectance and no video. Name their lights, or "
        "other sequences with --set reflectance.sequence=NAME.",
        manifest,
        fmt::join(named, ", "));
  }
  for (const Sequence& sequence : capture.sequences) {
    if (sequence.kind != SequenceKind::kReflectance) continue;
    return fmt::format(
        "{}: sequence {} names no lights, so there is no reflectance and no video. Name its "
        "lights.",
        manifest,
        sequence.name);
  }
  return fmt::format(
      "{}: no sequence is of kind \"reflectance\", so there is no reflectance and no video. Record "
      "the person turning once under the lamps, or name sequences with --set "
      "reflectance.sequence=NAME.",
      manifest);
}

const Sequence& Project::ActorSequence() const {
  if (const auto names = ReflectanceSequences(); !names.empty()) {
    return capture.FindSequence(names.front());
  }
  for (const SequenceKind kind : {SequenceKind::kReflectance, SequenceKind::kDynamic}) {
    for (const Sequence& sequence : capture.sequences) {
      if (sequence.kind == kind) return sequence;
    }
  }
  return capture.sequences.front();
}

std::vector<std::string> Project::DynamicSequences() const {
  std::vector<std::string> names;
  for (const Sequence& sequence : capture.sequences) {
    if (sequence.kind == SequenceKind::kDynamic) names.push_back(sequence.name);
  }
  return names;
}

std::string Project::FrameName(const Sequence& sequence, int frame) {
  return fmt::format("{:04}", sequence.first + frame);
}

namespace {

void Override(ProjectInputs& inputs, const GivenInputs& given) {
  const auto absolute = [](const fs::path& path) {
    return path.empty() ? fs::path() : fs::absolute(path).lexically_normal();
  };
  if (given.capture) inputs.capture = absolute(*given.capture);
  if (given.geometry) inputs.geometry = absolute(*given.geometry);
  if (given.smooth_normals) inputs.smooth_normals = *given.smooth_normals;
  if (given.scale) inputs.scale = *given.scale;
  if (given.frames) inputs.frames = *given.frames;
  if (inputs.geometry.empty()) {
    Require(given.smooth_normals.value_or(0) == 0,
            Fault::kUsage,
            "--smooth-normals needs --geometry: it smooths the normals of given surfaces.");
    inputs.smooth_normals = 0;
  }
}

// What `file` says, if it is there, and `settings` over it.
Project ReadProject(const fs::path& folder, const std::vector<std::string>& settings) {
  Project project;
  project.folder = fs::absolute(folder).lexically_normal();
  const fs::path file = project.folder / "dyxel.toml";
  if (fs::exists(file)) {
    const std::string text = ReadFile(file);
    ReadTomlOptions(text, file.string(), project.options);
    project.inputs = ReadInputs(text, file);
  }
  OptionTable table = project.options.Table();
  for (const std::string& setting : settings) table.SetAssignment(setting);
  return project;
}

}  // namespace

Project OpenProject(const fs::path& folder,
                    const GivenInputs& given,
                    const std::vector<std::string>& settings) {
  Project project = ReadProject(folder, settings);
  Override(project.inputs, given);
  project = Finish(std::move(project));
  const fs::path file = project.folder / "dyxel.toml";
  const std::string text = WriteToml(project);
  if (!fs::exists(file) || ReadFile(file) != text) WriteFile(file, text);
  return project;
}

Project LoadProject(const fs::path& folder, const std::vector<std::string>& settings) {
  if (!fs::exists(folder / "dyxel.toml")) {
    throw FileError(folder,
                    "is no Dyxel project (it has no dyxel.toml)",
                    "Make one with `dyxel run CAPTURE -o " + folder.string() + "`");
  }
  return Finish(ReadProject(folder, settings));
}

}  // namespace dyxel
