#include "dyxel/base/interrupt.h"

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <string_view>

#include <unistd.h>

#include "dyxel/base/error.h"

namespace dyxel {
namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free);

void OnSignal(int signal) {
  if (interrupted.exchange(true)) std::_Exit(128 + signal);
  constexpr std::string_view kLine = "\nStopping; once more stops at once.\n";
  // Nothing can be done where stderr is closed.
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kLine.data(), kLine.size());
}

}  // namespace

void HandleInterrupts() {
  std::signal(SIGINT, OnSignal);
  std::signal(SIGTERM, OnSignal);
}

void ThrowIfInterrupted() {
  if (interrupted) throw Error(Fault::kInterrupted, "Stopped before the end.");
}

void internal::SetInterrupted(bool value) { interrupted = value; }

}  // namespace dyxel
