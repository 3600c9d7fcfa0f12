#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/result.hpp"

// The instruction set that Highway's kernels run on, and what machine this is.
namespace hairnet::bench {

// Lists those that this machine has and the kernels are compiled for, best first.
std::vector<std::string> isa_names();

// Sets all kernels from now on to "best" or one of isa_names(). Refused when it is not there.
Result<void> use_isa(const std::string& name);

// As asked for and in use.
std::string isa_in_use();

std::string cpu_model();
// Counts the machine's hardware threads.
std::size_t thread_count();

}  // namespace hairnet::bench
