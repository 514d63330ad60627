// Recorded beside rendered pictures.
#include <algorithm>
#include <cmath>

#include "dyxel/base/parallel.h"
#include "dyxel/image/image_io.h"
#include "dyxel/image/metrics.h"
#include "dyxel/image/sampling.h"
#include "dyxel/pipeline/evaluate_parts.h"
#include "dyxel/pipeline/reflectance_files.h"
#include "dyxel/pipeline/stage_inputs.h"
#include "dyxel/render/renderer.h"

namespace dyxel {
namespace {

struct PictureScore {
  bool measured = false;
  double psnr = 0, psnr_inside = 0, inside_share = 0, psnr_linear = 0, psnr_aligned = 0, ssim = 0;
};

// The colours and the coverage of a rendered picture, apart.
ImageF Colours(const ImageF& rendered) {
  ImageF colours(rendered.width, rendered.height, 3);
  for (std::size_t i = 0; i < colours.data.size() / 3; ++i) {
    std::copy_n(&rendered.data[4 * i], 3, &colours.data[3 * i]);
  }
  return colours;
}
ImageU8 CoverageMask(const ImageF& rendered) {
  ImageU8 mask(rendered.width, rendered.height, 1);
  for (std::size_t i = 0; i < mask.data.size(); ++i) {
    mask.data[i] = rendered.data[4 * i + 3] >= 0.5F ? 255 : 0;
  }
  return mask;
}

// Lighting of a frame: its lamps, or its environment.
Lighting LightingOf(const Capture& capture, const Sequence& sequence, int frame) {
  Lighting lighting;
  if (sequence.environment) {
    lighting.environment = LoadEnvironment(capture, *sequence.environment);
  } else {
    lighting.lights = capture.LightsOf(sequence, frame);
  }
  return lighting;
}

// Recorded, rendered, and twice their difference around grey, side by side, cropped to the person.
ImageU8 SideBySide(const ImageF& recorded,
                   const ImageF& rendered,
                   const ImageU8& mask,
                   double scale) {
  int x0 = mask.width, y0 = mask.height, x1 = 0, y1 = 0;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.At(x, y) < 128 && rendered.At(x, y, 3) == 0) continue;
      x0 = std::min(x0, x);
      x1 = std::max(x1, x + 1);
      y0 = std::min(y0, y);
      y1 = std::max(y1, y + 1);
    }
  }
  const int w = std::max(0, x1 - x0);
  const int h = std::max(0, y1 - y0);
  ImageU8 sheet(3 * w, h, 3);
  const auto encode = [&](float radiance) {
    return SrgbFromLinear(std::clamp(radiance * static_cast<float>(scale), 0.0F, 1.0F));
  };
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const bool inside = mask.At(x + x0, y + y0) >= 128;
      for (int c = 0; c < 3; ++c) {
        const float a = encode(recorded.At(x + x0, y + y0, c));
        const float b = encode(rendered.At(x + x0, y + y0, c));
        const bool either = inside || rendered.At(x + x0, y + y0, 3) > 0;
        const float difference =
            either ? std::clamp(0.5F + 2 * (b - (inside ? a : 0.0F)), 0.0F, 1.0F) : 0.5F;
        sheet.At(x, y, c) = static_cast<std::uint8_t>(std::lround(255 * a));
        sheet.At(w + x, y, c) = static_cast<std::uint8_t>(std::lround(255 * b));
        sheet.At(2 * w + x, y, c) = static_cast<std::uint8_t>(std::lround(255 * difference));
      }
    }
  }
  return sheet;
}

}  // namespace

FrameMaps::FrameMaps(const Evaluation& e, const Sequence& sequence) {
  video_.maps = ReadMaterialMaps(e.job->ReflectanceFolder());
  video_.normals = ReadNormalKeys(*e.job, sequence);
}

