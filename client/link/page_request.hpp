#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <string>
#include <string_view>

#include "client/link/server_stream.hpp"
#include "client/link/tls.hpp"

namespace hairnet::link {

// Asks a server for a small page, over TCP or TLS as the address says.
class PageRequest {
 public:
  struct Answer {
    std::string fault;         // one line, if there is no page
    bool is_reachable = true;  // false: the server does not answer at all, or is not the one that was meant
    std::string text;
    asio::ip::address server;
  };

  PageRequest(asio::io_context& io, StreamOptions options);
  asio::awaitable<Answer> get(std::string_view path);
  void cancel();  // get() ends soon, also one that comes later

 private:
  asio::awaitable<std::string> open();
  void close();

  const StreamOptions options_;
  asio::ssl::context context_;
  const std::string fault_;  // of the TLS options
  TlsSocket socket_;         // its lower layer alone where there is no TLS
  NameLookup lookup_;
};

}  // namespace hairnet::link
