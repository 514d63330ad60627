#include "dyxel/mesh/chart_packing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "dyxel/base/error.h"
#include "dyxel/base/parallel.h"
#include "dyxel/base/random.h"

namespace dyxel::internal {
namespace {

constexpr int kAngles = 32;
constexpr int kSearchSize = 256;  // columns while searching
constexpr double kNone = std::numeric_limits<double>::infinity();

// A chart turned to one of the angles, as the lowest and highest y of each column of texels, the
// gutter included.
struct Profile {
  Vec2d low = Vec2d::Zero();  // of the turned and scaled border's box
  std::vector<float> bottom, top;
};

double AngleOf(int index) { return 2 * kPiD * index / kAngles; }

Vec2d Turn(const Vec2d& p, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c * p.x() - s * p.y(), s * p.x() + c * p.y()};
}

// The direction of the longest side of the least rectangle around the points, so that angle 0 lies
// along it.
double PrincipalAngle(const std::vector<Vec2d>& border) {
  double best_area = kNone, best_angle = 0;
  for (int i = 0; i < 180; ++i) {
    const double angle = kPiD * i / 180;
    Vec2d low(kNone, kNone), high(-kNone, -kNone);
    for (const Vec2d& p : border) {
      const Vec2d q = Turn(p, angle);
      low = low.cwiseMin(q);
      high = high.cwiseMax(q);
    }
    const Vec2d extent = high - low;
    if (extent.prod() < best_area * (1 - 1e-9)) {
      best_area = extent.prod();
      best_angle = extent.x() >= extent.y() ? angle : angle + kPiD / 2;
    }
  }
  return best_angle;
}

Profile MakeProfile(const std::vector<Vec2d>& border, double angle, double scale, double gutter) {
  std::vector<Vec2d> points;
  points.reserve(border.size());
  Vec2d low(kNone, kNone), high(-kNone, -kNone);
  for (const Vec2d& p : border) {
    points.push_back(scale * Turn(p, angle));
    low = low.cwiseMin(points.back());
    high = high.cwiseMax(points.back());
  }
  const int columns = static_cast<int>(std::ceil(high.x() - low.x() + 1e-9));
  std::vector<float> bottom(static_cast<std::size_t>(columns), std::numeric_limits<float>::max());
  std::vector<float> top(static_cast<std::size_t>(columns), -std::numeric_limits<float>::max());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vec2d a = points[i] - low, b = points[(i + 1) % points.size()] - low;
    if (a.x() > b.x()) std::swap(a, b);
    const int first = std::clamp(static_cast<int>(a.x()), 0, columns - 1);
    const int last = std::clamp(static_cast<int>(b.x()), 0, columns - 1);
    for (int c = first; c <= last; ++c) {
      const double width = std::max(b.x() - a.x(), 1e-12);
      for (const double x :
           {std::max(a.x(), static_cast<double>(c)), std::min(b.x(), static_cast<double>(c + 1))}) {
        const double t = std::clamp((x - a.x()) / width, 0.0, 1.0);
        const auto y = static_cast<float>(a.y() + t * (b.y() - a.y()));
        bottom[c] = std::min(bottom[c], y);
        top[c] = std::max(top[c], y);
      }
    }
  }
  // The gutter: half of it on every side of every chart.
  const double pad = gutter / 2;
  const int reach = static_cast<int>(std::ceil(pad));
  Profile profile;
  profile.low = low - Vec2d(reach, pad);
  profile.bottom.assign(static_cast<std::size_t>(columns + 2 * reach),
                        std::numeric_limits<float>::max());
  profile.top.assign(profile.bottom.size(), -std::numeric_limits<float>::max());
  for (int c = 0; c < columns; ++c) {
    for (int r = 0; r <= 2 * reach; ++r) {
      profile.bottom[c + r] = std::min(profile.bottom[c + r], bottom[c]);
      profile.top[c + r] = std::max(profile.top[c + r], top[c] + static_cast<float>(2 * pad));
    }
  }
  return profile;
}

struct Plan {
  std::vector<int> order;  // charts in the order in which they fall
  std::vector<int> angle;  // (charts) index
};

// Lets the charts fall; the height reached, infinite if one is wider than the strip. Writes the
// places if asked.
double Drop(const Plan& plan,
            const std::vector<std::vector<Profile>>& profiles,
            int width,
            std::vector<float>& skyline,
            std::vector<Vec2d>* places) {
  skyline.assign(static_cast<std::size_t>(width), 0.0F);
  double height = 0;
  for (const int chart : plan.order) {
    const Profile& profile = profiles[chart][plan.angle[chart]];
    const int columns = static_cast<int>(profile.bottom.size());
    if (columns > width) return kNone;
    const float extent = *std::max_element(profile.top.begin(), profile.top.end());
    float best_score = std::numeric_limits<float>::max(), best_y = 0;
    int best_x = 0;
    for (int x = 0; x + columns <= width; ++x) {
      float y = 0;
      for (int c = 0; c < columns; ++c) y = std::max(y, skyline[x + c] - profile.bottom[c]);
      if (y + extent < best_score) {
        best_score = y + extent;
        best_y = y;
        best_x = x;
      }
    }
    for (int c = 0; c < columns; ++c) skyline[best_x + c] = best_y + profile.top[c];
    height = std::max(height, static_cast<double>(best_score));
    if (places) (*places)[chart] = Vec2d(best_x, best_y) - profile.low;
  }
  return height;
}

}  // namespace

