#pragma once

#include "server/app/metrics.hpp"

namespace hairnet::server {

// Reads what the system says of this process. What it does not say is left as it was.
void read_process(ProgramGauges& gauges);

}  // namespace hairnet::server
