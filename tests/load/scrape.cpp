#include "tests/load/scrape.hpp"

#include <chrono>
#include <memory>
#include <string>
#include <utility>

namespace hairnet::load {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::chrono::seconds kWait{1};
constexpr std::size_t kAnswerBytesMax = 4u << 20;

class Scrape : public std::enable_shared_from_this<Scrape> {
 public:
  Scrape(asio::io_context& io, std::function<void(Exposition)> done)
      : socket_(io), timer_(io), answer_(std::make_shared<std::string>()), done_(std::move(done)) {}

  void start(const asio::ip::tcp::endpoint& server) {
    timer_.expires_after(kWait);
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
    done_(parse_exposition(http_body(*answer_)));
  }

  asio::ip::tcp::socket socket_;
  asio::steady_timer timer_;
  const std::string request_ = "GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
  std::shared_ptr<std::string> answer_;
  std::function<void(Exposition)> done_;
};

}  // namespace

void scrape(asio::io_context& io, const asio::ip::tcp::endpoint& server, std::function<void(Exposition)> done) {
  std::make_shared<Scrape>(io, std::move(done))->start(server);
}

}  // namespace hairnet::load
