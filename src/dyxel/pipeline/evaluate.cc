#include "dyxel/pipeline/evaluate.h"

#include <array>
#include <bitset>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <set>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/pipeline/evaluate_parts.h"
#include "dyxel/pipeline/reflectance_files.h"
#include "dyxel/pipeline/report.h"
#include "dyxel/pipeline/run.h"
#include "dyxel/pipeline/stage_inputs.h"
#include "dyxel/video/gltf_read.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

std::vector<int> HoldoutCameras(const Capture& capture) {
  std::vector<int> cameras;
  for (std::size_t c = 0; c < capture.cameras.size(); ++c) {
    if (capture.cameras[c].holdout) cameras.push_back(static_cast<int>(c));
  }
  return cameras;
}

std::vector<int> AllCameras(const Capture& capture) {
  std::vector<int> cameras;
  for (std::size_t c = 0; c < capture.cameras.size(); ++c) cameras.push_back(static_cast<int>(c));
  return cameras;
}

std::vector<std::string> ValidationSequences(const Project& project) {
  std::vector<std::string> names;
  for (const Sequence& s : project.capture.sequences) {
    if (s.kind == SequenceKind::kValidation) names.push_back(s.name);
  }
  return names;
}

// Measurements with their shares of the time, run one after the other under one bar.
class Measurements {
 public:
  void Add(double weight, std::function<void(const Evaluation&)> measure) {
    all_.push_back({weight, std::move(measure)});
  }
  void Run(const std::string& label, Evaluation e) const {
    ProgressBar bar(label);
    double total = 0;
    for (const Task& task : all_) total += task.weight;
    double done = 0;
    for (const Task& task : all_) {
      e.progress = [&](double share) { bar.Update((done + share * task.weight) / total); };
      e.Progress(0, 1);
      task.measure(e);
      done += task.weight;
    }
    if (!all_.empty()) bar.Finish();
  }

 private:
  struct Task {
    double weight;
    std::function<void(const Evaluation&)> measure;
  };
  std::vector<Task> all_;
};

void AddTracking(Measurements& all, const Sequence& s) {
  all.Add(3.0 * s.count, [&s](const Evaluation& e) {
    MeasureSilhouettes(e, s);
    MeasureTracking(e, s);
  });
  all.Add(8.0 * s.count, [&s](const Evaluation& e) { MeasureAlignment(e, s); });
}

// All that shows a fit; of an ablation, what it is compared by.
void AddFit(Measurements& all, const Job& job, bool ablation) {
  if (job.reflectance.empty()) return;
  const Capture& capture = job.project().capture;
  std::vector<std::string> own = job.reflectance;
  own.insert(own.end(), job.dynamic.begin(), job.dynamic.end());
  for (const std::string& name : own) {
    const Sequence& s = capture.FindSequence(name);
    all.Add(10.0 * s.count, [&s, &capture](const Evaluation& e) {
      MeasurePictures(e, "recorded", s, capture.EstimationCameras());
    });
    all.Add(2.0 * s.count, [&s, &capture](const Evaluation& e) {
      MeasurePictures(e, "holdout", s, HoldoutCameras(capture));
      MeasurePasses(e, s);
    });
  }
  for (const std::string& name : job.dynamic) {
    const Sequence& s = capture.FindSequence(name);
    if (!ablation) all.Add(s.count, [&s](const Evaluation& e) { MeasureFlicker(e, s); });
  }
  // A validation sequence's pictures touch no estimate: all of its cameras count.
  for (const std::string& name : job.validation) {
    const Sequence& s = capture.FindSequence(name);
    all.Add(10.0 * s.count, [&s, &capture](const Evaluation& e) {
      MeasurePictures(e, "relight", s, AllCameras(capture));
    });
  }
  if (!ablation) all.Add(2, MeasureReflectance);
}

// A fit without a part of the method: an option changed, or the normals left out.
struct Ablation {
  std::string_view name;
  std::string_view setting;  // "": none
  bool base_normals;
};
constexpr std::array kAblations = {
    Ablation{"no_second_pass", "reflectance.second_pass=false", false},
    Ablation{"base_normals", "", true},
    Ablation{"model_phong", "reflectance.model=phong", false},
};

const Ablation& FindAblation(const std::string& name) {
  std::string names;
  for (const Ablation& a : kAblations) {
    if (a.name == name) return a;
    names += (names.empty() ? "" : ", ") + std::string(a.name);
  }
  throw Error(Fault::kUsage, fmt::format("--ablate {}: unknown. There are: {}.", name, names));
}

