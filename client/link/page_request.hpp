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
    // One line if there is no page, else empty.
    std::string error;
    // False means that the server does not answer at all, or is not the one that was meant.
    bool is_reachable = true;
    std::string text;
    // The address of the machine that has answered.
    asio::ip::address server;
  };

  PageRequest(asio::io_context& io, StreamOptions options) : socket_(io, std::move(options)) {}
  asio::awaitable<Answer> get(std::string_view path);
  // Ends a get() soon, also one that is called later.
  void cancel() { socket_.close(); }

 private:
  Socket socket_;
};

}  // namespace hairnet::link
