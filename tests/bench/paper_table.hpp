#pragma once

#include "tests/bench/subject.hpp"

namespace hairnet::bench {

// Table 1 of the paper, all ten cells, by every way to step: times of one character and frame of 1/25 s.
void measure_paper_table(const Subject& subject, const Options& options, Report& report);

}  // namespace hairnet::bench
