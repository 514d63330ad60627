#include "dyxel/reflectance/materials.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "dyxel/base/parallel.h"
#include "dyxel/base/random.h"

namespace dyxel {
namespace {

using Colour = std::array<float, 3>;

struct Point {
  Colour colour;
  float weight;
};

struct Clusters {
  std::vector<Colour> centres;
  double spread = std::numeric_limits<double>::infinity();  // Σ w d² / Σ w
};

constexpr int kMaxPoints = 20000;
constexpr int kStarts = 4;
constexpr int kRounds = 25;

float Distance2(const Colour& a, const Colour& b) {
  float sum = 0;
  for (std::size_t c = 0; c < 3; ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

std::size_t Nearest(const Colour& colour, const std::vector<Colour>& centres) {
  std::size_t best = 0;
  float best_distance = std::numeric_limits<float>::infinity();
  for (std::size_t k = 0; k < centres.size(); ++k) {
    const float distance = Distance2(colour, centres[k]);
    if (distance < best_distance) {
      best_distance = distance;
      best = k;
    }
  }
  return best;
}

// k-means++ (Arthur and Vassilvitskii 2007): each next centre is drawn by its squared distance.
std::vector<Colour> Start(const std::vector<Point>& points, int count, Random& random) {
  std::vector<Colour> centres;
  std::vector<double> chance(points.size());
  for (int k = 0; k < count; ++k) {
    double total = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float distance =
          centres.empty()
              ? 1.0F
              : Distance2(points[i].colour, centres[Nearest(points[i].colour, centres)]);
      chance[i] = static_cast<double>(points[i].weight) * static_cast<double>(distance);
      total += chance[i];
    }
    double pick = static_cast<double>(random.Uniform()) * total;
    std::size_t chosen = 0;
    while (chosen + 1 < points.size() && (pick -= chance[chosen]) > 0) ++chosen;
    centres.push_back(points[chosen].colour);
  }
  return centres;
}

Clusters Refine(const std::vector<Point>& points, std::vector<Colour> centres) {
  Clusters out;
  for (int round = 0; round < kRounds; ++round) {
    std::vector<std::array<double, 4>> sums(centres.size(), {0, 0, 0, 0});
    double spread = 0;
    double total = 0;
    for (const Point& point : points) {
      const std::size_t k = Nearest(point.colour, centres);
      const auto w = static_cast<double>(point.weight);
      spread += w * static_cast<double>(Distance2(point.colour, centres[k]));
      total += w;
      for (std::size_t c = 0; c < 3; ++c) sums[k][c] += w * static_cast<double>(point.colour[c]);
      sums[k][3] += w;
    }
    out.spread = spread / std::max(total, 1e-30);
    out.centres = centres;
    for (std::size_t k = 0; k < centres.size(); ++k) {
      if (sums[k][3] <= 0) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        centres[k][c] = static_cast<float>(sums[k][c] / sums[k][3]);
      }
    }
  }
  return out;
}

Clusters KMeans(const std::vector<Point>& points, int count, std::uint64_t seed) {
  Clusters best;
  for (int start = 0; start < kStarts; ++start) {
    Random random(seed, static_cast<std::uint64_t>(100 * count + start));
    Clusters clusters = Refine(points, Start(points, count, random));
    if (clusters.spread < best.spread) best = std::move(clusters);
  }
  return best;
}

// One round: a texel takes the label that most of itself (twice) and its neighbours have.
std::vector<int> Majority(const std::vector<int>& label, const TexelGraph& graph) {
  std::vector<int> out(label.size());
  ParallelForBlocks(label.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t x = begin; x < end; ++x) {
      out[x] = label[x];
      if (label[x] < 0) continue;
      int best = 2;
      for (const int a : graph.neighbours[x]) {
        if (a < 0 || label[static_cast<std::size_t>(a)] < 0) continue;
        const int candidate = label[static_cast<std::size_t>(a)];
        if (candidate == label[x]) {
          out[x] = label[x];
          break;
        }
        int votes = 0;
        for (const int b : graph.neighbours[x]) {
          if (b >= 0 && label[static_cast<std::size_t>(b)] == candidate) ++votes;
        }
        if (votes > best) {
          best = votes;
          out[x] = candidate;
        }
      }
    }
  });
  return out;
}

