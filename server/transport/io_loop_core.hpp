#pragma once

#include <memory>
#include <vector>

#include "server/transport/asio.hpp"

namespace hairnet::server {

// Is apart from IoLoop so that headers for `app` show no Asio.
struct IoLoopCore {
  // The hint of one thread lets Asio leave out locks between threads of the loop.
  asio::io_context context{1};
  // run() must not end while nothing waits, as before the first connection.
  asio::executor_work_guard<asio::io_context::executor_type> work = asio::make_work_guard(context);
  SerialExecutor serial{context.get_executor()};
  asio::signal_set signals{context};
};

}  // namespace hairnet::server
