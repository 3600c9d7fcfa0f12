#pragma once

// Compiled separately, in schema/stream: it is slow to build, and only this folder's own .cpp files include it.
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

namespace hairnet::server {

namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;

}  // namespace hairnet::server
