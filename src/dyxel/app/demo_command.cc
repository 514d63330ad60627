#include <algorithm>

#include <fmt/format.h>

#include "dyxel/app/clip.h"
#include "dyxel/app/commands.h"
#include "dyxel/base/log.h"
#include "dyxel/base/progress.h"
#include "dyxel/pipeline/evaluate.h"
#include "dyxel/pipeline/run.h"
#include "dyxel/pipeline/stage_inputs.h"
#include "dyxel/render/orbit.h"
#include "dyxel/studio/studio.h"
#include "dyxel/video/gltf_read.h"

namespace dyxel {
namespace {

namespace fs = std::filesystem;

constexpr double kTurntableSeconds = 5;

// One turn around the person, its motion played forth and back, under the capture's environment,
// which turns the other way.
void WriteTurntable(const Project& project, const Job& job, const fs::path& file) {
  const RelightableVideo video = ReadVideo(job.VideoFile(job.dynamic.front()));
  Lighting lighting;
  for (const Sequence& s : project.capture.sequences) {
    if (s.environment && !lighting.environment)
      lighting.environment = LoadEnvironment(project.capture, *s.environment);
  }
  const Orbit orbit = FitClipOrbit(video, 0, video.NumFrames() - 1, 640, 640);
  const int count = static_cast<int>(kTurntableSeconds * video.fps);
  const int period = std::max(1, 2 * (video.NumFrames() - 1));
  const auto shot = [&](int i) {
    const double share = static_cast<double>(i) / count;
    const int phase = i % period;
    Shot s{static_cast<double>(phase < video.NumFrames() ? phase : period - phase),
           OrbitCamera(orbit, 2 * kPiD * share),
           lighting};
    if (s.lighting.environment) s.lighting.environment->rotation -= 2 * kPiD * share;
    return s;
  };
  RenderOptions options = project.options.render;
  options.environment_lights = 32;
  ProgressBar bar("turntable");
  WriteClip(file, video, count, video.fps, shot, Pass::kBeauty, 0, options, bar.Callback());
  bar.Finish();
}

void RunDemo(const fs::path& folder) {
  const fs::path capture = folder / "capture";
  if (!fs::exists(capture)) {
    // Rendered beside its place: a capture that is there is whole.
    const fs::path part = folder / "capture.part";
    fs::remove_all(part);
    ProgressBar bar("studio");
    WriteStudioCapture(part, FindStudioPreset("demo"), bar.Callback());
    bar.Finish();
    fs::rename(part, capture);
  }
  GivenInputs inputs;
  inputs.capture = capture;
  // A texel is 3 mm of the skin then, and a picture's pixel 5: more would only take longer.
  const Project project = OpenProject(folder / "project", inputs, {"atlas.size=512"});
  Workspace workspace(project);
  const Job job = ProjectJob(workspace);
  RunStages(job, {.record_times = true});
  EvaluateRequest request;
  request.truth = capture / "truth";
  request.output = project.folder / "report";
  const Metrics metrics = Evaluate(project, request);
  const fs::path turntable = folder / "turntable.mp4";
  WriteTurntable(project, job, turntable);

  fmt::print("\nThe demo is done.\n");
  fmt::print("  relightable video  {}   (any glTF viewer opens it)\n",
             job.VideoFile(job.dynamic.front()).string());
  fmt::print("  turntable          {}\n", turntable.string());
  fmt::print("  report             {}\n", (request.output / "index.html").string());
  fmt::print("  the capture        {}   (what your own would look like)\n", capture.string());
  fmt::print("  held-out camera    {:.1f} dB inside the person\n",
             metrics.Get("holdout." + job.dynamic.front() + ".psnr_inside"));
}

}  // namespace

void AddDemoCommand(CLI::App& program) {
  static std::string folder = "dyxel-demo";
  CLI::App* c = AddCommand(
      program,
      "demo",
      "Render a small virtual capture, run everything on it, write video, turntable and report");
  c->add_option("DIR", folder, "Folder for all of it")->capture_default_str();
  c->callback([] { RunDemo(folder); });
}

}  // namespace dyxel
