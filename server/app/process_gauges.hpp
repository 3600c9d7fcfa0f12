#pragma once

#include "server/app/metrics.hpp"

namespace hairnet::server {

// Reads the system's figures of this process. A gauge stays unchanged when its figure cannot be read.
void read_process(ProgramGauges& gauges);

}  // namespace hairnet::server
