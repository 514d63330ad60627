// Content hashes for the stamps of a project (XXH3, 128 bit).
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace dyxel {

// Collects bytes; Digest() is 32 hexadecimal digits. Not for security: it tells change from no
// change.
class Hasher {
 public:
  Hasher();
  ~Hasher();
  Hasher(Hasher&&) noexcept;
  Hasher& operator=(Hasher&&) noexcept;

  // Text is delimited: Add("ab").Add("c") differs from Add("a").Add("bc").
  Hasher& Add(std::string_view text);
  Hasher& AddBytes(std::span<const std::byte> bytes);
  // Throws Error(kInput) where the file can't be read.
  Hasher& AddFile(const std::filesystem::path& path);
  [[nodiscard]] std::string Digest() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

[[nodiscard]] std::string HashFile(const std::filesystem::path& path);

}  // namespace dyxel
