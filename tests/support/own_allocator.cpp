#include "tests/support/own_allocator.hpp"

#include <malloc.h>

#include <cstdlib>
#include <new>

namespace hairnet::own_allocator {

std::atomic<std::size_t> allocation_count = 0, held_bytes = 0, peak_bytes = 0;
std::atomic<long> until_failure = kNever, failure_count = 0;
std::atomic<std::size_t> failing_bytes = std::numeric_limits<std::size_t>::max();

namespace {

// Returns a block, or null when this allocation has to fail or memory is short. An alignment of 0 means that of
// malloc.
void* try_once(std::size_t bytes, std::size_t alignment) {
  const bool is_its_turn = until_failure != kNever && --until_failure == 0;
  if (is_its_turn) until_failure = kNever;
  if (is_its_turn || bytes > failing_bytes) {
    ++failure_count;
    return nullptr;
  }
  void* const block = alignment == 0 ? std::malloc(bytes == 0 ? 1 : bytes)
                                     : std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
  if (!block) return nullptr;
  ++allocation_count;
  const std::size_t held = held_bytes += malloc_usable_size(block);
  std::size_t peak = peak_bytes;
  // Another thread may raise the peak meanwhile; then `peak` gets its value and the comparison is repeated.
  while (held > peak && !peak_bytes.compare_exchange_weak(peak, held)) {
  }
  return block;
}

// Does what the standard demands of operator new: it calls the new-handler after each failure, and throws when there
// is none.
void* allocate(std::size_t bytes, std::size_t alignment) {
  while (true) {
    if (void* const block = try_once(bytes, alignment)) return block;
    const std::new_handler handler = std::get_new_handler();
    if (!handler) throw std::bad_alloc();
    handler();
  }
}

}  // namespace
}  // namespace hairnet::own_allocator

// These operators are not inlined, because g++ would warn that `free` does not match `new` in the inlined code.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  return hairnet::own_allocator::allocate(bytes, 0);
}
[[gnu::noinline]] void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return hairnet::own_allocator::allocate(bytes, static_cast<std::size_t>(alignment));
}
[[gnu::noinline]] void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  // Callers of the nothrow form can do with less memory, so the new handler is not called.
  return hairnet::own_allocator::try_once(bytes, 0);
}
[[gnu::noinline]] void operator delete(void* block) noexcept {
  hairnet::own_allocator::held_bytes -= block ? malloc_usable_size(block) : 0;
  std::free(block);
}
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept {
  operator delete(block);
}
[[gnu::noinline]] void operator delete(void* block, std::align_val_t) noexcept {
  operator delete(block);
}
[[gnu::noinline]] void operator delete(void* block, std::size_t, std::align_val_t) noexcept {
  operator delete(block);
}
