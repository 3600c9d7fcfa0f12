#pragma once

#include <boost/asio.hpp>
#include <boost/asio/ssl.hpp>

namespace hairnet::server {

namespace asio = boost::asio;

// Asio's strand, by a name that is not hair: what runs on one executor runs one at a time.
using SerialExecutor = asio::strand<asio::io_context::executor_type>;

// What is awaited answers with its error as a value.
inline constexpr auto kAwaitable = asio::as_tuple(asio::use_awaitable);

}  // namespace hairnet::server
