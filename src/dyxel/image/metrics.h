// The picture measures, docs/method.md (M1)-(M5) and (M7), as pure functions.
//
// Everywhere: `rendered` and `recorded` are [h][w][3] linear radiance of one size, `rendered_mask`
// and `mask` [h][w][1] with values from 128 inside; pixels where `recorded` is NaN count nowhere. A
// measure without a single pixel is NaN. Signal-to-noise ratios end at 100 dB.
#pragma once

#include <vector>

#include "dyxel/image/image.h"

namespace dyxel {

// 1 / the 99.5th percentile of the recorded image over the mask, channels pooled; NaN where that is
// not positive. Both images are shown with it.
[[nodiscard]] double DisplayScale(const ImageF& recorded, const ImageU8& mask);

// The mask's bounding box plus `margin` pixels, clipped to the picture; empty without a mask.
[[nodiscard]] Rect CropOf(const ImageU8& mask, int margin = 8);

struct PictureMeasures {
  double psnr = 0;          // over the union; where only one has the person, the other is black
  double psnr_inside = 0;   // over the intersection
  double inside_share = 0;  // the intersection's share of the mask
  double psnr_linear = 0;   // as psnr_inside, on the clamped linear values
  double psnr_aligned = 0;  // as psnr_inside, the rendering moved by its flow to the recorded image
  double ssim = 0;          // luminance of the two on black, 11x11 Gaussian, mean over the crop
  double iou = 0;
};

// All of them. `aligned` = false leaves psnr_aligned NaN and saves its optical flow.
[[nodiscard]] PictureMeasures MeasurePicture(const ImageF& rendered,
                                             const ImageU8& rendered_mask,
                                             const ImageF& recorded,
                                             const ImageU8& mask,
                                             bool aligned = true);

// One by one; `scale` is DisplayScale's.
[[nodiscard]] double Psnr(const ImageF& rendered,
                          const ImageU8& rendered_mask,
                          const ImageF& recorded,
                          const ImageU8& mask,
                          double scale);
[[nodiscard]] double PsnrInside(const ImageF& rendered,
                                const ImageU8& rendered_mask,
                                const ImageF& recorded,
                                const ImageU8& mask,
                                double scale);
[[nodiscard]] double PsnrLinear(const ImageF& rendered,
                                const ImageU8& rendered_mask,
                                const ImageF& recorded,
                                const ImageU8& mask,
                                double scale);
[[nodiscard]] double PsnrAligned(const ImageF& rendered,
                                 const ImageU8& rendered_mask,
                                 const ImageF& recorded,
                                 const ImageU8& mask,
                                 double scale);
[[nodiscard]] double Ssim(const ImageF& rendered,
                          const ImageU8& rendered_mask,
                          const ImageF& recorded,
                          const ImageU8& mask,
                          double scale);
[[nodiscard]] double Iou(const ImageU8& a, const ImageU8& b);
// Share of `mask` that `rendered_mask` covers.
[[nodiscard]] double InsideShare(const ImageU8& rendered_mask, const ImageU8& mask);

// −10 log10 of the mean squared difference of two images [h][w][c] over the pixels of the mask that
// are finite in both: albedo_psnr with peak 1.
[[nodiscard]] double PlainPsnr(const ImageF& a, const ImageF& b, const ImageU8& mask);

// flow_px of one picture: mean length of the optical flow from the recorded picture to `model`,
// over the pixels inside both masks where the recorded one's local deviation (luma in display
// values, smoothed by 1 px, under a Gaussian of 8 px) is above 0.05; and how many pixels those are,
// so that pictures can be pooled. On a real picture shifted by 1 to 4 px it reads 4 to 10 % too
// little.
struct FlowMeasure {
  double mean_px = 0;
  double pixels = 0;
};
[[nodiscard]] FlowMeasure MeasureFlow(const ImageF& recorded,
                                      const ImageU8& mask,
                                      const ImageF& model,
                                      const ImageU8& model_mask,
                                      double scale);

// Angles in degrees between unit normals of two passes [h][w][3], over pixels covered by both
// (length above 0.5): what normal_deg and its companions are made of. In the order of the pixels.
[[nodiscard]] std::vector<float> NormalAngles(const ImageF& a, const ImageF& b);

}  // namespace dyxel
