#include "dyxel/tracking/silhouettes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>
#include <opencv2/imgproc/detail/gcgraph.hpp>

#include "dyxel/base/error.h"
#include "dyxel/tracking/plate_noise.h"

namespace dyxel {
namespace {

// What a pixel's colours say by themselves.
enum Evidence : std::uint8_t {
  kPlate = 0,  // the plate, and something else would show
  kUnknown,    // plate and picture both black: the person's dark side would look the same
  kShadow,     // the plate's colour, darker
  kPerson,
};

// Lossy files and lenses spread a little of a bright pixel around it: this share of the brightest
// within kSpread pixels is noise too.
constexpr float kGlare = 0.002F;
constexpr int kSpread = 6;

struct Reading {
  cv::Mat1b evidence;
  cv::Mat1f belief;  // how strongly the picture speaks for the plate (or its shadow), in [0, 1]
  cv::Mat1b lit;     // 255: the picture is not black
};

// A shadow takes away one lamp of several, so its colour may differ from the plate's by this much.
constexpr float kShadowTint = 0.15F;
// A plate this many deviations bright that is matched by the picture is hardly a coincidence.
constexpr float kSureLevel = 60;
// A shadow as black as this may hide a person.
constexpr float kDarkBelief = 0.04F;
// Costs of calling a pixel the person, in lengths of boundary (pixels).
constexpr float kPriorPlate = 0.1F;  // where nothing speaks for either
constexpr float kBeliefCost = 4;     // where the plate surely shows

Reading ReadEvidence(const ImageF& picture,
                     const ImageF& plate,
                     const PlateNoise& noise,
                     const SilhouetteOptions& options) {
  Reading r{cv::Mat1b(picture.height, picture.width),
            cv::Mat1f(picture.height, picture.width),
            cv::Mat1b(picture.height, picture.width)};
  cv::Mat1f glare(picture.height, picture.width);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const float* p = &picture.data[picture.Index(x, y)];
      const float v = std::max({p[0], p[1], p[2]});
      glare(y, x) = std::isfinite(v) ? kGlare * std::max(v, 0.0F) : 0;
    }
  }
  cv::dilate(
      glare, glare, cv::getStructuringElement(cv::MORPH_RECT, {2 * kSpread + 1, 2 * kSpread + 1}));
  const auto sigmas = static_cast<float>(options.noise_threshold);
  const float threshold = sigmas * sigmas;
  const auto least_ratio = static_cast<float>(1 - options.shadow_tolerance);
  const float black = sigmas * std::sqrt(noise.Variance(0));
  for (int y = 0; y < picture.height; ++y) {
    const float* p = &picture.data[picture.Index(0, y)];
    const float* b = &plate.data[plate.Index(0, y)];
    for (int x = 0; x < picture.width; ++x, p += 3, b += 3) {
      float worst = 0, level = 0, pb = 0, bb = 0, deviation = 0;
      const float spread = glare(y, x) * glare(y, x);
      bool darker = true;
      bool valid = true;
      for (int c = 0; c < 3; ++c) {
        valid &= std::isfinite(p[c]) && std::isfinite(b[c]);
        const float variance = noise.Variance(std::max(b[c], 0.0F)) + spread;
        const float d = p[c] - b[c];
        worst = std::max(worst, d * d / variance);
        darker &= d < 3 * std::sqrt(variance);
        level = std::max(level, b[c] / std::sqrt(variance));
        pb += p[c] * b[c] / variance;
        bb += b[c] * b[c] / variance;
      }
      Evidence e = kPerson;
      float belief = 0;
      if (!valid) {
        e = kUnknown;
      } else if (worst <= threshold) {
        belief = std::min(1.0F, level / kSureLevel);
        e = level > 3 * sigmas ? kPlate : kUnknown;
      } else if (darker && pb >= least_ratio * bb) {
        const float ratio = std::max(0.0F, pb / bb);
        for (int c = 0; c < 3; ++c) {
          const float expected = ratio * b[c];
          const float allowed =
              sigmas * std::sqrt(noise.Variance(std::max(expected, 0.0F)) + spread) +
              kShadowTint * std::max(expected, 0.0F);
          deviation = std::max(deviation, std::abs(p[c] - expected) / allowed);
        }
        if (deviation <= 1) {
          e = kShadow;
          belief = std::min(1.0F, 0.5F * ratio * level / kSureLevel);
        }
      }
      r.evidence(y, x) = e;
      r.belief(y, x) = belief;
      r.lit(y, x) = std::max({p[0], p[1], p[2]}) > black ? 255 : 0;
    }
  }
  return r;
}

