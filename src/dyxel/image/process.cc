#include "dyxel/image/process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include <fcntl.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "dyxel/base/error.h"

extern char** environ;

namespace dyxel::internal {

Process::Process(const std::vector<std::string>& arguments, Pipe pipe) {
  // A pair of sockets instead of a pipe: writing to a program that has ended then is an error that
  // can be asked for, and no signal.
  std::array<int, 2> ends{};
  const int made = ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data());
  messages_ = ::memfd_create("dyxel", MFD_CLOEXEC);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  const bool from_output = pipe == Pipe::kFromOutput;
  posix_spawn_file_actions_adddup2(&actions, ends[1], from_output ? 1 : 0);
  posix_spawn_file_actions_addopen(&actions, from_output ? 0 : 1, "/dev/null", O_RDWR, 0);
  posix_spawn_file_actions_adddup2(&actions, messages_, 2);
  // A group of its own: Ctrl-C at the terminal is for us, and the program ends with its pipe.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  std::vector<char*> argv;
  // posix_spawn takes char* and does not write to it.
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const int error =
      made != 0 ? errno
                : ::posix_spawnp(&pid_, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (made == 0) ::close(ends[1]);
  pipe_ = made == 0 ? ends[0] : -1;
  if (error != 0) {
    pid_ = -1;
    if (pipe_ >= 0) ::close(pipe_);
    ::close(messages_);
    throw Error(Fault::kStage,
                fmt::format("The program \"{}\", which reads and writes videos, can't be started "
                            "({}). Install it (Debian: apt install ffmpeg), or use pictures.",
                            arguments[0],
                            std::strerror(error)));
  }
}

Process::~Process() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  if (pipe_ >= 0) ::close(pipe_);
  if (messages_ >= 0) ::close(messages_);
}

std::size_t Process::Read(char* target, std::size_t count) {
  std::size_t done = 0;
  while (done < count) {
    const ssize_t got = ::recv(pipe_, target + done, count - done, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

bool Process::Write(const char* source, std::size_t count) {
  std::size_t done = 0;
  while (done < count) {
    const ssize_t put = ::send(pipe_, source + done, count - done, MSG_NOSIGNAL);
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) return false;
    done += static_cast<std::size_t>(put);
  }
  return true;
}

int Process::Wait() {
  if (pipe_ >= 0) ::close(pipe_);
  pipe_ = -1;
  if (pid_ <= 0) return 0;
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

std::string Process::Messages() const {
  const off_t size = ::lseek(messages_, 0, SEEK_END);
  std::string text(static_cast<std::size_t>(std::clamp<off_t>(size, 0, 1000)), ' ');
  const ssize_t got = ::pread(messages_,
                              text.data(),
                              text.size(),
                              std::max<off_t>(0, size - static_cast<off_t>(text.size())));
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(0, got)));
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

}  // namespace dyxel::internal
