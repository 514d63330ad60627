// Parallel loops over oneTBB whose results do not depend on the number of threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace dyxel {

// Limits all parallel loops to `jobs` threads; 0 means all cores. Call once, from main().
void SetJobs(int jobs);
[[nodiscard]] int Jobs();

// f(i) for i in [0, n), in any order and concurrently; f writes only what belongs to i.
template <class F>
void ParallelFor(std::size_t n, F&& f) {
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) { f(i); });
}

// f(begin, end) on blocks of `block` indices that do not depend on the number of threads.
template <class F>
void ParallelForBlocks(std::size_t n, std::size_t block, F&& f) {
  const std::size_t num_blocks = (n + block - 1) / block;
  tbb::parallel_for(std::size_t{0}, num_blocks, [&](std::size_t b) {
    f(b * block, std::min(n, (b + 1) * block));
  });
}

// Σ over fixed blocks: each block's f(begin, end) gives a T, and the Ts are combined in order with
// `combine(total, part)`, so that floating-point sums are the same for any number of threads.
template <class T, class F, class Combine>
[[nodiscard]] T ParallelReduce(std::size_t n, std::size_t block, T init, F&& f, Combine&& combine) {
  const std::size_t num_blocks = (n + block - 1) / block;
  std::vector<T> parts(num_blocks, init);
  tbb::parallel_for(std::size_t{0}, num_blocks, [&](std::size_t b) {
    parts[b] = f(b * block, std::min(n, (b + 1) * block));
  });
  T total = std::move(init);
  for (T& part : parts) combine(total, part);
  return total;
}

}  // namespace dyxel
