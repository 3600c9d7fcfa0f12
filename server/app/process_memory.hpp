#pragma once

#include <cstddef>

namespace hairnet::server {

// These functions ask the system for the memory of this process, in bytes. A figure that cannot be read is 0.

// The memory that is in RAM.
std::size_t resident_bytes();
// The memory that the allocator has given out and that was not freed.
std::size_t allocated_bytes();
// The memory that the process may have at most: the machine's memory, or a smaller limit of a control group or of the
// process.
std::size_t memory_limit_bytes();

}  // namespace hairnet::server
