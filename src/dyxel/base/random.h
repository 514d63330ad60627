// A small seeded generator: the same numbers on every machine and for every number of threads.
#pragma once

#include <cmath>
#include <cstdint>

namespace dyxel {

// PCG32 (O'Neill 2014). One stream per (seed, sequence): give each texel, pixel or frame its own
// sequence and results do not depend on the order of the work.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t sequence = 0)
      : state_(0), increment_((sequence << 1U) | 1U) {
    Next();
    state_ += seed;
    Next();
  }

  // Uniform 32 bits.
  std::uint32_t Next() {
    const std::uint64_t old = state_;
    state_ = old * 6364136223846793005ULL + increment_;
    const auto shifted = static_cast<std::uint32_t>(((old >> 18U) ^ old) >> 27U);
    const auto turn = static_cast<std::uint32_t>(old >> 59U);
    return (shifted >> turn) | (shifted << ((32U - turn) & 31U));
  }
  // Uniform in [0, 1).
  float Uniform() { return static_cast<float>(Next() >> 8U) * 0x1p-24F; }
  // Uniform in [0, n).
  std::uint32_t Below(std::uint32_t n) {
    return static_cast<std::uint32_t>((std::uint64_t{Next()} * n) >> 32U);
  }
  // Standard normal (Box-Muller, one of the pair).
  float Normal() {
    const float u = 1.0F - Uniform();
    const float v = Uniform();
    return std::sqrt(-2.0F * std::log(u)) * std::cos(6.28318530718F * v);
  }

 private:
  std::uint64_t state_;
  std::uint64_t increment_;
};

}  // namespace dyxel
