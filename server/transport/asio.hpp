#pragma once

#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>

namespace hairnet::server {

namespace asio = boost::asio;

// One thread runs the loop, so tasks on its executor run one at a time.
using SerialExecutor = asio::io_context::executor_type;

// An awaited operation returns its error as a value.
inline constexpr auto kAwaitable = asio::as_tuple(asio::use_awaitable);

}  // namespace hairnet::server
