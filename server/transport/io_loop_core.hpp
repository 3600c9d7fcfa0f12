#pragma once

#include <memory>
#include <vector>

#include "server/transport/asio.hpp"

namespace hairnet::server {

struct IoLoopCore {
  asio::io_context context{1};
  asio::executor_work_guard<asio::io_context::executor_type> work = asio::make_work_guard(context);
  SerialExecutor serial{context.get_executor()};
  asio::signal_set signals{context};
};

}  // namespace hairnet::server
