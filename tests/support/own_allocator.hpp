#pragma once

#include <atomic>
#include <cstddef>
#include <limits>

// Replaces the allocator of a test program that links hairnet_own_allocator: it counts, and fails on request.
namespace hairnet::own_allocator {

extern std::atomic<std::size_t> allocation_count;
// The bytes that the whole program holds, by the sizes that malloc gives. The peak is that since a test has set it.
extern std::atomic<std::size_t> held_bytes, peak_bytes;

// An allocation that fails does what the standard demands: it calls the new-handler and tries again. This number stands
// for no failure.
inline constexpr long kNever = std::numeric_limits<long>::max();
// Counts down with each allocation. The allocation that brings it to zero fails.
extern std::atomic<long> until_failure;
// Every allocation of more bytes than this fails.
extern std::atomic<std::size_t> failing_bytes;
// Counts the failures.
extern std::atomic<long> failure_count;

}  // namespace hairnet::own_allocator
