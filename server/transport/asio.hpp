#pragma once

#include <boost/asio.hpp>

namespace hairnet::server {

namespace asio = boost::asio;

// Asio's strand, by a name that is not hair: what runs on one executor runs one at a time.
using SerialExecutor = asio::strand<asio::io_context::executor_type>;

}  // namespace hairnet::server