namespace {

// Measures all pictures of `cameras` shown with `maps`; `seen(camera index, frame, recorded,
// rendered, mask)` is called for each, from several threads.
template <class Seen>
std::vector<PictureScore> ScorePictures(const Evaluation& e,
                                        const FrameMaps& maps,
                                        const Sequence& sequence,
                                        const std::vector<int>& cameras,
                                        bool aligned,
                                        Seen&& seen) {
  Workspace& workspace = *e.job->workspace;
  const Project& project = e.job->project();
  std::vector<PictureScore> scores(static_cast<std::size_t>(sequence.count) * cameras.size());
  for (int frame = 0; frame < sequence.count; ++frame) {
    const PosedSurface surface = workspace.Posed(sequence.name, frame);
    const ImageF normal_map = maps.NormalMap(frame);
    const RenderSurface shown{
        &workspace.atlas(), &surface, &maps.maps(), e.base_normals ? nullptr : &normal_map};
    const PreparedLighting lighting(
        shown, LightingOf(project.capture, sequence, frame), project.options.render);
    ParallelFor(cameras.size(), [&](std::size_t i) {
      e.Progress(frame, sequence.count);
      const int c = cameras[i];
      const Camera& camera = project.capture.cameras[static_cast<std::size_t>(c)];
      if (!HasFrame(project.capture, sequence, c, frame)) return;
      const ImageF recorded = ReadFrame(project.capture, sequence, c, frame).image;
      const ImageU8 mask = RecordedMask(e, sequence, c, frame);
      const std::vector<Pass> beauty = {Pass::kBeauty};
      const ImageF rendered =
          RenderPasses(shown, camera, lighting, beauty, project.options.render)[0];
      const PictureMeasures m =
          MeasurePicture(Colours(rendered), CoverageMask(rendered), recorded, mask, aligned);
      scores[static_cast<std::size_t>(frame) * cameras.size() + i] = {
          true, m.psnr, m.psnr_inside, m.inside_share, m.psnr_linear, m.psnr_aligned, m.ssim};
      seen(i, frame, recorded, rendered, mask);
    });
  }
  return scores;
}

double MeanOf(const std::vector<PictureScore>& scores, double PictureScore::*field) {
  Series series;
  for (const PictureScore& s : scores) {
    if (s.measured && std::isfinite(s.*field)) series.Add(s.*field);
  }
  return series.Mean();
}

}  // namespace

double PsnrInsideWith(const Evaluation& e,
                      const FrameMaps& maps,
                      const Sequence& sequence,
                      const std::vector<int>& cameras) {
  return MeanOf(ScorePictures(e, maps, sequence, cameras, /*aligned=*/false, [](auto&&...) {}),
                &PictureScore::psnr_inside);
}

void MeasurePictures(const Evaluation& e,
                     const std::string& group,
                     const Sequence& sequence,
                     const std::vector<int>& cameras) {
  if (cameras.empty() || !IsLit(sequence)) return;
  const Capture& capture = e.job->project().capture;
  const int shown_frame = sequence.count / 2;
  const auto is_shown = [&](std::size_t i) { return i == 0 || i == cameras.size() / 2; };
  const auto file_of = [&](std::size_t i) {
    return fmt::format("pictures/{}{}_{}_{}_{}.png",
                       e.job->fit.empty() ? "" : e.job->fit + "_",
                       group,
                       sequence.name,
                       capture.cameras[static_cast<std::size_t>(cameras[i])].name,
                       Project::FrameName(sequence, shown_frame));
  };
  const std::vector<PictureScore> scores =
      ScorePictures(e,
                    FrameMaps(e, sequence),
                    sequence,
                    cameras,
                    /*aligned=*/true,
                    [&](std::size_t i,
                        int frame,
                        const ImageF& recorded,
                        const ImageF& rendered,
                        const ImageU8& mask) {
                      if (e.pictures == nullptr || frame != shown_frame || !is_shown(i)) return;
                      WritePng(e.output / file_of(i),
                               SideBySide(recorded, rendered, mask, DisplayScale(recorded, mask)));
                    });
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const PictureScore& score = scores[static_cast<std::size_t>(shown_frame) * cameras.size() + i];
    if (e.pictures == nullptr || !is_shown(i) || !score.measured) continue;
    e.pictures->push_back({fmt::format("{}{}.{}, {}, frame {}: {:.1f} dB inside",
                                       e.job->fit.empty() ? "" : "fit " + e.job->fit + ": ",
                                       group,
                                       sequence.name,
                                       capture.cameras[static_cast<std::size_t>(cameras[i])].name,
                                       Project::FrameName(sequence, shown_frame),
                                       score.psnr_inside),
                           file_of(i)});
  }
  const std::string key = group + "." + sequence.name + ".";
  e.metrics->Set(key + "psnr", MeanOf(scores, &PictureScore::psnr));
  e.metrics->Set(key + "psnr_inside", MeanOf(scores, &PictureScore::psnr_inside));
  e.metrics->Set(key + "inside_share", MeanOf(scores, &PictureScore::inside_share));
  e.metrics->Set(key + "psnr_linear", MeanOf(scores, &PictureScore::psnr_linear));
  e.metrics->Set(key + "psnr_aligned", MeanOf(scores, &PictureScore::psnr_aligned));
  e.metrics->Set(key + "ssim", MeanOf(scores, &PictureScore::ssim));
}

}  // namespace dyxel
