#pragma once

#include <atomic>
#include <cstddef>
#include <limits>

// Replaces the allocator of a test program that links hairnet_own_allocator: it counts, and fails on request.
namespace hairnet::own_allocator {

extern std::atomic<std::size_t> allocation_count;
// What the whole program holds, by the sizes that malloc gives, and its peak since a test set it.
extern std::atomic<std::size_t> held_bytes, peak_bytes;

// An allocation that fails does what the standard's does: it calls the new-handler and tries again.
inline constexpr long kNever = std::numeric_limits<long>::max();
extern std::atomic<long> until_failure;         // that one allocation fails, after this many others
extern std::atomic<std::size_t> failing_bytes;  // larger ones fail always
extern std::atomic<long> failure_count;

}  // namespace hairnet::own_allocator
