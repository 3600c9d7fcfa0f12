#pragma once

#include <array>
#include <atomic>
#include <boost/asio.hpp>
#include <string>
#include <thread>
#include <vector>

namespace hairnet::link {

// Passes bytes from one socket to the other until either has ended, and then ends both.
inline void pass(boost::asio::ip::tcp::socket& from, boost::asio::ip::tcp::socket& to) {
  std::array<char, 65536> buffer{};
  boost::system::error_code error;
  while (true) {
    const std::size_t count = from.read_some(boost::asio::buffer(buffer), error);
    if (!error) boost::asio::write(to, boost::asio::buffer(buffer.data(), count), error);
    if (error) break;
  }
  from.shutdown(boost::asio::ip::tcp::socket::shutdown_both, error);
  to.shutdown(boost::asio::ip::tcp::socket::shutdown_both, error);
}

// Listens in front of a server. Answers requests for /wt.json, which says where the server has WebTransport, with a
// page of the test. All other connections are passed on to the port behind.
class PageInFront {
 public:
  PageInFront(std::string page, std::uint16_t behind) : page_(std::move(page)), behind_(behind) {
    thread_ = std::thread([this] { serve(); });
  }
  ~PageInFront() {
    is_stopping_ = true;
    error_code ignored;
    // This connection wakes serve(), which waits in accept().
    tcp::socket(io_).connect(acceptor_.local_endpoint(), ignored);
    thread_.join();
    for (std::thread& each : conversations_) each.join();
  }
  [[nodiscard]] std::uint16_t port() const { return acceptor_.local_endpoint().port(); }
  [[nodiscard]] int pages_asked() const { return pages_asked_; }
  // From now on requests for the page are passed on too, so that the server answers them.
  void step_aside() { steps_aside_ = true; }

 private:
  using tcp = boost::asio::ip::tcp;
  using error_code = boost::system::error_code;

  void serve() {
    while (!is_stopping_) {
      error_code error;
      tcp::socket socket = acceptor_.accept(error);
      if (error || is_stopping_) continue;
      conversations_.emplace_back([this, socket = std::move(socket)]() mutable { answer(std::move(socket)); });
    }
  }

  void answer(tcp::socket socket) {
    // The beginning of the first request decides. Its first read is taken to hold the whole request line.
    std::array<char, 2048> buffer{};
    error_code error;
    const std::size_t count = socket.read_some(boost::asio::buffer(buffer), error);
    if (count == 0) return;
    const bool is_page = std::string_view(buffer.data(), count).starts_with("GET /wt.json ");
    pages_asked_ += is_page;
    if (is_page && !steps_aside_) {
      const std::string answer =
          "HTTP/1.1 200 OK\r\nConnection: close\r\nContent-Length: " + std::to_string(page_.size()) + "\r\n\r\n" +
          page_;
      boost::asio::write(socket, boost::asio::buffer(answer), error);
      return;
    }
    tcp::socket behind(io_);
    behind.connect({boost::asio::ip::address_v4::loopback(), behind_}, error);
    boost::asio::write(behind, boost::asio::buffer(buffer.data(), count), error);
    std::thread back([&] { pass(behind, socket); });
    pass(socket, behind);
    back.join();
  }

  // The text of the answer to /wt.json, and the port of the server on the loopback.
  const std::string page_;
  const std::uint16_t behind_;
  std::atomic<bool> is_stopping_{false}, steps_aside_{false};
  std::atomic<int> pages_asked_{0};
  boost::asio::io_context io_;
  tcp::acceptor acceptor_{io_, {boost::asio::ip::address_v4::loopback(), 0}};
  // The threads of all connections. Only `thread_` touches the list until it has ended.
  std::vector<std::thread> conversations_;
  std::thread thread_;
};

// Listens in front of a server. The first connection gets no answer, and the second one is passed on to the port
// behind.
class SilentAtFirst {
 public:
  explicit SilentAtFirst(std::uint16_t behind) {
    thread_ = std::thread([this, behind] {
      error_code error;
      const tcp::socket silent = acceptor_.accept(error);
      tcp::socket socket = acceptor_.accept(error), server(io_);
      server.connect({boost::asio::ip::address_v4::loopback(), behind}, error);
      std::thread back([&] { pass(server, socket); });
      pass(socket, server);
      back.join();
    });
  }
  ~SilentAtFirst() {
    // A link that never made both connections must not keep the thread.
    for (int n = 0; n < 2; ++n) {
      error_code ignored;
      tcp::socket(io_).connect(address_, ignored);
    }
    thread_.join();
  }
  [[nodiscard]] std::uint16_t port() const { return address_.port(); }

 private:
  using tcp = boost::asio::ip::tcp;
  using error_code = boost::system::error_code;
  boost::asio::io_context io_;
  tcp::acceptor acceptor_{io_, {boost::asio::ip::address_v4::loopback(), 0}};
  const tcp::endpoint address_ = acceptor_.local_endpoint();
  std::thread thread_;
};

}  // namespace hairnet::link
