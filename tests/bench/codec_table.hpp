#pragma once

#include "tests/bench/subject.hpp"

namespace hairnet::bench {

// Bytes of a frame by its error, and the time that levels take to become coefficients, and coefficients bytes.
void measure_codec_table(const Subject& subject, const Options& options, Report& report);

}  // namespace hairnet::bench
