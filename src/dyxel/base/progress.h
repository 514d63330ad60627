// Progress of long work: a bar with the time left on a terminal, plain lines elsewhere.
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <string>

namespace dyxel {

// What a stage's options carry: called with the share done, in [0, 1], from any thread.
using ProgressFn = std::function<void(double)>;

// Prints `label` with the share done and the time left to stderr; thread-safe. Nothing is printed
// under Verbosity::kQuiet.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void Update(double share);
  // Ends the line, with the time it took; the destructor ends it without.
  void Finish();
  [[nodiscard]] ProgressFn Callback() {
    return [this](double share) { Update(share); };
  }

 private:
  void Print(double share);

  std::string label_;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_;
  std::mutex mutex_;
  bool terminal_;
  bool open_ = false;
};

}  // namespace dyxel
