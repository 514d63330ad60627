// The one exception of the library, and who has to act on it.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace dyxel {

// Whose turn it is; the value is the program's exit status.
enum class Fault {
  kStage = 1,         // a stage could not reach a result
  kUsage = 2,         // wrong command line or option
  kInput = 3,         // bad input: a file of the capture or the project
  kInterrupted = 130  // stopped by the user, and resumable
};

// What the caller handed over cannot be used, or a stage could not reach a result. The message is
// one sentence or two: what, which file or option, the value found, how to mend it. A numeric
// kernel never throws: what goes wrong with one texel or frame is a field of its result.
class Error : public std::runtime_error {
 public:
  Error(Fault fault, const std::string& message) : std::runtime_error(message), fault_(fault) {}
  [[nodiscard]] Fault fault() const { return fault_; }

 private:
  Fault fault_;
};

// Throws Error(fault, formatted message) unless `ok`.
template <class... Args>
void Require(bool ok, Fault fault, fmt::format_string<Args...> format, Args&&... args) {
  if (!ok) throw Error(fault, fmt::format(format, std::forward<Args>(args)...));
}

// "FILE: WHAT. MEND." as an Error of fault kInput.
[[nodiscard]] Error FileError(const std::filesystem::path& file,
                              const std::string& what,
                              const std::string& mend);

}  // namespace dyxel
