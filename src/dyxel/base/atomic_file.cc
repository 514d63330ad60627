#include "dyxel/base/atomic_file.h"

#include <atomic>
#include <fstream>
#include <sstream>
#include <system_error>

#include <unistd.h>

#include "dyxel/base/error.h"

namespace dyxel {
namespace {
std::atomic<int> next_temporary{0};
}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code error;
  if (path_.has_parent_path()) std::filesystem::create_directories(path_.parent_path(), error);
  Require(!error,
          Fault::kStage,
          "{}: the folder can't be made ({}). Check the place and its permissions.",
          path_.parent_path().string(),
          error.message());
  temporary_ = path_.parent_path() / fmt::format(".{}.{}-{}.part{}",
                                                 path_.stem().string(),
                                                 ::getpid(),
                                                 next_temporary.fetch_add(1),
                                                 path_.extension().string());
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::Commit() {
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  Require(!error,
          Fault::kStage,
          "{}: can't be written ({}). Check the free space and the permissions.",
          path_.string(),
          error.message());
  committed_ = true;
}

void WriteFile(const std::filesystem::path& path, std::string_view bytes) {
  AtomicFile file(path);
  {
    std::ofstream out(file.temporary(), std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.close();
    Require(out.good(),
            Fault::kStage,
            "{}: can't be written. Check the free space and the permissions.",
            path.string());
  }
  file.Commit();
}

std::string ReadFile(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw FileError(path, "can't be read", "Check that the file is there and readable");
  std::ostringstream bytes;
  bytes << in.rdbuf();
  return std::move(bytes).str();
}

}  // namespace dyxel
