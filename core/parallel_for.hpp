#pragma once

#include <cstddef>
#include <functional>

namespace hairnet {

// Calls body(i) for each i in [0, count), in any order and on any threads, and returns when all calls are done. Each
// implementation states whether the body may call it again.
using ParallelFor = std::function<void(std::size_t count, const std::function<void(std::size_t)>& body)>;

// Runs the loop with `parallel_for`, or serially when it is empty.
inline void run_loop(const ParallelFor& parallel_for, std::size_t count, const std::function<void(std::size_t)>& body) {
  if (parallel_for) return parallel_for(count, body);
  for (std::size_t i = 0; i < count; ++i) body(i);
}

}  // namespace hairnet
