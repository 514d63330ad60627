// Another program with a pipe to its input or from its output.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <sys/types.h>

namespace dyxel::internal {

class Process {
 public:
  enum class Pipe { kFromOutput, kToInput };

  // Starts arguments[0], looked up in PATH, without a shell. Throws Error(kStage) that says what to
  // install where the program isn't there.
  Process(const std::vector<std::string>& arguments, Pipe pipe);
  // Ends the program if it still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // Up to `count` bytes of its output; fewer only at its end.
  std::size_t Read(char* target, std::size_t count);
  // False where the program has ended and takes no more.
  bool Write(const char* source, std::size_t count);
  // Closes the pipe and waits; the exit status, or 128 + signal.
  int Wait();
  // What it wrote to stderr, the last 1000 characters on one line.
  [[nodiscard]] std::string Messages() const;

 private:
  pid_t pid_ = -1;
  int pipe_ = -1;
  int messages_ = -1;
};

}  // namespace dyxel::internal