// Gives every patch of fewer than `min_texels` the label that most of the known texels around it
// have; one that nothing surrounds keeps its own.
void JoinSmallPatches(std::size_t min_texels, const TexelGraph& graph, std::vector<int>& label) {
  std::vector<std::uint8_t> visited(label.size(), 0);
  std::vector<std::size_t> patch;
  for (std::size_t start = 0; start < label.size(); ++start) {
    if (label[start] < 0 || visited[start] != 0) continue;
    patch.assign(1, start);
    visited[start] = 1;
    std::vector<int> border;
    for (std::size_t head = 0; head < patch.size(); ++head) {
      for (const int neighbour : graph.neighbours[patch[head]]) {
        if (neighbour < 0) continue;
        const auto y = static_cast<std::size_t>(neighbour);
        if (label[y] < 0) continue;
        if (label[y] != label[start]) {
          if (patch.size() < min_texels) border.push_back(label[y]);
        } else if (visited[y] == 0) {
          visited[y] = 1;
          patch.push_back(y);
        }
      }
    }
    if (patch.size() >= min_texels || border.empty()) continue;
    std::sort(border.begin(), border.end());
    int best = border[0];
    std::ptrdiff_t most = 0;
    for (auto i = border.begin(); i != border.end();) {
      const auto end = std::upper_bound(i, border.end(), *i);
      if (end - i > most) {
        most = end - i;
        best = *i;
      }
      i = end;
    }
    for (const std::size_t x : patch) label[x] = best;
  }
}

// Labels renumbered by falling count; a cluster that lost all its texels vanishes.
void Renumber(std::vector<int>& label, std::size_t count) {
  std::vector<std::int64_t> texels(count, 0);
  for (const int k : label) {
    if (k >= 0) ++texels[static_cast<std::size_t>(k)];
  }
  std::vector<int> order(count);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return texels[static_cast<std::size_t>(a)] > texels[static_cast<std::size_t>(b)];
  });
  std::vector<int> rank(count);
  for (std::size_t i = 0; i < count; ++i) {
    rank[static_cast<std::size_t>(order[i])] = static_cast<int>(i);
  }
  for (int& k : label) {
    if (k >= 0) k = rank[static_cast<std::size_t>(k)];
  }
}

}  // namespace

std::array<float, 3> internal::Lab(float r, float g, float b) {
  const auto f = [](float t) {
    return t > 216.0F / 24389.0F ? std::cbrt(t) : (24389.0F / 27.0F * t + 16.0F) / 116.0F;
  };
  const float x = f((0.4124564F * r + 0.3575761F * g + 0.1804375F * b) / 0.95047F);
  const float y = f(0.2126729F * r + 0.7151522F * g + 0.0721750F * b);
  const float z = f((0.0193339F * r + 0.1191920F * g + 0.9503041F * b) / 1.08883F);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

std::vector<int> ClusterMaterials(const std::array<std::vector<float>, 3>& diffuse,
                                  const std::vector<float>& confidence,
                                  const TexelGraph& graph,
                                  const ClusterOptions& options) {
  const std::size_t num_texels = confidence.size();
  const auto colour = [&](std::size_t x) {
    Colour lab = internal::Lab(diffuse[0][x], diffuse[1][x], diffuse[2][x]);
    lab[0] *= 0.5F;  // what shading is left is lightness
    return lab;
  };

  std::size_t known = 0;
  for (const float c : confidence) known += c > 0 ? 1 : 0;
  std::vector<int> label(num_texels, -1);
  if (known == 0) return label;

  // A seeded subset, the same whatever the order of the work.
  std::vector<Point> points;
  const float share = static_cast<float>(kMaxPoints) / static_cast<float>(known);
  for (std::size_t x = 0; x < num_texels; ++x) {
    if (confidence[x] <= 0) continue;
    if (share < 1 && Random(options.seed, x).Uniform() >= share) continue;
    points.push_back({colour(x), confidence[x]});
  }

  Clusters clusters;
  if (options.materials > 0) {
    clusters = KMeans(points, options.materials, options.seed);
  } else {
    const double variance = KMeans(points, 1, options.seed).spread;
    for (int count = 1; count <= options.max_materials; ++count) {
      clusters = KMeans(points, count, options.seed);
      // A single colour's own noise (2 units of CIELAB) is no reason to split.
      if (clusters.spread <= std::max((1 - options.explained) * variance, 4.0)) break;
    }
  }

  ParallelForBlocks(num_texels, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t x = begin; x < end; ++x) {
      if (confidence[x] > 0) label[x] = static_cast<int>(Nearest(colour(x), clusters.centres));
    }
  });
  for (int round = 0; round < options.smoothing; ++round) label = Majority(label, graph);
  JoinSmallPatches(
      static_cast<std::size_t>(options.min_patch * static_cast<double>(known)), graph, label);
  Renumber(label, clusters.centres.size());
  return label;
}

}  // namespace dyxel
