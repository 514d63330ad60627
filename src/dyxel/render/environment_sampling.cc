// An environment as directional lights: median cut (Debevec, SIGGRAPH posters 2005) on a binary
// heap of regions, the brightest split first. docs/method.md (E4).
#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>

#include "dyxel/base/error.h"
#include "dyxel/render/renderer.h"

namespace dyxel {
namespace {

struct Region {
  int x0, y0, x1, y1;  // pixels [x0, x1) × [y0, y1)
  double energy;       // luminance × solid angle
};

double Luminance(const float* rgb) {
  return 0.2126 * static_cast<double>(rgb[0]) + 0.7152 * static_cast<double>(rgb[1]) +
         0.0722 * static_cast<double>(rgb[2]);
}

// The map's energy as a summed area table, so that any split costs a logarithm.
class EnergyTable {
 public:
  explicit EnergyTable(const ImageF& map)
      : width_(map.width + 1), sums_(Size(map.width + 1) * Size(map.height + 1), 0.0) {
    for (int y = 0; y < map.height; ++y) {
      const double solid_angle = RowSolidAngle(map, y);
      double row = 0;
      for (int x = 0; x < map.width; ++x) {
        row += std::max(0.0, Luminance(&map.At(x, y))) * solid_angle;
        At(x + 1, y + 1) = At(x + 1, y) + row;
      }
    }
  }
  // Of one pixel of row y.
  static double RowSolidAngle(const ImageF& map, int y) {
    const double top = std::cos(kPiD * y / map.height);
    const double bottom = std::cos(kPiD * (y + 1) / map.height);
    return (top - bottom) * 2 * kPiD / map.width;
  }
  [[nodiscard]] double Energy(int x0, int y0, int x1, int y1) const {
    return Get(x1, y1) - Get(x0, y1) - Get(x1, y0) + Get(x0, y0);
  }

 private:
  static std::size_t Size(int n) { return static_cast<std::size_t>(n); }
  double& At(int x, int y) { return sums_[Size(y) * Size(width_) + Size(x)]; }
  [[nodiscard]] double Get(int x, int y) const { return sums_[Size(y) * Size(width_) + Size(x)]; }
  int width_;
  std::vector<double> sums_;
};

// Where the energy left of (above) the cut is first at least half, the cut inside the region.
std::pair<Region, Region> Split(const Region& r, const EnergyTable& table, const ImageF& map) {
  // Widths shrink towards the poles: compare lengths on the sphere.
  const double middle = kPiD * 0.5 * (r.y0 + r.y1) / map.height;
  const double wide = 2 * kPiD * (r.x1 - r.x0) / map.width * std::sin(middle);
  const double high = kPiD * (r.y1 - r.y0) / map.height;
  const bool across = r.y1 - r.y0 == 1 || (r.x1 - r.x0 > 1 && wide >= high);
  int low = (across ? r.x0 : r.y0) + 1;
  int last = (across ? r.x1 : r.y1) - 1;
  const auto before = [&](int cut) {
    return across ? table.Energy(r.x0, r.y0, cut, r.y1) : table.Energy(r.x0, r.y0, r.x1, cut);
  };
  while (low < last) {
    const int cut = (low + last) / 2;
    if (before(cut) < 0.5 * r.energy) {
      low = cut + 1;
    } else {
      last = cut;
    }
  }
  // Of the two cuts around the median the fairer one.
  const int first = (across ? r.x0 : r.y0) + 1;
  if (low > first && 0.5 * r.energy - before(low - 1) < before(low) - 0.5 * r.energy) --low;
  Region a = r;
  Region b = r;
  (across ? a.x1 : a.y1) = low;
  (across ? b.x0 : b.y0) = low;
  a.energy = table.Energy(a.x0, a.y0, a.x1, a.y1);
  b.energy = table.Energy(b.x0, b.y0, b.x1, b.y1);
  return {a, b};
}

Light RegionLight(const Environment& environment, const Region& r) {
  const ImageF& map = environment.radiance;
  Eigen::Array3d irradiance = Eigen::Array3d::Zero();
  Vec3d mean = Vec3d::Zero();
  for (int y = r.y0; y < r.y1; ++y) {
    const double solid_angle = EnergyTable::RowSolidAngle(map, y);
    for (int x = r.x0; x < r.x1; ++x) {
      const float* rgb = &map.At(x, y);
      for (int c = 0; c < 3; ++c) {
        irradiance[c] += std::max(0.0, static_cast<double>(rgb[c])) * solid_angle;
      }
      const double weight = std::max(0.0, Luminance(rgb)) * solid_angle;
      if (weight == 0) continue;
      mean += weight *
              environment.Direction((x + 0.5) / map.width, (y + 0.5) / map.height).cast<double>();
    }
  }
  Light light;
  light.type = LightType::kDirectional;
  // A region around the whole sphere may have no mean direction: light from above, then.
  light.direction = mean.norm() > 1e-9 * r.energy ? -mean.normalized() : Vec3d(-environment.up);
  light.irradiance = irradiance.cast<float>();
  return light;
}

}  // namespace

std::vector<Light> SampleEnvironment(const Environment& environment, int count) {
  Require(count >= 1, Fault::kUsage, "environment_lights = {}, must be at least 1", count);
  const ImageF& map = environment.radiance;
  Require(!map.empty() && map.channels >= 3, Fault::kUsage, "the environment has no RGB picture");
  const EnergyTable table(map);

  const auto darker = [](const Region& a, const Region& b) {
    // Ties by place: the same order on every machine.
    return std::tie(a.energy, a.y0, a.x0) < std::tie(b.energy, b.y0, b.x0);
  };
  std::priority_queue<Region, std::vector<Region>, decltype(darker)> open(darker);
  std::vector<Region> done;  // single pixels
  open.push({0, 0, map.width, map.height, table.Energy(0, 0, map.width, map.height)});
  while (!open.empty() && static_cast<int>(open.size() + done.size()) < count) {
    const Region region = open.top();
    open.pop();
    if (region.x1 - region.x0 == 1 && region.y1 - region.y0 == 1) {
      done.push_back(region);
      continue;
    }
    const auto [a, b] = Split(region, table, map);
    open.push(a);
    open.push(b);
  }
  for (; !open.empty(); open.pop()) done.push_back(open.top());

  std::vector<Light> lights;
  for (const Region& region : done) {
    if (!(region.energy > 0)) continue;
    lights.push_back(RegionLight(environment, region));
    lights.back().name = fmt::format("environment{}", lights.size() - 1);
  }
  return lights;
}

}  // namespace dyxel