cv::Mat Disc(int radius) {
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1});
}

// Drops components of fewer than 4 pixels or a 4000th of the largest's: what is left may still be
// in pieces, which the cut joins. False where the largest has fewer than 20.
bool DropSpecks(cv::Mat1b& mask) {
  cv::Mat labels, stats, centroids;
  const int n = cv::connectedComponentsWithStats(mask, labels, stats, centroids, 8);
  int largest = 0;
  for (int i = 1; i < n; ++i) largest = std::max(largest, stats.at<int>(i, cv::CC_STAT_AREA));
  const int least = std::max(4, largest / 4000);
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const int l = labels.at<int>(y, x);
      if (l > 0 && stats.at<int>(l, cv::CC_STAT_AREA) < least) mask(y, x) = 0;
    }
  }
  return largest >= 20;
}

// Keeps the 8-connected component with the most lit pixels (of a black shadow and a person, the
// person), and others of at least a fiftieth of its area that come as near as a belt in the dark is
// wide. False where there is none.
bool KeepPerson(cv::Mat1b& mask, const cv::Mat1b& lit) {
  cv::Mat labels, stats, centroids;
  const int n = cv::connectedComponentsWithStats(mask, labels, stats, centroids, 8);
  if (n < 2) return false;
  std::vector<int> count(static_cast<std::size_t>(n), 0);
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (lit(y, x) != 0) ++count[static_cast<std::size_t>(labels.at<int>(y, x))];
    }
  }
  int best = 1;
  for (int i = 2; i < n; ++i) {
    const auto rank = [&](int l) {
      return std::pair(count[static_cast<std::size_t>(l)], stats.at<int>(l, cv::CC_STAT_AREA));
    };
    if (rank(i) > rank(best)) best = i;
  }
  const int area = stats.at<int>(best, cv::CC_STAT_AREA);
  std::vector<bool> keep(static_cast<std::size_t>(n), false);
  keep[static_cast<std::size_t>(best)] = true;
  bool others = false;
  for (int i = 1; i < n; ++i) others |= i != best && stats.at<int>(i, cv::CC_STAT_AREA) * 50 > area;
  if (others) {
    cv::Mat1b near;
    cv::dilate(labels == best, near, Disc(std::max(2, mask.rows / 40)));
    for (int y = 0; y < mask.rows; ++y) {
      for (int x = 0; x < mask.cols; ++x) {
        const int l = labels.at<int>(y, x);
        if (l != 0 && near(y, x) != 0 && stats.at<int>(l, cv::CC_STAT_AREA) * 50 > area) {
          keep[static_cast<std::size_t>(l)] = true;
        }
      }
    }
  }
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (!keep[static_cast<std::size_t>(labels.at<int>(y, x))]) mask(y, x) = 0;
    }
  }
  return true;
}

// Decides the pixels within `reach` of the sure person that could be either by a minimal cut
// (Boykov and Kolmogorov 2004): the person costs a pixel its belief in the plate, and a boundary
// costs its length, less where the picture has an edge that the plate has not.
void CutUnsure(cv::Mat1b& mask,
               const ImageF& picture,
               const ImageF& plate,
               const Reading& reading,
               const PlateNoise& noise,
               int reach) {
  cv::Mat1b near;
  cv::dilate(mask, near, Disc(reach));
  cv::Mat1i node(mask.rows, mask.cols, -1);
  int count = 0;
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (near(y, x) == 0 || mask(y, x) != 0 || reading.evidence(y, x) == kPlate) continue;
      node(y, x) = count++;
    }
  }
  if (count == 0) return;
  cv::detail::GCGraph<float> graph(static_cast<unsigned>(count), static_cast<unsigned>(4 * count));
  const auto edge = [&](int x, int y, int u, int v) {
    float contrast = 0;
    for (int c = 0; c < 3; ++c) {
      const float d =
          (picture.At(x, y, c) - plate.At(x, y, c)) - (picture.At(u, v, c) - plate.At(u, v, c));
      const float level = std::max({picture.At(x, y, c), picture.At(u, v, c), 0.0F});
      contrast = std::max(contrast, d * d / noise.Variance(level));
    }
    if (!std::isfinite(contrast)) contrast = 0;
    return 0.15F + 0.85F / (1 + contrast / 40);
  };
  constexpr std::array<std::array<int, 2>, 8> kNeighbours = {
      {{1, 0}, {0, 1}, {1, 1}, {-1, 1}, {-1, 0}, {0, -1}, {-1, -1}, {1, -1}}};
  for (int i = 0; i < count; ++i) graph.addVtx();
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (node(y, x) < 0) continue;
      float to_person = reading.evidence(y, x) == kPerson ? 1.0F : 0.0F;
      float to_plate = reading.evidence(y, x) == kPerson
                           ? 0.0F
                           : kPriorPlate + kBeliefCost * reading.belief(y, x);
      for (std::size_t k = 0; k < kNeighbours.size(); ++k) {
        const int u = x + kNeighbours[k][0];
        const int v = y + kNeighbours[k][1];
        if (u < 0 || v < 0 || u >= mask.cols || v >= mask.rows) continue;
        const float w = edge(x, y, u, v) * (k == 0 || k == 1 || k == 4 || k == 5 ? 1.0F : 0.7071F);
        if (mask(v, u) != 0) {
          to_person += w;
        } else if (node(v, u) < 0) {
          to_plate += w;
        } else if (k < 4) {
          graph.addEdges(node(y, x), node(v, u), w, w);
        }
      }
      graph.addTermWeights(node(y, x), to_person, to_plate);
    }
  }
  graph.maxFlow();
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (node(y, x) >= 0 && graph.inSourceSegment(node(y, x))) mask(y, x) = 255;
    }
  }
}

