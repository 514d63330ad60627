#include "dyxel/mesh/chart_packing.h"

#include <algorithm>
#include <array>
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
      for (int c = 0; c < columns && y + extent < best_score;) {
        const int stop = std::min(columns, c + 32);
        for (; c < stop; ++c) y = std::max(y, skyline[x + c] - profile.bottom[c]);
      }
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
  std::vector<Plan> candidates;
  plan.order.resize(static_cast<std::size_t>(n));
  std::iota(plan.order.begin(), plan.order.end(), 0);
  std::stable_sort(
      plan.order.begin(), plan.order.end(), [&](int a, int b) { return area[a] > area[b]; });
  plan.angle.assign(static_cast<std::size_t>(n), 0);
  const double search_gutter = static_cast<double>(gutter) * kSearchSize / size;
  const int search_width = kSearchSize - static_cast<int>(std::ceil(search_gutter));
  double scale = std::sqrt(0.55 / total) * search_width;
  // A few rounds, each at the scale at which the last one's best would just fit. In each some
  // searches of their own, which accept what is a little worse at first.
  constexpr int kRounds = 3, kSearches = 4;
  for (int round = 0; round < kRounds; ++round) {
    make_profiles(scale, search_gutter);
    std::array<Plan, kSearches> found;
    std::array<double, kSearches> height;
    ParallelFor(kSearches, [&](std::size_t search) {
      Random random(seed, search + kSearches * static_cast<std::size_t>(round));
      std::vector<float> skyline;
      Plan now = plan;
      double now_height = Drop(now, profiles, search_width, skyline, nullptr);
      found[search] = now;
      height[search] = now_height;
      const int steps = trials / (kRounds * kSearches);
      for (int step = 0; step < steps; ++step) {
        Plan next = now;
        const auto pick = [&] { return random.Below(static_cast<std::uint32_t>(n)); };
        const std::uint32_t changes = 1 + random.Below(3);
        for (std::uint32_t change = 0; change < changes; ++change) {
          if (random.Below(2) == 0) {
            std::swap(next.order[pick()], next.order[pick()]);
          } else {
            next.angle[pick()] = static_cast<int>(random.Below(kAngles));
          }
        }
        const double next_height = Drop(next, profiles, search_width, skyline, nullptr);
        const double slack = 0.02 * (1 - static_cast<double>(step) / steps);
        if (next_height > now_height * (1 + slack * static_cast<double>(random.Uniform())))
          continue;
        now = next;
        now_height = next_height;
        if (now_height >= height[search]) continue;
        height[search] = now_height;
        found[search] = now;
      }
    });
    const auto best = std::min_element(height.begin(), height.end());
    plan = found[best - height.begin()];
    candidates.assign(found.begin(), found.end());
    scale *= *best < kNone ? std::sqrt(search_width / *best) : 0.7;
  }
  // The final scale, texel by texel: where charts fall changes abruptly with it, so from above, the
  // first that fits.
  const int width = size - gutter;
  std::vector<Packing> packings(candidates.size());
  ParallelFor(candidates.size(), [&](std::size_t i) {
    const Plan& candidate = candidates[i];
    std::vector<std::vector<Profile>> fine(static_cast<std::size_t>(n),
                                           std::vector<Profile>(kAngles));
    std::vector<float> skyline;
    std::vector<Vec2d> places(static_cast<std::size_t>(n));
    double trial = 1.08 * scale * size / kSearchSize;
    for (int step = 0; step < 200; ++step, trial *= 0.995) {
      for (int k = 0; k < n; ++k) {
        fine[k][candidate.angle[k]] =
            MakeProfile(borders[k], base_angle[k] + AngleOf(candidate.angle[k]), trial, gutter);
      }
      if (Drop(candidate, fine, width, skyline, &places) > width) continue;
      packings[i].texels_per_unit = trial;
      for (int k = 0; k < n; ++k) {
        packings[i].places.push_back({base_angle[k] + AngleOf(candidate.angle[k]),
                                      places[k] + Vec2d::Constant(gutter / 2.0)});
      }
      return;
    }
  });
  const auto best =
      std::max_element(packings.begin(), packings.end(), [](const Packing& a, const Packing& b) {
        return a.texels_per_unit < b.texels_per_unit;
      });
  Require(best->texels_per_unit > 0,
          Fault::kStage,
          "the {} charts do not fit a texture of {} texels with a gutter of {}: raise atlas.size",
          n,
          size,
          gutter);
  return *best;
}

}  // namespace dyxel::internal
