#pragma once

#include "server/app/config.hpp"

namespace hairnet::server {

// Serves until SIGTERM or SIGINT and returns the exit status. The calling thread becomes the I/O thread. A check ends
// where the server would begin to serve, with the same refusals; it leaves no file or folder behind, and passes over a
// port that another server has.
int run_program(const Config& config, bool check_only);

}  // namespace hairnet::server