// Fills holes that hold little sure plate. A hole against a black wall is told from the person's
// dark side by its mean over all its pixels, which one pixel's noise hides.
void FillHoles(cv::Mat1b& mask,
               const ImageF& picture,
               const ImageF& plate,
               const Reading& reading,
               const PlateNoise& noise,
               const SilhouetteOptions& options) {
  cv::Mat1b outside = ~mask;
  cv::Mat labels, stats, centroids;
  const int n = cv::connectedComponentsWithStats(outside, labels, stats, centroids, 4);
  struct Hole {
    bool border = false;
    int area = 0, plate = 0, shadow = 0;
    std::array<double, 3> residual{};
    double variance = 0;
  };
  std::vector<Hole> holes(static_cast<std::size_t>(n));
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const int l = labels.at<int>(y, x);
      if (l == 0) continue;
      Hole& h = holes[static_cast<std::size_t>(l)];
      ++h.area;
      if (x == 0 || y == 0 || x == mask.cols - 1 || y == mask.rows - 1) h.border = true;
      const auto e = reading.evidence(y, x);
      if (e == kPlate) ++h.plate;
      if (e == kShadow) ++h.shadow;
      if (e != kUnknown) continue;
      for (int c = 0; c < 3; ++c) {
        const float v = picture.At(x, y, c) - plate.At(x, y, c);
        if (!std::isfinite(v)) continue;
        h.residual[static_cast<std::size_t>(c)] += static_cast<double>(v);
        if (c == 1)
          h.variance += static_cast<double>(noise.Variance(std::max(0.0F, plate.At(x, y, c))));
      }
    }
  }
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const int l = labels.at<int>(y, x);
      if (l == 0) continue;
      const Hole& h = holes[static_cast<std::size_t>(l)];
      if (h.border) continue;
      bool fill = h.area < 40;
      if (!fill && h.plate * 3 < h.area) {
        double z = 0;
        for (const double s : h.residual) z = std::max(z, s * s);
        const bool black_agrees =
            h.variance > 0 && z < options.noise_threshold * options.noise_threshold * h.variance;
        fill = !black_agrees && 2 * h.shadow < h.area;
      }
      if (fill) mask(y, x) = 255;
    }
  }
}

