#include "tests/load/get_page.hpp"

#include <memory>
#include <string>
#include <utility>

#include "tests/load/exposition.hpp"

namespace hairnet::load {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::size_t kAnswerBytesMax = 4u << 20;

class PageRequest : public std::enable_shared_from_this<PageRequest> {
 public:
  PageRequest(asio::io_context& io, std::string_view path, std::function<void(std::string_view)> done)
      : socket_(io),
        timer_(io),
        request_("GET " + std::string(path) + " HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"),
        answer_(std::make_shared<std::string>()),
        done_(std::move(done)) {}

  void start(const asio::ip::tcp::endpoint& server, std::chrono::seconds wait) {
    timer_.expires_after(wait);
    timer_.async_wait([self = shared_from_this()](const error_code& ec) {
      error_code ignored;
      if (!ec) self->socket_.close(ignored);
    });
    socket_.async_connect(server, [self = shared_from_this()](const error_code& ec) {
      if (ec) return self->finish();
      self->ask();
    });
  }

 private:
  void ask() {
    asio::async_write(socket_, asio::buffer(request_), [self = shared_from_this()](const error_code& ec, std::size_t) {
      if (ec) return self->finish();
      asio::async_read(self->socket_, asio::dynamic_buffer(*self->answer_, kAnswerBytesMax),
                       [self](const error_code&, std::size_t) { self->finish(); });
    });
  }
  void finish() {
    timer_.cancel();
    done_(http_body(*answer_));
  }

  asio::ip::tcp::socket socket_;
  asio::steady_timer timer_;
  const std::string request_;
  std::shared_ptr<std::string> answer_;
  std::function<void(std::string_view)> done_;
};

}  // namespace

void get_page(asio::io_context& io, const asio::ip::tcp::endpoint& server, std::string_view path,
              std::chrono::seconds wait, std::function<void(std::string_view)> done) {
  std::make_shared<PageRequest>(io, path, std::move(done))->start(server, wait);
}

}  // namespace hairnet::load
