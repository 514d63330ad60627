#include "dyxel/mesh/chart_split.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Eigenvalues>

namespace dyxel::internal {
namespace {

constexpr int kSmoothing = 60;    // rounds over neighbouring triangles
constexpr float kFlat = 0.12F;    // 1 - |mean normal| below which a piece counts as flat
constexpr float kIsland = 0.04F;  // share of the area below which a part is an island

std::size_t At(int i) { return static_cast<std::size_t>(i); }

// The chart with its own triangle numbers.
struct Local {
  std::vector<std::array<int, 3>> neighbour;  // -1 at its border
  std::vector<Vec3f> normal;
  std::vector<Vec3f> centre;
  std::vector<float> area;
};

Local MakeLocal(std::span<const Vec3f> positions,
                std::span<const Triangle> triangles,
                std::span<const std::array<int, 3>> opposite,
                std::span<const int> chart) {
  std::vector<int> local_of(triangles.size(), -1);
  for (std::size_t i = 0; i < chart.size(); ++i) local_of[At(chart[i])] = static_cast<int>(i);
  Local local;
  for (const int f : chart) {
    const Triangle& t = triangles[At(f)];
    const Vec3f& a = positions[At(t[0])];
    const Vec3f doubled = (positions[At(t[1])] - a).cross(positions[At(t[2])] - a);
    const float length = doubled.norm();
    local.area.push_back(0.5F * length);
    local.normal.push_back(length > 0 ? Vec3f(doubled / length) : Vec3f::Zero());
    local.centre.push_back((a + positions[At(t[1])] + positions[At(t[2])]) / 3);
    std::array<int, 3> neighbour = {-1, -1, -1};
    for (std::size_t e = 0; e < 3; ++e) {
      const int other = opposite[At(f)][e];
      if (other >= 0) neighbour[e] = local_of[At(other / 3)];
    }
    local.neighbour.push_back(neighbour);
  }
  return local;
}

// Parts that hang together among triangles of one side: the part of each triangle, and areas.
std::vector<int> Parts(const Local& local, std::span<const char> side, std::vector<float>& areas) {
  std::vector<int> part(side.size(), -1);
  std::vector<int> stack;
  areas.clear();
  for (std::size_t i = 0; i < side.size(); ++i) {
    if (part[i] >= 0) continue;
    const int number = static_cast<int>(areas.size());
    areas.push_back(0);
    part[i] = number;
    stack.assign(1, static_cast<int>(i));
    while (!stack.empty()) {
      const int at = stack.back();
      stack.pop_back();
      areas.back() += local.area[At(at)];
      for (const int next : local.neighbour[At(at)]) {
        if (next >= 0 && part[At(next)] < 0 && side[At(next)] == side[i]) {
          part[At(next)] = number;
          stack.push_back(next);
        }
      }
    }
  }
  return part;
}

// Gives islands to the other side and takes teeth off the cut.
void CleanSides(const Local& local, std::vector<char>& side) {
  const float total = std::accumulate(local.area.begin(), local.area.end(), 0.0F);
  std::vector<float> areas;
  for (int round = 0; round < 3; ++round) {
    const std::vector<int> part = Parts(local, side, areas);
    const std::size_t largest =
        static_cast<std::size_t>(std::max_element(areas.begin(), areas.end()) - areas.begin());
    bool changed = false;
    for (std::size_t i = 0; i < side.size(); ++i) {
      if (areas[At(part[i])] < kIsland * total && At(part[i]) != largest) {
        side[i] = side[i] != 0 ? 0 : 1;
        changed = true;
      }
    }
    if (!changed) break;
  }
  for (int round = 0; round < 4; ++round) {
    for (std::size_t i = 0; i < side.size(); ++i) {
      int others = 0;
      int same = 0;
      for (const int next : local.neighbour[i]) {
        if (next < 0) continue;
        (side[At(next)] == side[i] ? same : others) += 1;
      }
      if (others > same) side[i] = side[i] != 0 ? 0 : 1;
    }
  }
}

// What a split costs: few parts, and a short border between them.
double CutCost(const Local& local, std::span<const char> side) {
  std::vector<float> areas;
  const std::vector<int> part = Parts(local, side, areas);
  if (areas.size() < 2) return 1e30;
  int cut = 0;
  for (std::size_t i = 0; i < side.size(); ++i) {
    for (const int next : local.neighbour[i]) cut += next >= 0 && side[At(next)] != side[i] ? 1 : 0;
  }
  const double greatest = static_cast<double>(*std::max_element(areas.begin(), areas.end()));
  const double total = std::accumulate(areas.begin(), areas.end(), 0.0);
  return (static_cast<double>(areas.size()) - 1) *
         (0.3 + cut / std::sqrt(static_cast<double>(side.size()))) *
         (greatest > 0.85 * total ? 4 : 1);
}

}  // namespace

std::vector<std::vector<int>> ConnectedParts(std::span<const std::array<int, 3>> opposite,
                                             std::span<const int> chart,
                                             int num_triangles) {
  std::vector<int> part(At(num_triangles), -2);  // -2: not of this chart
  for (const int f : chart) part[At(f)] = -1;
  std::vector<std::vector<int>> parts;
  for (const int f : chart) {
    if (part[At(f)] >= 0) continue;
    const int number = static_cast<int>(parts.size());
    std::vector<int> found = {f};
    part[At(f)] = number;
    for (std::size_t i = 0; i < found.size(); ++i) {
      for (const int other : opposite[At(found[i])]) {
        if (other >= 0 && part[At(other / 3)] == -1) {
          part[At(other / 3)] = number;
          found.push_back(other / 3);
        }
      }
    }
    std::sort(found.begin(), found.end());
    parts.push_back(std::move(found));
  }
  return parts;
}

std::vector<std::vector<int>> SplitChart(std::span<const Vec3f> positions,
                                         std::span<const Triangle> triangles,
                                         std::span<const std::array<int, 3>> opposite,
                                         std::span<const int> chart,
                                         bool across) {
  const Local local = MakeLocal(positions, triangles, opposite, chart);
  const std::size_t n = chart.size();
  Vec3f mean_normal = Vec3f::Zero();
  Vec3f mean = Vec3f::Zero();
  float total = 0;
  for (std::size_t i = 0; i < n; ++i) {
    mean_normal += local.area[i] * local.normal[i];
    mean += local.area[i] * local.centre[i];
    total += local.area[i];
  }
  if (total > 0) {
    mean_normal /= total;
    mean /= total;
  }
  // Normals smoothed over the surface, so that wrinkles draw no cuts.
  std::vector<Vec3f> smooth(n);
  for (std::size_t i = 0; i < n; ++i) smooth[i] = local.normal[i] * local.area[i];
  std::vector<Vec3f> next(n);
  for (int round = 0; round < kSmoothing; ++round) {
    for (std::size_t i = 0; i < n; ++i) {
      Vec3f sum = smooth[i];
      float count = 1;
      for (const int other : local.neighbour[i]) {
        if (other < 0) continue;
        sum += smooth[At(other)];
        count += 1;
      }
      next[i] = sum / count;
    }
    smooth.swap(next);
  }
  Mat3f normal_moments = Mat3f::Zero();
  Mat3f moments = Mat3f::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3f off = local.normal[i] - mean_normal;
    normal_moments += local.area[i] * off * off.transpose();
    const Vec3f x = local.centre[i] - mean;
    moments += local.area[i] * x * x.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Mat3f> normal_axes(normal_moments);
  const Eigen::SelfAdjointEigenSolver<Mat3f> axes(moments);

  std::vector<std::vector<char>> candidates;
  if (!across && 1 - mean_normal.norm() > kFlat) {
    std::vector<Vec3f> directions = {normal_axes.eigenvectors().col(2),
                                     normal_axes.eigenvectors().col(1),
                                     axes.eigenvectors().col(0),
                                     axes.eigenvectors().col(1)};
    for (const Vec3f& d : directions) {
      std::vector<char> side(n);
      for (std::size_t i = 0; i < n; ++i) {
        side[i] = smooth[i].normalized().dot(d) > mean_normal.dot(d) ? 1 : 0;
      }
      candidates.push_back(std::move(side));
    }
  }
  // Across the length, through the median of the area.
  const Vec3f longest = axes.eigenvectors().col(2);
  {
    std::vector<std::pair<float, std::size_t>> along(n);
    for (std::size_t i = 0; i < n; ++i) along[i] = {longest.dot(local.centre[i] - mean), i};
    std::sort(along.begin(), along.end());
    std::vector<char> side(n, 0);
    float sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      sum += local.area[along[i].second];
      side[along[i].second] = 2 * sum > total ? 1 : 0;
    }
    if (candidates.empty()) candidates.push_back(std::move(side));
  }
  double best_cost = 1e29;
  std::vector<char> best;
  for (std::vector<char>& side : candidates) {
    CleanSides(local, side);
    const double cost = CutCost(local, side);
    if (cost < best_cost) {
      best_cost = cost;
      best = side;
    }
  }
  if (best.empty()) {  // nothing else parts it: the first half of its triangles
    best.assign(n, 0);
    std::fill(best.begin() + static_cast<std::ptrdiff_t>(n / 2), best.end(), static_cast<char>(1));
  }
  std::vector<std::vector<int>> parts;
  for (const char which : {0, 1}) {
    std::vector<int> list;
    for (std::size_t i = 0; i < n; ++i) {
      if (best[i] == which) list.push_back(chart[i]);
    }
    for (auto& part : ConnectedParts(opposite, list, static_cast<int>(triangles.size()))) {
      parts.push_back(std::move(part));
    }
  }
  return parts;
}

}  // namespace dyxel::internal