// Decides the pixels along the boundary by coverage: a = (p - b)·(f - b) / |f - b|² with the
// person's colour f just inside, so that the mask holds the pixels covered by at least one half.
void RefineBoundary(cv::Mat1b& mask,
                    const ImageF& picture,
                    const ImageF& plate,
                    const PlateNoise& noise,
                    const SilhouetteOptions& options) {
  const cv::Mat1b before = mask.clone();
  cv::Mat1b core, grown;
  cv::erode(before, core, Disc(1));
  cv::erode(core, core, cv::getStructuringElement(cv::MORPH_CROSS, {3, 3}));
  cv::dilate(before, grown, cv::getStructuringElement(cv::MORPH_CROSS, {3, 3}));
  const int reach = 4;
  const auto threshold = static_cast<float>(options.noise_threshold * options.noise_threshold);
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      if (grown(y, x) == 0 || core(y, x) != 0) continue;
      std::array<float, 3> inside{}, outside{};
      float wi = 0, wo = 0;
      for (int v = std::max(0, y - reach); v <= std::min(mask.rows - 1, y + reach); ++v) {
        for (int u = std::max(0, x - reach); u <= std::min(mask.cols - 1, x + reach); ++u) {
          const int d2 = (u - x) * (u - x) + (v - y) * (v - y);
          if (d2 > reach * reach) continue;
          const float w = 1.0F / static_cast<float>(1 + d2 * d2);
          if (core(v, u) != 0) {
            for (int c = 0; c < 3; ++c) {
              inside[static_cast<std::size_t>(c)] += w * std::max(0.0F, picture.At(u, v, c));
            }
            wi += w;
          } else if (grown(v, u) == 0) {
            // What is behind the boundary is the picture beside it (plate or shadow).
            for (int c = 0; c < 3; ++c) {
              outside[static_cast<std::size_t>(c)] += w * std::max(0.0F, picture.At(u, v, c));
            }
            wo += w;
          }
        }
      }
      if (wi == 0) continue;
      float num = 0, den = 0, contrast = 0, brightest = 0;
      for (int c = 0; c < 3; ++c) {
        const float b = wo > 0 ? outside[static_cast<std::size_t>(c)] / wo : plate.At(x, y, c);
        const float f = inside[static_cast<std::size_t>(c)] / wi;
        const float p = picture.At(x, y, c);
        const float variance = noise.Variance(std::max(b, 0.0F));
        num += (p - b) * (f - b);
        den += (f - b) * (f - b);
        contrast = std::max(contrast, (f - b) * (f - b) / variance);
        brightest = std::max({brightest, f * f, b * b});
      }
      if (contrast < 4 * threshold || den < 0.4F * brightest || !std::isfinite(num))
        continue;  // keeps what it was
      mask(y, x) = num >= 0.5F * den ? 255 : 0;
    }
  }
}

}  // namespace

ImageU8 ExtractSilhouette(const ImageF& picture,
                          std::span<const ImageF> plates,
                          const SilhouetteOptions& options) {
  CheckOptions("silhouettes", options);
  Require(!plates.empty(),
          Fault::kInput,
          "a silhouette needs a background plate; add \"background\" or \"masks\" to the sequence");
  for (const ImageF& plate : plates) {
    Require(plate.width == picture.width && plate.height == picture.height && plate.channels == 3 &&
                picture.channels == 3,
            Fault::kInput,
            "picture {}x{} and background plate {}x{} differ in size",
            picture.width,
            picture.height,
            plate.width,
            plate.height);
  }
  const ImageF plate = plates.size() == 1 ? plates[0] : MeanPlate(plates);
  const PlateNoise noise = FitPlateNoise(picture, plate, plates);
  const Reading reading = ReadEvidence(picture, plate, noise, options);

  cv::Mat1b person = (reading.evidence == static_cast<int>(kPerson));
  // Speckle: a person pixel has person pixels around it.
  cv::Mat1b open;
  cv::morphologyEx(person, open, cv::MORPH_OPEN, cv::getStructuringElement(cv::MORPH_RECT, {2, 2}));
  cv::Mat1b mask = open;
  if (!DropSpecks(mask)) return ImageU8(picture.width, picture.height, 1);
  CutUnsure(mask, picture, plate, reading, noise, 12);
  cv::Mat1b bridges;
  cv::morphologyEx(mask, bridges, cv::MORPH_CLOSE, Disc(8));
  mask |= bridges & (reading.evidence != static_cast<int>(kPlate)) & (reading.belief < 0.2F);
  if (!KeepPerson(mask, reading.lit)) return ImageU8(picture.width, picture.height, 1);
  FillHoles(mask, picture, plate, reading, noise, options);
  RefineBoundary(mask, picture, plate, noise, options);
  if (options.smooth_radius > 0) cv::medianBlur(mask, mask, 2 * options.smooth_radius + 1);
  if (!KeepPerson(mask, reading.lit)) return ImageU8(picture.width, picture.height, 1);

  // Where neither plate nor picture shows anything, a person in the dark would not show either.
  ImageU8 out(picture.width, picture.height, 1);
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const auto e = reading.evidence(y, x);
      const bool dark = e == kUnknown || (e == kShadow && reading.belief(y, x) < kDarkBelief);
      out.At(x, y) = mask(y, x) != 0 ? kMaskPerson : dark ? kMaskUnknown : 0;
    }
  }
  return out;
}

}  // namespace dyxel