// `job`'s fit with the ablation, measured under PREFIX ablation.NAME.…
void Ablate(const Ablation& ablation, const Job& job, Evaluation e, const std::string& prefix) {
  Project project = job.project();
  if (!ablation.setting.empty()) {
    OptionTable table = project.options.Table();
    table.SetAssignment(ablation.setting);
  }
  Workspace workspace(project);
  Job ablated = job;
  ablated.workspace = &workspace;
  if (!ablation.setting.empty()) {
    ablated.fit =
        (job.fit.empty() ? "" : job.fit + ".") + fmt::format("ablation.{}", ablation.name);
    RunStages(ablated);
  }
  e.job = &ablated;
  e.pictures = nullptr;
  e.base_normals = ablation.base_normals;
  e.metrics->SetPrefix(fmt::format("{}ablation.{}.", prefix, ablation.name));
  Measurements all;
  AddFit(all, ablated, /*ablation=*/true);
  all.Run(std::string(ablation.name), e);
  e.metrics->SetPrefix("");
}

}  // namespace

void MeasureAtlases(const Evaluation& e) {
  Workspace& workspace = *e.job->workspace;
  const Atlas& atlas = workspace.atlas();
  const Project& project = e.job->project();
  const std::vector<Vec3f> rest = project.HasGivenGeometry()
                                      ? workspace.Positions(project.ActorSequence().name, 0)
                                      : workspace.actor().skin.positions;
  for (const auto& [name, uv] : {std::pair("I", &atlas.uv_i), std::pair("II", &atlas.uv_ii)}) {
    if (uv->empty()) continue;
    const AtlasQuality q = MeasureAtlas(rest, atlas, *uv);
    const std::string key = std::string("atlas.") + name + ".";
    e.metrics->Set(key + "flips", q.flips);
    e.metrics->Set(key + "overlap", q.overlap);
    e.metrics->Set(key + "stretch_l2", q.stretch_l2);
    e.metrics->Set(key + "stretch_linf", q.stretch_linf);
    e.metrics->Set(key + "fill", q.fill);
  }
}

void MeasureReflectance(const Evaluation& e) {
  const TexelGrid& grid = e.job->workspace->grid();
  const Reflectance r = ReadReflectance(e.job->ReflectanceFolder(), grid);
  for (const Material& m : r.materials) {
    for (std::size_t p = 0; p < m.specular.size(); ++p) {
      e.metrics->Set(fmt::format("materials.{}.specular{}", m.name, p),
                     static_cast<double>(m.specular[p]));
    }
    e.metrics->Set(fmt::format("materials.{}.texels", m.name), m.texels);
    for (int c = 0; c < 3; ++c) {
      e.metrics->Set(fmt::format("materials.{}.diffuse_{}", m.name, "rgb"[c]),
                     static_cast<double>(m.mean_diffuse[c]));
    }
  }

  // Share of texels with at least the samples that a fit needs (three lit ones: a diffuse colour
  // and a specular), and in how many bins of half-vector direction those lie (10° in θ_h, 30° in
  // φ_h).
  constexpr int kNeeded = 3;
  const DyxelSource source = SourceOf(*e.job, e.job->reflectance);
  struct Count {
    double texels = 0;
    double bins = 0;
  };
  const Count count = ParallelReduce(
      static_cast<std::size_t>(source.num_tiles()),
      1,
      Count{},
      [&](std::size_t begin, std::size_t) {
        const DyxelTile tile = source.load(static_cast<int>(begin));
        Count part;
        for (int t = 0; t < tile.texels; ++t) {
          std::bitset<304> bins;  // 19 by 16
          int samples = 0;
          for (int f = 0; f < tile.frames; ++f) {
            for (int l = 0; l < tile.lights; ++l) {
              if (tile.Irradiance(f, l, 1)[t] <= 0) continue;
              const Vec3f light(
                  tile.LightDir(f, l, 0)[t], tile.LightDir(f, l, 1)[t], tile.LightDir(f, l, 2)[t]);
              for (int c = 0; c < tile.cameras; ++c) {
                if (tile.Weight(f, c)[t] <= 0 || light.z() <= 0) continue;
                const Vec3f view(
                    tile.ViewDir(f, c, 0)[t], tile.ViewDir(f, c, 1)[t], tile.ViewDir(f, c, 2)[t]);
                const Vec3f h = (light + view).normalized();
                const int theta =
                    static_cast<int>(std::acos(std::clamp(h.z(), -1.0F, 1.0F)) * 18 / kPi);
                const int phi = static_cast<int>((std::atan2(h.y(), h.x()) / kPi + 1) * 6);
                bins.set(16 * static_cast<std::size_t>(theta) + static_cast<std::size_t>(phi));
                ++samples;
              }
            }
          }
          if (samples < kNeeded) continue;
          part.texels += 1;
          part.bins += static_cast<double>(bins.count());
        }
        return part;
      },
      [](Count& total, const Count& part) {
        total.texels += part.texels;
        total.bins += part.bins;
      });
  e.metrics->Set("coverage.texels", count.texels / static_cast<double>(grid.count()));
  e.metrics->Set("coverage.half_vectors", count.texels > 0 ? count.bins / count.texels : 0);
}

