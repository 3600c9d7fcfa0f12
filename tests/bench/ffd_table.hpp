#pragma once

#include "tests/bench/subject.hpp"

namespace hairnet::bench {

// FFD of 10 000 points on the high and the low lattice, beside weights stored a point.
void measure_ffd(const Subject& subject, Report& report);

}  // namespace hairnet::bench
