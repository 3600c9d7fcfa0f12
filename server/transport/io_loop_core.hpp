#pragma once

#include <memory>
#include <vector>

#include "server/transport/asio.hpp"

namespace hairnet::server {

// A type of its own, so that the header of IoLoop, which `app` includes, does not include Asio.
struct IoLoopCore {
  // The hint of one thread lets Asio leave out locks between threads of the loop.
  asio::io_context context{1};
  // run() must not end while nothing waits, as before the first connection.
  asio::executor_work_guard<asio::io_context::executor_type> work = asio::make_work_guard(context);
  SerialExecutor serial{context.get_executor()};
  asio::signal_set signals{context};
};

}  // namespace hairnet::server