void MeasureVideo(const Evaluation& e) {
  if (e.job->reflectance.empty() || e.job->dynamic.empty()) return;
  const Capture& capture = e.job->project().capture;
  const MaterialMaps maps = ReadMaterialMaps(e.job->ReflectanceFolder());
  const double texels = static_cast<double>(maps.diffuse.width) * maps.diffuse.height;
  double bytes = 0;
  double raw = 0;
  double frames = 0;
  for (const std::string& name : e.job->dynamic) {
    const int count = capture.FindSequence(name).count;
    bytes += static_cast<double>(fs::file_size(e.job->VideoFile(name)));
    // The same maps uncompressed, as half floats: diffuse, specular, a normal map a frame.
    raw += 2 * texels * (3 + maps.specular.channels + 3.0 * count);
    frames += count;
  }
  e.metrics->Set("video.bytes", bytes);
  e.metrics->Set("video.bytes_per_frame", bytes / frames);
  e.metrics->Set("video.raw_bytes", raw);

  const FrameMaps from_file(ReadVideo(e.job->VideoFile(e.job->dynamic.front())));
  Series loss;
  for (const std::string& name : e.job->validation) {
    const double exact = e.metrics->Get("relight." + name + ".psnr_inside");
    if (!std::isfinite(exact)) continue;
    loss.Add(exact - PsnrInsideWith(e, from_file, capture.FindSequence(name), AllCameras(capture)));
  }
  e.metrics->Set("video.psnr_loss", loss.Mean());
}

Metrics Evaluate(const Project& project, const EvaluateRequest& request) {
  std::optional<Truth> truth;
  if (!request.truth.empty()) truth = OpenTruth(request.truth);
  std::vector<const Ablation*> ablations;
  for (const std::string& name : request.ablations) ablations.push_back(&FindAblation(name));
  const Capture& capture = project.capture;
  for (const std::string& fit : request.fits) {
    Require(HasLamps(capture.FindSequence(fit)),
            Fault::kUsage,
            "--fit {}: no lamps fall on it, so no reflectance can be fitted to it.",
            fit);
  }
  Workspace workspace(project);
  Metrics metrics;
  std::vector<ReportPicture> pictures;
  std::map<fs::path, std::vector<char>> seen;

  Job job = ProjectJob(workspace);
  job.validation = ValidationSequences(project);
  RunStages(job);
  const Evaluation e{&job, truth ? &*truth : nullptr, request.output, &metrics, &pictures, &seen};
  std::set<std::string> tracked(job.reflectance.begin(), job.reflectance.end());
  tracked.insert(job.dynamic.begin(), job.dynamic.end());
  tracked.insert(job.validation.begin(), job.validation.end());
  tracked.insert(project.ActorSequence().name);
  {
    Measurements all;
    for (const std::string& name : tracked) AddTracking(all, capture.FindSequence(name));
    all.Add(5, MeasureAtlases);
    AddFit(all, job, /*ablation=*/false);
    all.Add(10, MeasureVideo);
    all.Run("measure", e);
  }
  for (const Ablation* ablation : ablations) Ablate(*ablation, job, e, "");

  for (const std::string& fit : request.fits) {
    Job fit_job = job;
    fit_job.reflectance = {fit};
    fit_job.fit = fit;
    RunStages(fit_job);
    Evaluation fit_evaluation = e;
    fit_evaluation.job = &fit_job;
    if (tracked.insert(fit).second) {
      Measurements all;
      AddTracking(all, capture.FindSequence(fit));
      all.Run("track " + fit, fit_evaluation);
    }
    const std::string prefix = "fit." + fit + ".";
    metrics.SetPrefix(prefix);
    Measurements all;
    AddFit(all, fit_job, /*ablation=*/false);
    all.Run("fit " + fit, fit_evaluation);
    metrics.SetPrefix("");
    for (const Ablation* ablation : ablations) Ablate(*ablation, fit_job, fit_evaluation, prefix);
  }
  metrics.Write(request.output / "metrics.json");
  WriteReport(project, metrics, pictures, request.output);
  return metrics;
}

}  // namespace dyxel
