#pragma once

#include <cstddef>
#include <functional>

namespace hairnet {

// Calls body(i) for each i in [0, count), in any order and on any threads, and returns when all are done. Whether the
// body may call it again is its giver's word.
using ParallelFor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& body)>;

// An empty one stands for one after the other.
inline void run(const ParallelFor& parallel_for, std::size_t count, const std::function<void(std::size_t)>& body) {
  if (parallel_for) return parallel_for(count, body);
  for (std::size_t i = 0; i < count; ++i) body(i);
}

}  // namespace hairnet
