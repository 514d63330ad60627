#include "dyxel/base/hash.h"

#include <array>
#include <fstream>
#include <vector>

#include <xxhash.h>

#include "dyxel/base/error.h"

namespace dyxel {

struct Hasher::State {
  XXH3_state_t* xxh = XXH3_createState();
  State() { XXH3_128bits_reset(xxh); }
  ~State() { XXH3_freeState(xxh); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
};

Hasher::Hasher() : state_(std::make_unique<State>()) {}
Hasher::~Hasher() = default;
Hasher::Hasher(Hasher&&) noexcept = default;
Hasher& Hasher::operator=(Hasher&&) noexcept = default;

Hasher& Hasher::AddBytes(std::span<const std::byte> bytes) {
  XXH3_128bits_update(state_->xxh, bytes.data(), bytes.size());
  return *this;
}

Hasher& Hasher::Add(std::string_view text) {
  const std::uint64_t size = text.size();
  AddBytes(std::as_bytes(std::span(&size, 1)));
  return AddBytes(std::as_bytes(std::span(text)));
}

Hasher& Hasher::AddFile(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw FileError(path, "can't be read", "Check that the file is there and readable");
  std::vector<char> buffer(1 << 20);
  while (in) {
    in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    AddBytes(std::as_bytes(std::span(buffer.data(), static_cast<std::size_t>(in.gcount()))));
  }
  return *this;
}

std::string Hasher::Digest() const {
  const XXH128_hash_t digest = XXH3_128bits_digest(state_->xxh);
  return fmt::format("{:016x}{:016x}", digest.high64, digest.low64);
}

std::string HashFile(const std::filesystem::path& path) { return Hasher().AddFile(path).Digest(); }

}  // namespace dyxel
