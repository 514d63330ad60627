#include "dyxel/pipeline/stages.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/body/motion_io.h"
#include "dyxel/image/image_io.h"
#include "dyxel/mesh/closed_atlas.h"
#include "dyxel/mesh/given_atlas.h"
#include "dyxel/pipeline/atlas_files.h"
#include "dyxel/pipeline/capture_fingerprint.h"
#include "dyxel/pipeline/reflectance_files.h"
#include "dyxel/pipeline/stage_inputs.h"
#include "dyxel/render/renderer.h"
#include "dyxel/texture/texture_files.h"
#include "dyxel/tracking/registration.h"
#include "dyxel/tracking/silhouettes.h"
#include "dyxel/tracking/track.h"
#include "dyxel/video/actor_gltf.h"
#include "dyxel/video/gltf_write.h"

namespace dyxel {
namespace fs = std::filesystem;
namespace {

using Paths = std::vector<fs::path>;

void Append(Paths& to, const Paths& from) { to.insert(to.end(), from.begin(), from.end()); }

// The sequences of a job, each once, in the capture's order.
std::vector<const Sequence*> AllSequences(const Job& job) {
  std::set<std::string> names(job.reflectance.begin(), job.reflectance.end());
  names.insert(job.project().ActorSequence().name);
  names.insert(job.dynamic.begin(), job.dynamic.end());
  names.insert(job.validation.begin(), job.validation.end());
  std::vector<const Sequence*> all;
  for (const Sequence& s : job.project().capture.sequences) {
    if (names.count(s.name) > 0) all.push_back(&s);
  }
  return all;
}

Paths MaskFiles(const Job& job, const Sequence& sequence) {
  Paths files;
  for (int frame = 0; frame < sequence.count; ++frame) {
    for (const int camera : job.project().capture.EstimationCameras()) {
      if (HasFrame(job.project().capture, sequence, camera, frame)) {
        files.push_back(job.workspace->MaskFile(sequence.name, camera, frame));
      }
    }
  }
  return files;
}

SilhouetteSet LoadSilhouettes(const Job& job, const Sequence& sequence) {
  const Capture& capture = job.project().capture;
  SilhouetteSet set;
  set.up = capture.up;
  const std::vector<int> cameras = capture.EstimationCameras();
  for (const int camera : cameras)
    set.cameras.push_back(capture.cameras[static_cast<std::size_t>(camera)]);
  set.masks.resize(static_cast<std::size_t>(sequence.count), std::vector<ImageU8>(cameras.size()));
  ParallelFor(set.masks.size() * cameras.size(), [&](std::size_t i) {
    const int frame = static_cast<int>(i / cameras.size());
    const int camera = cameras[i % cameras.size()];
    if (!HasFrame(capture, sequence, camera, frame)) return;
    set.masks[i / cameras.size()][i % cameras.size()] =
        ReadPngMask(job.workspace->MaskFile(sequence.name, camera, frame));
  });
  return set;
}

// ---------------------------------------------------------------------------------------------

std::vector<Unit> SilhouetteUnits(const Job& job) {
  std::vector<Unit> units;
  if (job.project().HasGivenGeometry()) return units;
  PipelineOptions options = job.project().options;
  for (const Sequence* sequence : AllSequences(job)) {
    const std::string fingerprint = options.Table().Fingerprint("silhouettes") +
                                    PictureFingerprint(job.project().capture, *sequence);
    const auto plates = std::make_shared<PlateCache>(job.project().capture, *sequence);
    for (int frame = 0; frame < sequence->count; ++frame) {
      Unit unit;
      unit.stage = "silhouettes";
      unit.id = sequence->name + "/" + Project::FrameName(*sequence, frame);
      unit.options = fingerprint;
      std::vector<int> cameras;
      for (const int camera : job.project().capture.EstimationCameras()) {
        if (!HasFrame(job.project().capture, *sequence, camera, frame)) continue;
        cameras.push_back(camera);
        Append(unit.inputs, FrameFiles(job.project().capture, *sequence, camera, frame));
        unit.outputs.push_back(job.workspace->MaskFile(sequence->name, camera, frame));
      }
      unit.run = [job, sequence, plates, cameras, frame](const ProgressFn&) {
        const Project& project = job.project();
        ParallelFor(cameras.size(), [&](std::size_t i) {
          const int camera = cameras[i];
          ImageU8 mask = ReadGivenMask(project.capture, *sequence, camera, frame);
          if (mask.empty()) {
            const Picture picture = ReadFrame(project.capture, *sequence, camera, frame);
            mask = ExtractSilhouette(
                picture.image, plates->Get(camera), SilhouetteOptionsOf(project, *sequence));
          }
          WritePng(job.workspace->MaskFile(sequence->name, camera, frame), mask);
        });
      };
      units.push_back(std::move(unit));
    }
  }
  return units;
}

std::vector<Unit> ActorUnits(const Job& job) {
  if (job.project().HasGivenGeometry()) return {};
  const Sequence& sequence = job.project().ActorSequence();
  Unit unit;
  unit.stage = "actor";
  unit.id = "actor";
  PipelineOptions options = job.project().options;
  const OptionTable table = options.Table();
  unit.options = table.Fingerprint("actor") + table.Fingerprint("motion") +
                 RigFingerprint(job.project().capture);
  unit.inputs = MaskFiles(job, sequence);
  unit.outputs = {job.workspace->ActorFile(), job.workspace->ActorMotionFile()};
  unit.run = [job, &sequence](const ProgressFn& progress) {
    const ActorFit fit = FitActor(LoadSilhouettes(job, sequence),
                                  MakeBuiltInTemplate(),
                                  job.project().options.actor,
                                  job.project().options.motion,
                                  progress);
    WriteActor(job.workspace->ActorFile(), fit.actor);
    WriteMotion(job.workspace->ActorMotionFile(), fit.actor.skeleton, fit.motion);
  };
  return {unit};
}

std::vector<Unit> MotionUnits(const Job& job) {
  std::vector<Unit> units;
  if (job.project().HasGivenGeometry()) return units;
  PipelineOptions options = job.project().options;
  for (const Sequence* sequence : AllSequences(job)) {
    Unit unit;
    unit.stage = "motion";
    unit.id = sequence->name;
    unit.options = options.Table().Fingerprint("motion") + RigFingerprint(job.project().capture);
    unit.inputs = MaskFiles(job, *sequence);
    unit.inputs.push_back(job.workspace->ActorFile());
    // The actor's own sequence has poses already.
    const bool known = sequence == &job.project().ActorSequence();
    if (known) unit.inputs.push_back(job.workspace->ActorMotionFile());
    unit.outputs = {job.workspace->MotionFile(sequence->name)};
    unit.run = [job, sequence, known](const ProgressFn& progress) {
      const SilhouetteSet silhouettes = LoadSilhouettes(job, *sequence);
      const MotionOptions& motion_options = job.project().options.motion;
      const auto part = [&](double from, double to) {
        return [&progress, from, to](double share) {
          if (progress) progress(from + (to - from) * share);
        };
      };
      const Actor& bones = job.workspace->bones();
      Motion fitted;
      if (known) fitted = ReadMotion(job.workspace->ActorMotionFile(), bones.skeleton);
      Motion motion =
          TrackMotion(silhouettes, bones, motion_options, part(0, 0.8), known ? &fitted : nullptr);
      const Actor& actor = job.workspace->actor();
      motion = FitShifts(silhouettes, actor, std::move(motion), motion_options, part(0.8, 1));
      WriteMotion(job.workspace->MotionFile(sequence->name), actor.skeleton, motion);
    };
    units.push_back(std::move(unit));
  }
  return units;
}

std::vector<Unit> AtlasUnits(const Job& job) {
  Unit unit;
  unit.stage = "atlas";
  unit.id = "atlas";
  PipelineOptions options = job.project().options;
  unit.options = options.Table().Fingerprint("atlas");
  const bool given = job.project().HasGivenGeometry();
  const fs::path mesh_file =
      given ? job.workspace->GivenMesh(job.project().ActorSequence().name, 0) : fs::path();
  unit.inputs = {given ? mesh_file : job.workspace->ActorFile()};
  unit.outputs = AtlasFiles(job.workspace->AtlasFolder(), !given);
  unit.run = [job, given, mesh_file](const ProgressFn&) {
    const AtlasOptions& atlas_options = job.project().options.atlas;
    if (given) {
      const TriangleMesh mesh = ReadPly(mesh_file);
      WriteAtlas(
          job.workspace->AtlasFolder(),
          mesh.positions,
          MakeGivenAtlas(
              mesh.positions, mesh.triangles, ReadPlyTextureCoordinates(mesh_file), atlas_options));
    } else {
      const TriangleMesh& skin = job.workspace->actor().skin;
      WriteAtlas(job.workspace->AtlasFolder(),
                 skin.positions,
                 MakeClosedAtlas(skin.positions, skin.triangles, atlas_options));
    }
  };
  return {unit};
}

// Predicts the pictures of a sequence from the project's reflectance and the sequence's lamps.
PredictPictures PicturePredictor(const Job& job, const Sequence& sequence) {
  const auto maps = std::make_shared<const MaterialMaps>(ReadMaterialMaps(job.ReflectanceFolder()));
  return [job, &sequence, maps](std::size_t frame, std::span<const Vec3f> positions) {
    const Project& project = job.project();
    const Atlas& atlas = job.workspace->atlas();
    RenderOptions options = project.options.render;
    options.samples = 1;
    const PosedSurface surface = PoseSurface(atlas, job.workspace->skin_triangles(), positions);
    const RenderSurface shown{&atlas, &surface, maps.get(), &maps->normal};
    Lighting lighting;
    lighting.lights = project.capture.LightsOf(sequence, static_cast<int>(frame));
    const PreparedLighting prepared(shown, lighting, options);
    const std::vector<Camera> cameras = EstimationCamerasOf(project.capture);
    std::vector<PredictedPicture> pictures(cameras.size());
    ParallelFor(cameras.size(), [&](std::size_t c) {
      const std::vector<Pass> passes = {Pass::kBeauty, Pass::kDepth};
      std::vector<ImageF> drawn = RenderPasses(shown, cameras[c], prepared, passes, options);
      pictures[c] = {std::move(drawn[0]), std::move(drawn[1])};
    });
    return pictures;
  };
}

std::string SurfaceOptions(const Job& job) {
  return fmt::format("smooth_normals={}\n", job.project().inputs.smooth_normals);
}

// Of the sequences whose surface is registered first, or of the others.
std::vector<Unit> TextureUnitsOf(const Job& job, const std::string& stage, bool registered) {
  std::vector<Unit> units;
  PipelineOptions options = job.project().options;
  const std::string fingerprint = options.Table().Fingerprint("textures") + SurfaceOptions(job) +
                                  RigFingerprint(job.project().capture);
  std::set<std::string> wanted(job.reflectance.begin(), job.reflectance.end());
  wanted.insert(job.dynamic.begin(), job.dynamic.end());
  const Capture& capture = job.project().capture;
  for (const Sequence* sequence : AllSequences(job)) {
    // Nothing is fitted to what an environment lights.
    if (wanted.count(sequence->name) == 0 || !IsLit(*sequence) || sequence->environment) continue;
    if (job.workspace->IsRegistered(sequence->name) != registered) continue;
    for (int frame = 0; frame < sequence->count; ++frame) {
      Unit unit;
      unit.stage = stage;
      unit.id = sequence->name + "/" + Project::FrameName(*sequence, frame);
      unit.options = fingerprint + PictureFingerprint(capture, *sequence) +
                     LightFingerprint(capture, *sequence, frame, frame + 1);
      unit.inputs = SurfaceFiles(job, *sequence, frame);
      for (const int camera : capture.EstimationCameras()) {
        if (!HasFrame(capture, *sequence, camera, frame)) continue;
        unit.inputs.push_back(FramePath(capture, *sequence, camera, frame));
      }
      unit.outputs =
          MvvTextureFiles(job.TextureFolder(*sequence, frame), EstimationCameraNames(capture));
      unit.run = [job, sequence, frame](const ProgressFn&) {
        const Project& project = job.project();
        const PosedSurface surface = job.workspace->Posed(sequence->name, frame);
        const MvvTextures textures =
            MakeMvvTextures(job.workspace->atlas(),
                            job.workspace->grid(),
                            surface,
                            EstimationCamerasOf(project.capture),
                            ReadCrops(project.capture, *sequence, frame, surface.positions),
                            project.capture.LightsOf(*sequence, frame),
                            project.options.textures);
        WriteMvvTextures(job.TextureFolder(*sequence, frame),
                         EstimationCameraNames(project.capture),
                         job.workspace->grid(),
                         textures);
      };
      units.push_back(std::move(unit));
    }
  }
  return units;
}

std::vector<Unit> TextureUnits(const Job& job) { return TextureUnitsOf(job, "textures", false); }
std::vector<Unit> DssTextureUnits(const Job& job) {
  return TextureUnitsOf(job, "dss_textures", true);
}

std::vector<Unit> RegistrationUnits(const Job& job) {
  std::vector<Unit> units;
  if (!job.fit.empty()) return units;  // surfaces are the project's own, whatever is fitted on them
  PipelineOptions options = job.project().options;
  const OptionTable table = options.Table();
  const Capture& capture = job.project().capture;
  for (const std::string& name : job.dynamic) {
    if (!job.workspace->IsRegistered(name)) continue;
    const Sequence& sequence = capture.FindSequence(name);
    Unit unit;
    unit.stage = "registration";
    unit.id = name;
    unit.options = table.Fingerprint("registration") + table.Fingerprint("motion") +
                   RigFingerprint(capture) + PictureFingerprint(capture, sequence) +
                   LightFingerprint(capture, sequence, 0, sequence.count);
    unit.inputs = MaskFiles(job, sequence);
    Append(unit.inputs, AtlasFiles(job.workspace->AtlasFolder(), true));
    Append(unit.inputs, ReflectanceFiles(job.ReflectanceFolder()));
    unit.inputs.push_back(job.workspace->ActorFile());
    unit.inputs.push_back(job.workspace->MotionFile(name));
    for (int frame = 0; frame < sequence.count; ++frame) {
      for (const int camera : capture.EstimationCameras()) {
        if (!HasFrame(capture, sequence, camera, frame)) continue;
        unit.inputs.push_back(FramePath(capture, sequence, camera, frame));
      }
    }
    std::sort(unit.inputs.begin(), unit.inputs.end());
    unit.inputs.erase(std::unique(unit.inputs.begin(), unit.inputs.end()), unit.inputs.end());
    unit.outputs = {job.workspace->RegistrationFile(name)};
    unit.run = [job, &sequence](const ProgressFn& progress) {
      const Project& project = job.project();
      const Actor& actor = job.workspace->actor();
      const Motion tracked = ReadMotion(job.workspace->MotionFile(sequence.name), actor.skeleton);
      const SilhouetteSet silhouettes = LoadSilhouettes(job, sequence);
      const Motion registered = RegisterMotion(
          silhouettes,
          actor,
          tracked,
          PicturePredictor(job, sequence),
          [&](std::size_t frame, std::span<const Vec3f> positions) {
            return ReadCrops(project.capture, sequence, static_cast<int>(frame), positions);
          },
          project.options.registration,
          project.options.motion,
          progress);
      WriteMotion(job.workspace->RegistrationFile(sequence.name), actor.skeleton, registered);
    };
    units.push_back(std::move(unit));
  }
  return units;
}

std::vector<Unit> ReflectanceUnits(const Job& job) {
  if (job.reflectance.empty()) return {};
  Unit unit;
  unit.stage = "reflectance";
  unit.id = job.FitId("reflectance");
  PipelineOptions options = job.project().options;
  unit.options = options.Table().Fingerprint("reflectance") + SurfaceOptions(job) +
                 fmt::format("sequences={}\n", fmt::join(job.reflectance, ",")) +
                 RigFingerprint(job.project().capture);
  for (const std::string& name : job.reflectance) {
    const Sequence& sequence = job.project().capture.FindSequence(name);
    unit.options += LightFingerprint(job.project().capture, sequence, 0, sequence.count);
    Append(unit.inputs, TextureInputs(job, sequence, 0, sequence.count));
  }
  unit.outputs = ReflectanceFiles(job.ReflectanceFolder());
  unit.run = [job](const ProgressFn& progress) {
    const DyxelSource source = SourceOf(job, job.reflectance);
    const Reflectance reflectance =
        FitReflectance(source, job.workspace->graph(), job.project().options.reflectance, progress);
    WriteReflectance(job.ReflectanceFolder(), job.workspace->grid(), reflectance);
  };
  return {unit};
}

std::vector<Unit> NormalUnits(const Job& job) {
  std::vector<Unit> units;
  if (job.reflectance.empty()) return units;
  PipelineOptions options = job.project().options;
  const std::string fingerprint = options.Table().Fingerprint("normals") + SurfaceOptions(job) +
                                  RigFingerprint(job.project().capture);
  for (const std::string& name : job.dynamic) {
    const Sequence& sequence = job.project().capture.FindSequence(name);
    if (!HasLamps(sequence)) continue;  // the RES's normals serve
    for (const Chunk& chunk : Chunks(sequence.count, options.normals.chunk)) {
      Unit unit;
      unit.stage = "normals";
      unit.id = job.FitId(name + "/" + Project::FrameName(sequence, chunk.centre));
      unit.options = fingerprint + fmt::format("frames={}-{}\n", chunk.begin, chunk.end) +
                     LightFingerprint(job.project().capture, sequence, chunk.begin, chunk.end);
      unit.inputs = TextureInputs(job, sequence, chunk.begin, chunk.end);
      Append(unit.inputs, ReflectanceFiles(job.ReflectanceFolder()));
      unit.outputs = {job.NormalFile(name, chunk.centre)};
      unit.run = [job, name, chunk](const ProgressFn& progress) {
        const TexelGrid& grid = job.workspace->grid();
        const Reflectance reflectance = ReadReflectance(job.ReflectanceFolder(), grid);
        const DyxelSource source = SourceOf(job, name, chunk.begin, chunk.end);
        const ChunkNormals fit = FitNormals(
            source, job.workspace->graph(), reflectance, job.project().options.normals, progress);
        WriteNormals(job.NormalFile(name, chunk.centre), grid, fit.normal, fit.confidence);
      };
      units.push_back(std::move(unit));
    }
  }
  return units;
}

// The options that a video was made with, "stage.name=value" a line.
std::string OptionsInForce(const Job& job) {
  PipelineOptions options = job.project().options;
  const OptionTable table = options.Table();
  std::string text;
  for (const OptionRow& row : table.rows()) {
    if (row.key.starts_with("render.")) continue;  // no part of what is made
    text += row.key + "=" + FormatOption(row.Value()) + "\n";
  }
  return text + SurfaceOptions(job) + fmt::format("scale={}\n", job.project().inputs.scale);
}

// What the stages know of their own errors, for the video's file.
std::vector<std::pair<std::string, std::string>> ProvenanceOf(const Job& job,
                                                              const RelightableVideo& video) {
  std::vector<std::pair<std::string, std::string>> entries = {
      {"options", OptionsInForce(job)},
      {"reflectance_sequences", fmt::format("{}", fmt::join(job.reflectance, ", "))}};
  if (const std::vector<double>& c = video.motion.confidence; !c.empty()) {
    const double mean = std::accumulate(c.begin(), c.end(), 0.0) / static_cast<double>(c.size());
    entries.emplace_back("motion_confidence", fmt::format("{:.4f}", mean));
    entries.emplace_back("motion_confidence_worst",
                         fmt::format("{:.4f}", *std::min_element(c.begin(), c.end())));
  }
  const Reflectance r = ReadReflectance(job.ReflectanceFolder(), job.workspace->grid());
  const auto texels = static_cast<double>(r.confidence.size());
  double confidence = 0;
  for (const float c : r.confidence) confidence += static_cast<double>(c);
  const auto filled = std::count_if(r.filled.begin(), r.filled.end(), [](int f) { return f != 0; });
  entries.emplace_back("reflectance_confidence", fmt::format("{:.4f}", confidence / texels));
  entries.emplace_back("filled_share", fmt::format("{:.4f}", static_cast<double>(filled) / texels));
  return entries;
}

std::vector<Unit> VideoUnits(const Job& job) {
  std::vector<Unit> units;
  if (!job.fit.empty()) return units;  // the video shows the project's own fit
  if (job.reflectance.empty()) return units;
  const Capture& capture = job.project().capture;
  for (const std::string& name : job.dynamic) {
    const Sequence& sequence = capture.FindSequence(name);
    Unit unit;
    unit.stage = "video";
    unit.id = name;
    unit.options = OptionsInForce(job) + fmt::format("capture={}\nfps={}\nup={} {} {}\n",
                                                     capture.name,
                                                     capture.fps,
                                                     capture.up.x(),
                                                     capture.up.y(),
                                                     capture.up.z());
    for (int frame = 0; frame < sequence.count; ++frame) {
      Append(unit.inputs, SurfaceFiles(job, sequence, frame));
    }
    std::sort(unit.inputs.begin(), unit.inputs.end());
    unit.inputs.erase(std::unique(unit.inputs.begin(), unit.inputs.end()), unit.inputs.end());
    Append(unit.inputs, ReflectanceFiles(job.ReflectanceFolder()));
    Append(unit.inputs, NormalFiles(job, sequence));
    unit.outputs = {job.VideoFile(name)};
    unit.run = [job, name](const ProgressFn&) {
      const RelightableVideo video = AssembleVideo(job, name);
      WriteVideo(job.VideoFile(name), video, {.provenance = ProvenanceOf(job, video)});
    };
    units.push_back(std::move(unit));
  }
  return units;
}

}  // namespace

const std::vector<Stage>& Stages() {
  static const std::vector<Stage> stages = {
      {"silhouettes", "capture", "silhouettes/SEQ/CAM/0000.png", "frame", SilhouetteUnits},
      {"actor", "silhouettes/RES", "actor/", "all", ActorUnits},
      {"motion", "silhouettes/SEQ, actor", "motion/SEQ.json", "sequence", MotionUnits},
      {"atlas", "actor", "atlas/", "all", AtlasUnits},
      {"textures", "capture, motion, atlas", "textures/SEQ/", "frame", TextureUnits},
      {"reflectance", "textures/RES", "reflectance/", "all", ReflectanceUnits},
      {"registration",
       "capture, motion/DSS, reflectance",
       "registration/DSS.json",
       "sequence",
       RegistrationUnits},
      {"dss_textures", "capture, registration, atlas", "textures/DSS/", "frame", DssTextureUnits},
      {"normals", "textures/DSS, reflectance", "normals/SEQ/0000.exr", "chunk", NormalUnits},
      {"video", "motion, reflectance, normals", "video/SEQ.glb", "sequence", VideoUnits},
  };
  return stages;
}

const Stage& FindStage(const std::string& name) {
  std::string names;
  for (const Stage& stage : Stages()) {
    if (stage.name == name) return stage;
    names += (names.empty() ? "" : ", ") + std::string(stage.name);
  }
  throw Error(Fault::kUsage, fmt::format("stage {}: unknown. The stages: {}.", name, names));
}

}  // namespace dyxel
