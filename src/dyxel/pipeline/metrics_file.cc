#include "dyxel/pipeline/metrics_file.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <nlohmann/json.hpp>

#include "dyxel/base/atomic_file.h"

namespace dyxel {
namespace {
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
}

void Metrics::Set(const std::string& key, double value) {
  if (std::isfinite(value)) values_[prefix_ + key] = value;
}

double Metrics::Get(const std::string& key) const {
  const auto found = values_.find(prefix_ + key);
  return found == values_.end() ? kNan : found->second;
}

void Metrics::Write(const std::filesystem::path& file) const {
  WriteFile(file, nlohmann::json(values_).dump(1) + "\n");
}

double Series::Mean() const {
  if (values_.empty()) return kNan;
  return std::accumulate(values_.begin(), values_.end(), 0.0) / static_cast<double>(values_.size());
}

double Series::Min() const {
  return values_.empty() ? kNan : *std::min_element(values_.begin(), values_.end());
}

double Series::Percentile(double p) const {
  if (values_.empty()) return kNan;
  std::vector<double> sorted = values_;
  const auto rank =
      static_cast<std::ptrdiff_t>(std::lround(p * static_cast<double>(sorted.size() - 1)));
  std::nth_element(sorted.begin(), sorted.begin() + rank, sorted.end());
  return sorted[static_cast<std::size_t>(rank)];
}

double Series::ShareBelow(double limit) const {
  if (values_.empty()) return kNan;
  const auto below =
      std::count_if(values_.begin(), values_.end(), [&](double v) { return v < limit; });
  return static_cast<double>(below) / static_cast<double>(values_.size());
}

}  // namespace dyxel
