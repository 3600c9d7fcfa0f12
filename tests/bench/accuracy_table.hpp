#pragma once

#include "tests/bench/subject.hpp"

namespace hairnet::bench {

// What iterations buy: the trajectory's error beside the crowd's time, by level, stiffness, rate and iterations.
void measure_accuracy(const Subject& subject, const Options& options, Report& report);

}  // namespace hairnet::bench