Packing PackCharts(std::span<const std::vector<Vec2d>> borders,
                   int size,
                   int gutter,
                   int trials,
                   std::uint64_t seed) {
  const int n = static_cast<int>(borders.size());
  std::vector<double> base_angle(static_cast<std::size_t>(n));
  std::vector<double> area(static_cast<std::size_t>(n), 0);
  for (int i = 0; i < n; ++i) {
    base_angle[i] = PrincipalAngle(borders[i]);
    const std::vector<Vec2d>& b = borders[i];
    for (std::size_t k = 0; k < b.size(); ++k) {
      const Vec2d &p = b[k], &q = b[(k + 1) % b.size()];
      area[i] += (p.x() * q.y() - q.x() * p.y()) / 2;
    }
    area[i] = std::abs(area[i]);
  }
  const double total = std::accumulate(area.begin(), area.end(), 0.0);
  Require(total > 0, Fault::kStage, "the charts have no area");

  std::vector<std::vector<Profile>> profiles(static_cast<std::size_t>(n),
                                             std::vector<Profile>(kAngles));
  const auto make_profiles = [&](double scale, double pad) {
    ParallelFor(static_cast<std::size_t>(n) * kAngles, [&](std::size_t i) {
      profiles[i / kAngles][i % kAngles] = MakeProfile(
          borders[i / kAngles], base_angle[i / kAngles] + AngleOf(i % kAngles), scale, pad);
    });
  };

  Plan plan;
  plan.order.resize(static_cast<std::size_t>(n));
  std::iota(plan.order.begin(), plan.order.end(), 0);
  std::stable_sort(
      plan.order.begin(), plan.order.end(), [&](int a, int b) { return area[a] > area[b]; });
  plan.angle.assign(static_cast<std::size_t>(n), 0);
  Random random(seed);
  std::vector<float> skyline;
  const double search_gutter = static_cast<double>(gutter) * kSearchSize / size;
  const int search_width = kSearchSize - static_cast<int>(std::ceil(search_gutter));
  double scale = std::sqrt(0.5 / total) * search_width;
  // A few rounds, each at the scale at which the last one's best would just fit.
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    make_profiles(scale, search_gutter);
    double best = Drop(plan, profiles, search_width, skyline, nullptr);
    for (int trial = 0; trial < trials / kRounds; ++trial) {
      Plan other = plan;
      const auto pick = [&] { return random.Below(static_cast<std::uint32_t>(n)); };
      for (std::uint32_t change = 0; change <= random.Below(3); ++change) {
        if (random.Below(2) == 0) {
          std::swap(other.order[pick()], other.order[pick()]);
        } else {
          other.angle[pick()] = static_cast<int>(random.Below(kAngles));
        }
      }
      const double height = Drop(other, profiles, search_width, skyline, nullptr);
      if (height <= best) {
        best = height;
        plan = other;
      }
    }
    if (best < kNone) {
      scale *= std::pow(search_width / best, 0.5);
    } else {
      scale *= 0.7;
    }
  }

  // The final scale, texel by texel.
  const int width = size - gutter;
  Packing packing;
  packing.places.resize(static_cast<std::size_t>(n));
  std::vector<Vec2d> places(static_cast<std::size_t>(n));
  double fits = 0, step_up = 1.05;
  double trial_scale = scale * size / kSearchSize;
  double fails = kNone;
  for (int step = 0; step < 24; ++step) {
    for (int i = 0; i < n; ++i) {
      profiles[i][plan.angle[i]] =
          MakeProfile(borders[i], base_angle[i] + AngleOf(plan.angle[i]), trial_scale, gutter);
    }
    const double height = Drop(plan, profiles, width, skyline, &places);
    if (height <= width) {
      fits = trial_scale;
      packing.texels_per_unit = fits;
      for (int i = 0; i < n; ++i) {
        packing.places[i].angle = base_angle[i] + AngleOf(plan.angle[i]);
        packing.places[i].offset = places[i] + Vec2d::Constant(gutter / 2.0);
      }
    } else {
      fails = trial_scale;
    }
    if (fits == 0) {
      trial_scale /= step_up;
      step_up *= 1.1;
    } else {
      trial_scale = fails < kNone ? (fits + fails) / 2 : fits * 1.02;
    }
    if (fits > 0 && fails < fits * 1.0005) break;
  }
  Require(fits > 0,
          Fault::kStage,
          "the {} charts do not fit a texture of {} texels with a gutter of {}: raise atlas.size",
          n,
          size,
          gutter);
  return packing;
}

}  // namespace dyxel::internal
