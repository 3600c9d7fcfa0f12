#pragma once

#include "tests/bench/subject.hpp"

namespace hairnet::bench {

// Measures the gain of iterations: the trajectory's error and the crowd's time, by level, stiffness, rate and
// iterations.
void measure_accuracy(const Subject& subject, const Options& options, Report& report);

}  // namespace hairnet::bench
