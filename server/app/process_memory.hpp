#pragma once

#include <cstddef>

namespace hairnet::server {

// The memory of this process, in bytes. A figure that cannot be read is 0.

// In RAM.
std::size_t resident_bytes();
// Given out by the allocator and not freed.
std::size_t allocated_bytes();
// What the process may have at most: the machine's memory, or a smaller limit of a control group or of the process.
std::size_t memory_limit_bytes();

}  // namespace hairnet::server
