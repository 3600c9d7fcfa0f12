#pragma once

#include "tests/bench/subject.hpp"

namespace hairnet::bench {

// Bytes and time of a frame by level, rate, class, order and stride.
void measure_codec_table(const Subject& subject, const Options& options, Report& report);

}  // namespace hairnet::bench
