#pragma once

#include <algorithm>
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

// Runs the loop in chunks, where a call for each index would take longer than what it does: calls body(begin, end).
template <class Body>
void run_chunks(const ParallelFor& parallel_for, std::size_t count, const Body& body) {
  constexpr std::size_t kChunk = 64;
  const auto run_chunk = [&](std::size_t chunk) { body(chunk * kChunk, std::min(count, (chunk + 1) * kChunk)); };
  // A reference is passed, because a copy into std::function would allocate.
  run_loop(parallel_for, (count + kChunk - 1) / kChunk, std::cref(run_chunk));
}

}  // namespace hairnet
