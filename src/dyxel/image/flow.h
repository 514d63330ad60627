// Dense optical flow (OpenCV's DIS, preset "medium": Kroeger et al. 2016), and the contrast
// normalisation that keeps highlights from fooling it.
//
// OpenCV runs on one thread: DIS's result depends on its number of threads. Call these for several
// pictures at once instead.
#pragma once

#include "dyxel/image/image.h"

namespace dyxel {

// The flow [h][w][2] in pixels with from(x, y) ≈ to(x + u, y + v). Both [h][w][1], of one size,
// values in [0, 1] (clamped; quantised to 8 bits). Accurate to about 0.1 px on textured pictures.
[[nodiscard]] ImageF OpticalFlow(const ImageF& from, const ImageF& to);

// 0.5 + 0.2 · (value − local mean) / (local deviation + 0.01), clamped to [0, 1], with mean and
// deviation under a Gaussian of `sigma` pixels over the pixels inside `mask` (255; an empty mask is
// everywhere); 0.5 outside. `image` is [h][w][1] in display values.
// `deviation`, where given, becomes the local deviation [h][w][1] (0 outside).
[[nodiscard]] ImageF NormaliseContrast(const ImageF& image,
                                       const ImageU8& mask,
                                       float sigma = 8,
                                       ImageF* deviation = nullptr);

// `image` looked up where the flow points, bilinear and clamped at the border: result(x, y) =
// image(x + u, y + v), with the vector (u, v) shortened to `max_length` pixels.
[[nodiscard]] ImageF WarpByFlow(const ImageF& image, const ImageF& flow, float max_length);

// Each channel under a Gaussian of `sigma` pixels (cut at 3 sigma, mirrored at the border).
[[nodiscard]] ImageF Blur(const ImageF& image, float sigma);

}  // namespace dyxel
