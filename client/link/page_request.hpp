#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "client/link/socket.hpp"

namespace hairnet::link {

// Asks a server for a small page, over TCP or TLS as the address says.
class PageRequest {
 public:
  struct Answer {
    std::string error;         // one line, if there is no page
    bool is_reachable = true;  // false: the server does not answer at all, or is not the one that was meant
    std::string text;
    asio::ip::address server;
  };

  PageRequest(asio::io_context& io, StreamOptions options) : socket_(io, std::move(options)) {}
  asio::awaitable<Answer> get(std::string_view path);
  void cancel() { socket_.close(); }  // get() ends soon, also one that comes later

 private:
  Socket socket_;
};

}  // namespace hairnet::link
