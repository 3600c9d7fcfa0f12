#pragma once

#include "server/app/config.hpp"

namespace hairnet::server {

// Serves until SIGTERM or SIGINT and returns the exit status. The calling thread becomes the I/O thread.
int run_program(const Config& config);

}  // namespace hairnet::server
