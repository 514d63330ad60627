#include "dyxel/base/progress.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>
#include <unistd.h>

#include "dyxel/base/interrupt.h"
#include "dyxel/base/log.h"

namespace dyxel {
namespace {

using Clock = std::chrono::steady_clock;

std::string Duration(double seconds) {
  if (seconds < 60) return fmt::format("{:.0f} s", seconds);
  return fmt::format(
      "{:.0f} min {:02.0f} s", std::floor(seconds / 60), seconds - 60 * std::floor(seconds / 60));
}

double Seconds(Clock::duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

ProgressBar::ProgressBar(std::string label)
    : label_(std::move(label)),
      start_(Clock::now()),
      last_(start_),
      terminal_(::isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (open_) std::fputs("\n", stderr);
}

void ProgressBar::Update(double share) {
  ThrowIfInterrupted();
  // Details are lines of their own, which a bar would run into.
  if (GetVerbosity() != Verbosity::kNormal) return;
  const std::scoped_lock lock(mutex_);
  const Clock::time_point now = Clock::now();
  if (Seconds(now - last_) < (terminal_ ? 0.1 : 10.0)) return;
  last_ = now;
  Print(std::clamp(share, 0.0, 1.0));
}

void ProgressBar::Print(double share) {
  const double spent = Seconds(last_ - start_);
  const std::string left =
      share > 0.01 ? fmt::format("{} left", Duration(spent * (1 - share) / share)) : "";
  if (terminal_) {
    const int width = 30;
    const int full = static_cast<int>(share * width);
    fmt::print(stderr,
               "\r{:<14} [{}{}] {:3.0f} %  {:<16}",
               label_,
               std::string(static_cast<std::size_t>(full), '#'),
               std::string(static_cast<std::size_t>(width - full), '.'),
               100 * share,
               left);
    std::fflush(stderr);
    open_ = true;
  } else {
    fmt::print(stderr, "{}: {:.0f} %, {}\n", label_, 100 * share, left);
  }
}

void ProgressBar::Finish() {
  if (GetVerbosity() == Verbosity::kQuiet) return;
  const std::scoped_lock lock(mutex_);
  const std::string spent = Duration(Seconds(Clock::now() - start_));
  fmt::print(stderr,
             "{}{:<14} {}{}\n",
             open_ ? "\r" : "",
             label_,
             spent,
             open_ ? std::string(50, ' ') : "");
  open_ = false;
}

}  // namespace dyxel
