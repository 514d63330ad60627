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

void MeasurePictures(const Evaluation& e,
                     const std::string& group,
                     const Sequence& sequence,
                     const std::vector<int>& cameras) {
  if (cameras.empty() || !IsLit(sequence)) return;
  Workspace& workspace = *e.job->workspace;
  const Project& project = e.job->project();
  const FrameMaps maps(e, sequence);
  const int shown_frame = sequence.count / 2;
  std::vector<PictureScore> scores(static_cast<std::size_t>(sequence.count) * cameras.size());
  for (int frame = 0; frame < sequence.count; ++frame) {
    const PosedSurface surface = workspace.Posed(sequence.name, frame);
    const ImageF normal_map = maps.NormalMap(frame);
    const RenderSurface shown{&workspace.atlas(), &surface, &maps.maps(), &normal_map};
    const PreparedLighting lighting(
        shown, LightingOf(project.capture, sequence, frame), project.options.render);
    ParallelFor(cameras.size(), [&](std::size_t i) {
      const int c = cameras[i];
      const Camera& camera = project.capture.cameras[static_cast<std::size_t>(c)];
      if (!HasFrame(project.capture, sequence, c, frame)) return;
      const ImageF recorded = ReadFrame(project.capture, sequence, c, frame).image;
      const ImageU8 mask = RecordedMask(e, sequence, c, frame);
      const std::vector<Pass> beauty = {Pass::kBeauty};
      const ImageF rendered =
          RenderPasses(shown, camera, lighting, beauty, project.options.render)[0];
      PictureScore& score = scores[static_cast<std::size_t>(frame) * cameras.size() + i];
      const PictureMeasures measures = MeasurePicture(
          Colours(rendered), CoverageMask(rendered), recorded, mask, /*aligned=*/true);
      score = {true,
               measures.psnr,
               measures.psnr_inside,
               measures.inside_share,
               measures.psnr_linear,
               measures.psnr_aligned,
               measures.ssim};
      if (frame == shown_frame && (i == 0 || i == cameras.size() / 2)) {
        const std::string file = fmt::format("pictures/{}{}_{}_{}_{}.png",
                                             e.job->fit.empty() ? "" : e.job->fit + "_",
                                             group,
                                             sequence.name,
                                             camera.name,
                                             Project::FrameName(sequence, frame));
        WritePng(e.output / file,
                 SideBySide(recorded, rendered, mask, DisplayScale(recorded, mask)));
      }
    });
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      if (frame != shown_frame || !(i == 0 || i == cameras.size() / 2)) continue;
      const std::string& camera =
          project.capture.cameras[static_cast<std::size_t>(cameras[i])].name;
      const std::string fit = e.job->fit.empty() ? "" : e.job->fit + "_";
      e.pictures->push_back(
          {fmt::format("{}{}.{}, {}, frame {}: {:.1f} dB inside",
                       e.job->fit.empty() ? "" : "fit " + e.job->fit + ": ",
                       group,
                       sequence.name,
                       camera,
                       Project::FrameName(sequence, frame),
                       scores[static_cast<std::size_t>(frame) * cameras.size() + i].psnr_inside),
           fmt::format("pictures/{}{}_{}_{}_{}.png",
                       fit,
                       group,
                       sequence.name,
                       camera,
                       Project::FrameName(sequence, frame))});
    }
  }
  const auto mean = [&](double PictureScore::*field) {
    Series series;
    for (const PictureScore& s : scores) {
      if (s.measured && std::isfinite(s.*field)) series.Add(s.*field);
    }
    return series.Mean();
  };
  const std::string key = group + "." + sequence.name + ".";
  e.metrics->Set(key + "psnr", mean(&PictureScore::psnr));
  e.metrics->Set(key + "psnr_inside", mean(&PictureScore::psnr_inside));
  e.metrics->Set(key + "inside_share", mean(&PictureScore::inside_share));
  e.metrics->Set(key + "psnr_linear", mean(&PictureScore::psnr_linear));
  e.metrics->Set(key + "psnr_aligned", mean(&PictureScore::psnr_aligned));
  e.metrics->Set(key + "ssim", mean(&PictureScore::ssim));
}

}  // namespace dyxel
