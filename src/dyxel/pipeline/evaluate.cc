#include "dyxel/pipeline/evaluate.h"

#include <cmath>
#include <optional>
#include <set>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/pipeline/evaluate_parts.h"
#include "dyxel/pipeline/reflectance_files.h"
#include "dyxel/pipeline/report.h"
#include "dyxel/pipeline/run.h"
#include "dyxel/pipeline/stage_inputs.h"

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

void MeasureFit(const Evaluation& e) {
  if (e.job->reflectance.empty()) return;
  const Capture& capture = e.job->project().capture;
  for (const std::string& name : e.job->reflectance) {
    const Sequence& s = capture.FindSequence(name);
    MeasurePictures(e, "recorded", s, capture.EstimationCameras());
    MeasurePictures(e, "holdout", s, HoldoutCameras(capture));
    MeasurePasses(e, s);
  }
  for (const std::string& name : e.job->dynamic) {
    const Sequence& s = capture.FindSequence(name);
    MeasurePictures(e, "recorded", s, capture.EstimationCameras());
    MeasurePictures(e, "holdout", s, HoldoutCameras(capture));
    MeasurePasses(e, s);
  }
  // A validation sequence's pictures touch no estimate: all of its cameras count.
  for (const std::string& name : e.job->validation) {
    MeasurePictures(e, "relight", capture.FindSequence(name), AllCameras(capture));
  }
  MeasureReflectance(e);
}

}  // namespace

void MeasureAtlases(const Evaluation& e) {
  Workspace& workspace = *e.job->workspace;
  const Atlas& atlas = workspace.atlas();
  const Project& project = e.job->project();
  const std::vector<Vec3f> rest =
      project.HasGivenGeometry() ? workspace.Positions(project.ActorSequence().name, 0)
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
          std::set<int> bins;
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
                bins.insert(theta * 16 + phi);
                ++samples;
              }
            }
          }
          if (samples < kNeeded) continue;
          part.texels += 1;
          part.bins += static_cast<double>(bins.size());
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
  if (e.job->reflectance.empty()) return;
  for (const std::string& name : e.job->dynamic) {
    const Sequence& s = e.job->project().capture.FindSequence(name);
    const auto bytes = static_cast<double>(fs::file_size(e.job->VideoFile(name)));
    // The same maps uncompressed, as half floats: diffuse, specular, a normal map a frame.
    const MaterialMaps maps = ReadMaterialMaps(e.job->ReflectanceFolder());
    const double texels = static_cast<double>(maps.diffuse.width) * maps.diffuse.height;
    const double raw = 2 * texels * (3 + maps.specular.channels + 3.0 * s.count);
    e.metrics->Set("video.bytes", bytes);
    e.metrics->Set("video.bytes_per_frame", bytes / s.count);
    e.metrics->Set("video.raw_bytes", raw);
  }
}

Metrics Evaluate(const Project& project, const EvaluateRequest& request) {
  std::optional<Truth> truth;
  if (!request.truth.empty()) truth = OpenTruth(request.truth);
  Workspace workspace(project);
  Metrics metrics;
  std::vector<ReportPicture> pictures;

  Job job = ProjectJob(workspace);
  job.validation = ValidationSequences(project);
  RunStages(job);
  Evaluation e{&job, truth ? &*truth : nullptr, request.output, &metrics, &pictures};
  std::set<std::string> tracked(job.reflectance.begin(), job.reflectance.end());
  tracked.insert(job.dynamic.begin(), job.dynamic.end());
  tracked.insert(job.validation.begin(), job.validation.end());
  for (const std::string& name : tracked) {
    const Sequence& s = project.capture.FindSequence(name);
    MeasureSilhouettes(e, s);
    MeasureTracking(e, s);
  }
  MeasureAtlases(e);
  MeasureFit(e);
  MeasureVideo(e);

  for (const std::string& fit : request.fits) {
    (void)project.capture.FindSequence(fit);
    Job fit_job = ProjectJob(workspace);
    fit_job.reflectance = {fit};
    fit_job.fit = fit;
    fit_job.validation = job.validation;
    RunStages(fit_job);
    Evaluation fit_evaluation{&fit_job, e.truth, request.output, &metrics, &pictures};
    metrics.SetPrefix("fit." + fit + ".");
    MeasureFit(fit_evaluation);
    metrics.SetPrefix("");
  }
  metrics.Write(request.output / "metrics.json");
  WriteReport(project, metrics, pictures, request.output);
  return metrics;
}

}  // namespace dyxel
