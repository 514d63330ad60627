#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "dyxel/app/clip.h"
#include "dyxel/app/commands.h"
#include "dyxel/app/lighting_arguments.h"
#include "dyxel/app/ranges.h"
#include "dyxel/base/error.h"
#include "dyxel/base/log.h"
#include "dyxel/pipeline/stage_inputs.h"
#include "dyxel/render/orbit.h"
#include "dyxel/video/gltf_read.h"

namespace dyxel {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string source, output, sequence, frame, camera, lights, lights_from, environment,
      pass = "beauty";
  std::vector<std::string> named_lights, settings;
  bool orbit = false;
  double azimuth = 0.6, turns = 0, turn_environment = 0, exposure = 0, seconds = 0;
  int width = 1024, height = 1024;
};

// What is rendered, and the rig where the source is a project.
struct Source {
  std::unique_ptr<Project> project;
  std::unique_ptr<Workspace> workspace;
  RelightableVideo video;
  RenderOptions options;
};

Source Load(const Arguments& a) {
  Source source;
  if (fs::is_directory(a.source)) {
    source.project = std::make_unique<Project>(LoadProject(a.source, a.settings));
    source.workspace = std::make_unique<Workspace>(*source.project);
    const Job job = ProjectJob(*source.workspace);
    std::string sequence = a.sequence;
    if (sequence.empty()) {
      Require(!job.dynamic.empty(),
              Fault::kUsage,
              "{}: has no dynamic sequence. Name one with --sequence.",
              a.source);
      sequence = job.dynamic.front();
    }
    source.video = AssembleVideo(job, sequence);
    source.options = source.project->options.render;
  } else {
    Require(
        a.camera.empty() && a.lights.empty() && a.lights_from.empty(),
        Fault::kUsage,
        "--camera, --lights rig and --lights-from need a project: a video does not carry its rig.");
    source.video = ReadVideo(a.source);
    PipelineOptions options;
    OptionTable table = options.Table();
    for (const std::string& setting : a.settings) table.SetAssignment(setting);
    source.options = options.render;
  }
  Require(source.video.NumFrames() > 0, Fault::kInput, "{}: has no frames.", a.source);
  return source;
}

// The sequence whose lights are asked for; null where none is.
const Sequence* LightsSequence(const Arguments& a, const Source& source) {
  if (a.lights.empty() && a.lights_from.empty()) return nullptr;
  return &source.project->capture.FindSequence(a.lights_from.empty() ? source.video.sequence
                                                                     : a.lights_from);
}

// What stays the same over a clip: all but a turning environment's turn and the rig's lights, which
// may change from frame to frame.
Lighting BaseLighting(const Arguments& a, const Source& source) {
  Lighting lighting;
  if (!a.environment.empty())
    lighting.environment = ParseEnvironment(a.environment, source.video.up);
  for (const std::string& text : a.named_lights) lighting.lights.push_back(ParseLight(text));
  const Sequence* sequence = LightsSequence(a, source);
  if (sequence != nullptr && sequence->environment) {
    lighting.environment = LoadEnvironment(source.project->capture, *sequence->environment);
  }
  const bool lit_by_rig = sequence != nullptr && IsLit(*sequence);
  if (lighting.lights.empty() && !lighting.environment && !lit_by_rig)
    lighting.lights = DefaultLights(source.video.up);
  return lighting;
}

// Adds the rig's lights of a frame.
void AddRigLights(const Arguments& a, const Source& source, int frame, Lighting& lighting) {
  const Sequence* sequence = LightsSequence(a, source);
  if (sequence == nullptr || sequence->environment) return;
  const std::vector<Light> rig =
      source.project->capture.LightsOf(*sequence, std::min(frame, sequence->count - 1));
  lighting.lights.insert(lighting.lights.end(), rig.begin(), rig.end());
}

