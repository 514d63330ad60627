// The flat object of figures that `evaluate` writes (docs/method.md, M).
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace dyxel {

// Keys as docs/method.md names them, with their value. NaN stands for "could not be measured" and
// is left out of the file.
class Metrics {
 public:
  // All keys set from now on begin with `prefix` ("fit.res_b.").
  void SetPrefix(const std::string& prefix) { prefix_ = prefix; }
  void Set(const std::string& key, double value);
  [[nodiscard]] double Get(const std::string& key) const;  // NaN where there is none
  [[nodiscard]] const std::map<std::string, double>& values() const { return values_; }
  void Write(const std::filesystem::path& file) const;

 private:
  std::string prefix_;
  std::map<std::string, double> values_;
};

// Sums for a mean, a worst, and percentiles of one figure over images.
class Series {
 public:
  void Add(double value) { values_.push_back(value); }
  [[nodiscard]] bool empty() const { return values_.empty(); }
  [[nodiscard]] double Mean() const;
  [[nodiscard]] double Min() const;
  // p in [0, 1].
  [[nodiscard]] double Percentile(double p) const;
  // Share of the values below a limit.
  [[nodiscard]] double ShareBelow(double limit) const;
  void Append(const Series& other) {
    values_.insert(values_.end(), other.values_.begin(), other.values_.end());
  }
  [[nodiscard]] const std::vector<double>& values() const { return values_; }

 private:
  std::vector<double> values_;
};

}  // namespace dyxel
