// Files are written beside their place and renamed, so that none is ever half there.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace dyxel {

// A temporary name beside `path` (same extension, so that writers that look at it work), which
// Commit() renames to `path`. Without a Commit the temporary file is removed. Creates the folder.
//
//   AtomicFile file("project/atlas/grid.exr");
//   WriteSomething(file.temporary());
//   file.Commit();
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  [[nodiscard]] const std::filesystem::path& temporary() const { return temporary_; }
  // Throws Error(kStage) where the rename fails (disk full, no permission).
  void Commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
  bool committed_ = false;
};

// Writes `bytes` as a whole file, atomically. Throws Error(kStage) with the path and the cause.
void WriteFile(const std::filesystem::path& path, std::string_view bytes);

// The bytes of a file. Throws Error(kInput) where it can't be read.
[[nodiscard]] std::string ReadFile(const std::filesystem::path& path);

}  // namespace dyxel
