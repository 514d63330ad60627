#include "dyxel/pipeline/project.h"

#include <nlohmann/json.hpp>
#include <toml++/toml.h>

#include "dyxel/base/atomic_file.h"
#include "dyxel/base/error.h"

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

// `text` is TOML that ReadTomlOptions has accepted.
ProjectInputs ReadInputs(const std::string& text) {
  const toml::table parsed = toml::parse(text);
  const auto table = parsed["capture"];
  ProjectInputs in;
  in.capture = table["path"].value_or(std::string());
  in.geometry = table["geometry"].value_or(std::string());
  in.smooth_normals = static_cast<int>(table["smooth_normals"].value_or<std::int64_t>(0));
  in.scale = table["scale"].value_or(1.0);
  if (const auto* frames = table["frames"].as_array(); frames != nullptr && frames->size() == 2) {
    in.frames = {static_cast<int>((*frames)[0].value_or<std::int64_t>(0)),
                 static_cast<int>((*frames)[1].value_or<std::int64_t>(0))};
  }
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
  project.capture = LoadCapture(project.inputs.capture, project.inputs.scale);
  if (project.inputs.frames) {
    CutFrames(project.capture, project.inputs.frames->first, project.inputs.frames->second);
  }
  return project;
}

}  // namespace

std::vector<std::string> Project::ReflectanceSequences() const {
  const std::vector<std::string>& named = options.reflectance_sequence.sequence;
  for (const std::string& name : named) (void)capture.FindSequence(name);
  if (!named.empty()) return named;
  for (const Sequence& sequence : capture.sequences) {
    if (sequence.kind == SequenceKind::kReflectance) return {sequence.name};
  }
  throw FileError(inputs.capture / "capture.json",
                  "no sequence is of kind \"reflectance\"",
                  "Record the person turning once under the lamps, or name sequences with "
                  "--set reflectance.sequence=NAME");
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

Project OpenProject(const fs::path& folder,
                    const ProjectInputs& given,
                    const std::vector<std::string>& settings) {
  Project project;
  project.folder = fs::absolute(folder).lexically_normal();
  const fs::path file = project.folder / "dyxel.toml";
  if (fs::exists(file)) {
    const std::string text = ReadFile(file);
    ReadTomlOptions(text, file.string(), project.options);
    project.inputs = ReadInputs(text);
  }
  if (!given.capture.empty()) {
    project.inputs = given;
    project.inputs.capture = fs::absolute(given.capture).lexically_normal();
    if (!given.geometry.empty()) {
      project.inputs.geometry = fs::absolute(given.geometry).lexically_normal();
      Require(fs::is_directory(project.inputs.geometry),
              Fault::kInput,
              "{}: is no folder. --geometry takes a folder with SEQUENCE/0000.ply files.",
              project.inputs.geometry.string());
    }
  }
  {
    OptionTable table = project.options.Table();
    for (const std::string& setting : settings) table.SetAssignment(setting);
  }
  project = Finish(std::move(project));
  const std::string text = WriteToml(project);
  if (!fs::exists(file) || ReadFile(file) != text) WriteFile(file, text);
  return project;
}

Project LoadProject(const fs::path& folder, const std::vector<std::string>& settings) {
  Project project;
  project.folder = fs::absolute(folder).lexically_normal();
  const fs::path file = project.folder / "dyxel.toml";
  if (!fs::exists(file)) {
    throw FileError(folder,
                    "is no Dyxel project (it has no dyxel.toml)",
                    "Make one with `dyxel run CAPTURE -o " + folder.string() + "`");
  }
  const std::string text = ReadFile(file);
  ReadTomlOptions(text, file.string(), project.options);
  project.inputs = ReadInputs(text);
  {
    OptionTable table = project.options.Table();
    for (const std::string& setting : settings) table.SetAssignment(setting);
  }
  return Finish(std::move(project));
}

}  // namespace dyxel
