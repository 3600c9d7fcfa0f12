#pragma once

#include "tests/bench/subject.hpp"

namespace hairnet::bench {

// How many distinct characters a core keeps up with through World::step, on one thread and on several, and what memory
// they take.
void measure_crowds(const Subject& subject, const Options& options, Report& report);

}  // namespace hairnet::bench
