#pragma once

#include "tests/bench/subject.hpp"

namespace hairnet::bench {

// Sets a crowd up, then makes its steps in one function of its own, perform_steps, for valgrind to count the
// instructions of. Returns the exit code.
int count_instructions(const Subject& subject, const Options& options);

}  // namespace hairnet::bench
