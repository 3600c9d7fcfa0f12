#pragma once

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

#include "server/transport/io_loop.hpp"

namespace hairnet::server {

// An I/O loop for the client under test, and a port at which the test answers HTTP by hand, one connection at a
// time.
class AnsweringPort : public testing::Test {
 protected:
  void SetUp() override {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    ASSERT_EQ(::listen(listener_, 8), 0);
    socklen_t length = sizeof(address);
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &length);
    port_ = ntohs(address.sin_port);
  }
  void TearDown() override {
    hang_up();
    if (listener_ >= 0) ::close(listener_);
  }
  void hang_up() {
    if (peer_ >= 0) ::close(peer_);
    peer_ = -1;
  }
  // Runs the loop until done() is true, for 5 s at most.
  bool wait(const std::function<bool()>& done) {
    for (int i = 0; i < 5000 && !done(); ++i) {
      loop_.poll();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return done();
  }
  // Reads one request that ends with these bytes. Accepts a connection first if there is none. Returns what has come
  // after 5 s in any case.
  std::string request(const std::string& end = "\r\n\r\n{}") {
    std::string text;
    wait([&] {
      if (peer_ < 0) peer_ = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK);
      char piece[1024];
      const ssize_t count = peer_ < 0 ? 0 : ::recv(peer_, piece, sizeof(piece), 0);
      if (count > 0) text.append(piece, static_cast<std::size_t>(count));
      return text.ends_with(end);
    });
    return text;
  }
  void answer(const std::string& text) { ::send(peer_, text.data(), text.size(), MSG_NOSIGNAL); }

  static constexpr const char* kOk = "HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n{}";
  IoLoop loop_;
  std::uint16_t port_ = 0;
  int listener_ = -1, peer_ = -1;
};

}  // namespace hairnet::server