void RunRender(const Arguments& a) {
  Require(a.lights.empty() || a.lights == "rig",
          Fault::kUsage,
          "--lights {}: must be rig; name other lights with --light or --env.",
          a.lights);
  const Source source = Load(a);
  const RelightableVideo& video = source.video;
  const Pass pass = ParsePass(a.pass);
  const int last = video.NumFrames() - 1;
  const bool clip = fs::path(a.output).extension() == ".mp4";
  std::pair<int, int> range =
      a.frame.empty() ? std::pair(0, clip ? last : 0) : ParseRange("--frame", a.frame);
  const int first_number =
      source.project ? source.project->capture.FindSequence(video.sequence).first : 0;
  range.first -= first_number;
  range.second -= first_number;
  if (a.frame.empty()) range = {0, clip ? last : 0};
  Require(range.first >= 0 && range.second <= last,
          Fault::kUsage,
          "--frame {}: the sequence has frames {}-{}.",
          a.frame,
          first_number,
          first_number + last);

  const Orbit orbit = FitClipOrbit(video, range.first, range.second, a.width, a.height);
  const Lighting lighting = BaseLighting(a, source);
  const double fps = video.fps;
  const int moments = range.second - range.first + 1;
  const int count =
      a.seconds > 0 ? std::max(1, static_cast<int>(std::lround(a.seconds * fps))) : moments;
  const auto shot = [&](int i) {
    Shot s;
    const double share = count > 1 ? static_cast<double>(i) / count : 0;
    // A clip longer than the motion plays it forth and back.
    const int period = std::max(1, 2 * (moments - 1));
    const int phase = i % period;
    const int frame = range.first + (phase < moments ? phase : period - phase);
    s.frame = frame;
    if (!a.camera.empty()) {
      const Capture& capture = source.project->capture;
      s.camera = capture.cameras[static_cast<std::size_t>(capture.FindCamera(a.camera))];
    } else {
      s.camera = OrbitCamera(orbit, a.azimuth + 2 * kPiD * a.turns * share);
    }
    s.lighting = lighting;
    AddRigLights(a, source, frame, s.lighting);
    if (s.lighting.environment)
      s.lighting.environment->rotation += 2 * kPiD * a.turn_environment * share;
    return s;
  };
  if (clip) {
    ProgressBar bar("render");
    WriteClip(a.output, video, count, fps, shot, pass, a.exposure, source.options, bar.Callback());
    bar.Finish();
  } else {
    WritePicture(a.output, RenderShot(video, shot(0), pass, source.options), pass, a.exposure);
  }
  spdlog::info("{}", a.output);
}

}  // namespace

void AddRenderCommand(CLI::App& program) {
  static Arguments a;
  CLI::App* c = AddCommand(
      program, "render", "Render pictures (.exr, .png) and clips (.mp4) of a project or a video");
  c->add_option("SOURCE", a.source, "A project's folder, or a relightable video (.glb)")
      ->required();
  c->add_option("-o,--output", a.output, "OUT.exr (linear radiance with alpha), OUT.png or OUT.mp4")
      ->required();
  c->add_option(
      "--sequence", a.sequence, "Of a project: the sequence; default its first dynamic one");
  c->add_option("--frame", a.frame, "Frame N, or frames A-B of a clip");
  CLI::Option* camera = c->add_option("--camera", a.camera, "Of a project: a camera of the rig");
  c->add_flag("--orbit", a.orbit, "A camera around the person (the default)")->excludes(camera);
  c->add_option("--azimuth", a.azimuth, "Where the orbit starts, radians");
  c->add_option("--turns", a.turns, "Turns of the orbit over a clip");
  c->add_option("--seconds", a.seconds, "Length of a clip; default the motion's")
      ->check(CLI::Range(0.0, 3600.0));
  c->add_option("--width", a.width, "Of an orbit's picture, pixels")->check(CLI::Range(16, 8192));
  c->add_option("--height", a.height, "Of an orbit's picture, pixels")->check(CLI::Range(16, 8192));
  c->add_option("--lights", a.lights, "rig: the lights of the sequence in the capture");
  c->add_option(
      "--lights-from", a.lights_from, "The lights (or the environment) of another sequence");
  c->add_option("--light",
                a.named_lights,
                "A light: point:X,Y,Z:R,G,B, directional:DX,DY,DZ:R,G,B or "
                "spot:X,Y,Z:DX,DY,DZ:R,G,B:INNER,OUTER")
      ->take_all();
  c->add_option("--env", a.environment, "An environment: FILE (.exr, .hdr) or FILE@RADIANS");
  c->add_option("--turn-env", a.turn_environment, "Turns of the environment over a clip");
  c->add_option(
      "--pass", a.pass, "beauty, normal, diffuse, specular, depth, material, uv or confidence");
  c->add_option(
       "--exposure", a.exposure, "Factor from radiance to display; default from the picture")
      ->check(CLI::NonNegativeNumber);
  c->add_option("--set", a.settings, "Set an option: render.name=value")->take_all();
  c->callback([] { RunRender(a); });
}

}  // namespace dyxel
