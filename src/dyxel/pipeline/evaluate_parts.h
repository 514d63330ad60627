// The measurements that Evaluate() is made of; docs/method.md, section M.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "dyxel/capture/truth.h"
#include "dyxel/pipeline/evaluate.h"
#include "dyxel/pipeline/metrics_file.h"
#include "dyxel/pipeline/stages.h"
#include "dyxel/video/relightable_video.h"

namespace dyxel {

// A picture of the report, with its place below the output folder.
struct ReportPicture {
  std::string title;
  std::string file;
};

// What all measurements of one fit share.
struct Evaluation {
  const Job* job = nullptr;
  const Truth* truth = nullptr;  // or none
  std::filesystem::path output;
  Metrics* metrics = nullptr;
  std::vector<ReportPicture>* pictures = nullptr;
  // By a sequence's first texture folder: its texels that are seen throughout (flicker_deg).
  std::map<std::filesystem::path, std::vector<char>>* seen = nullptr;
  bool base_normals = false;  // shown with the model's own normals (ablation base_normals)
  ProgressFn progress = {};   // share of the measurement that is under way

  // Throws Error(kInterrupted) where the user wants to stop.
  void Progress(double done, double all) const {
    if (progress) progress(done / all);
  }
};

// Mask of a camera in a frame: the truth's where there is one, else the given or computed one.
[[nodiscard]] ImageU8 RecordedMask(const Evaluation& e,
                                   const Sequence& sequence,
                                   int camera,
                                   int frame);

// The maps that frames of a sequence are shown with: the fit's, and as normal map the DSS's keys
// for its own frames, the reflectance sequence's second pass for any other.
class FrameMaps {
 public:
  FrameMaps(const Evaluation& e, const Sequence& sequence);
  // The maps of a video's file with the second pass's normals, for a sequence that is not its own.
  explicit FrameMaps(RelightableVideo video) : video_(std::move(video)) { video_.normals.clear(); }
  [[nodiscard]] const MaterialMaps& maps() const { return video_.maps; }
  [[nodiscard]] ImageF NormalMap(int frame) const { return NormalMapAt(video_, frame); }

 private:
  RelightableVideo video_;
};

// silhouette.SEQ.…: against the truth's masks; nothing without a truth.
void MeasureSilhouettes(const Evaluation& e, const Sequence& sequence);
// tracking.SEQ.{iou, iou_worst, surface_mm, surface_p95_mm}.
void MeasureTracking(const Evaluation& e, const Sequence& sequence);
// tracking.SEQ.flow_px, where the sequence has textures.
void MeasureAlignment(const Evaluation& e, const Sequence& sequence);
// atlas.{I,II}.…
void MeasureAtlases(const Evaluation& e);
// GROUP.SEQ.{psnr, …}: recorded beside rendered pictures of `cameras`.
void MeasurePictures(const Evaluation& e,
                     const std::string& group,
                     const Sequence& sequence,
                     const std::vector<int>& cameras);
// normals.SEQ.… and albedo.SEQ.albedo_psnr, against the truth's passes.
void MeasurePasses(const Evaluation& e, const Sequence& sequence);
// The mean of psnr_inside over pictures of `cameras`, shown with other maps than the fit's.
[[nodiscard]] double PsnrInsideWith(const Evaluation& e,
                                    const FrameMaps& maps,
                                    const Sequence& sequence,
                                    const std::vector<int>& cameras);
// normals.SEQ.flicker_deg, of a DSS with normal keys.
void MeasureFlicker(const Evaluation& e, const Sequence& sequence);
// Mean length of the second difference over time of a vector a texel.
class Flicker {
 public:
  // The next frame's (K) vectors.
  void Add(std::span<const Vec3f> vectors);
  // Over the texels `counted` (K, not 0). NaN with fewer than three frames.
  [[nodiscard]] double MeanDeg(std::span<const char> counted) const;

 private:
  int frames_ = 0;
  std::vector<Vec3f> older_, last_;
  std::vector<double> sum_;
};
// coverage.{texels, half_vectors} and materials.NAME.…
void MeasureReflectance(const Evaluation& e);
// video.{bytes, bytes_per_frame, raw_bytes, psnr_loss}, over all videos. Reads the relight figures.
void MeasureVideo(const Evaluation& e);

}  // namespace dyxel
