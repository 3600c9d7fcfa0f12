#pragma once

#include <atomic>
#include <cstdlib>
#include <limits>
#include <new>

// Replaces the allocator of the test program that includes this, in one source. An allocation that fails does what the
// standard's does: it calls the new-handler and tries again.
namespace hairnet::server::failing_allocator {

inline constexpr long kNever = std::numeric_limits<long>::max();

inline std::atomic<long> until_failure = kNever;  // that one allocation fails, after this many others
inline std::atomic<std::size_t> failing_bytes = std::numeric_limits<std::size_t>::max();  // larger ones fail always
inline std::atomic<long> failure_count = 0;

inline void* try_once(std::size_t bytes) {
  const bool is_its_turn = until_failure != kNever && --until_failure == 0;
  if (is_its_turn) until_failure = kNever;
  if (is_its_turn || bytes > failing_bytes) {
    ++failure_count;
    return nullptr;
  }
  return std::malloc(bytes == 0 ? 1 : bytes);
}

}  // namespace hairnet::server::failing_allocator

[[gnu::noinline]] void* operator new(std::size_t bytes) {
  while (true) {
    if (void* const block = hairnet::server::failing_allocator::try_once(bytes)) return block;
    const std::new_handler handler = std::get_new_handler();
    if (!handler) throw std::bad_alloc();
    handler();
  }
}
[[gnu::noinline]] void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return hairnet::server::failing_allocator::try_once(bytes);  // its callers do with less
}
[[gnu::noinline]] void operator delete(void* block) noexcept {
  std::free(block);
}
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept {
  std::free(block);
}
