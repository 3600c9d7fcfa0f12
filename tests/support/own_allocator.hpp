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
// Counts down with each allocation; the one that brings it to zero fails.
extern std::atomic<long> until_failure;
// Larger ones fail always.
extern std::atomic<std::size_t> failing_bytes;
extern std::atomic<long> failure_count;

}  // namespace hairnet::own_allocator
