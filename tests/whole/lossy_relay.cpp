#include "tests/whole/lossy_relay.hpp"

#include <boost/asio.hpp>
#include <chrono>
#include <map>
#include <random>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace hairnet::whole {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kPacketBytesMax = 65'536;
// A late packet is delayed by more than the packets of one burst are apart, so that newer ones overtake it.
constexpr int kLate_ms = 15;
// The server sends fewer packets than this in a handshake of QUIC, so a client with as many answers is connected.
constexpr std::uint64_t kHandshakeAnswers = 20;

asio::awaitable<void> copy(std::shared_ptr<tcp::socket> from, std::shared_ptr<tcp::socket> to) {
  Bytes bytes(kPacketBytesMax);
  boost::system::error_code error;
  while (!error) {
    const std::size_t count =
        co_await from->async_read_some(asio::buffer(bytes), asio::redirect_error(asio::use_awaitable, error));
    if (!error)
      co_await asio::async_write(*to, asio::buffer(bytes, count), asio::redirect_error(asio::use_awaitable, error));
  }
  boost::system::error_code ignored;
  to->shutdown(tcp::socket::shutdown_send, ignored);
}

}  // namespace

struct LossyRelay::Impl {
  // The server sees each client as this socket.
  struct Client {
    udp::endpoint address;
    std::shared_ptr<udp::socket> socket;
    // The number of packets that came for it.
    std::uint64_t answer_count = 0;
  };

  LossyRelay* relay;
  std::array<Line, 2> lines;
  std::mt19937_64 random;
  asio::io_context io{1};
  asio::ip::address server;
  udp::socket packets{io};
  tcp::acceptor acceptor{io};
  std::map<udp::endpoint, std::shared_ptr<Client>> clients;
  std::thread thread;

  Impl(LossyRelay& owner, const std::array<Line, 2>& bad, std::uint64_t seed)
      : relay(&owner), lines(bad), random(seed) {}

  [[nodiscard]] std::uint16_t port() const { return packets.local_endpoint().port(); }

  bool happens(double share) { return std::uniform_real_distribution(0.0, 1.0)(random) < share; }

  // Passes a UDP packet on as the line does: never, once or twice, and each copy perhaps late.
  void pass(Direction direction, Bytes bytes, std::shared_ptr<Client> client) {
    const Line& line = lines[direction];
    if (happens(line.lost)) {
      ++relay->lost_[direction];
      return;
    }
    ++relay->passed_[direction];
    const auto shared = std::make_shared<Bytes>(std::move(bytes));
    for (int copies = happens(line.repeated) ? 2 : 1; copies > 0; --copies) {
      const auto timer = std::make_shared<asio::steady_timer>(io);
      timer->expires_after(std::chrono::milliseconds(line.delay_ms + (happens(line.late) ? kLate_ms : 0)));
      timer->async_wait([this, timer, shared, direction, client](const boost::system::error_code& error) {
        if (error) return;
        // A packet that cannot be sent is lost, as on a real line.
        boost::system::error_code ignored;
        if (direction == to_server)
          client->socket->send(asio::buffer(*shared), 0, ignored);
        else
          packets.send_to(asio::buffer(*shared), client->address, 0, ignored);
      });
    }
  }

  // Gives the client a socket, and so an address, of its own towards the server.
  void connect(const std::shared_ptr<Client>& client) {
    client->socket = std::make_shared<udp::socket>(io, server.is_v6() ? udp::v6() : udp::v4());
    client->socket->connect({server, port()});
    asio::co_spawn(io, answers(client, client->socket), asio::detached);
  }

  asio::awaitable<void> answers(std::shared_ptr<Client> client, std::shared_ptr<udp::socket> socket) {
    Bytes bytes(kPacketBytesMax);
    for (;;) {
      boost::system::error_code error;
      const std::size_t count =
          co_await socket->async_receive(asio::buffer(bytes), asio::redirect_error(asio::use_awaitable, error));
      if (!socket->is_open()) co_return;
      if (error) continue;
      ++client->answer_count;
      pass(to_client, Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count)), client);
    }
  }

  asio::awaitable<void> requests() {
    Bytes bytes(kPacketBytesMax);
    for (;;) {
      udp::endpoint from;
      boost::system::error_code error;
      const std::size_t count = co_await packets.async_receive_from(asio::buffer(bytes), from,
                                                                    asio::redirect_error(asio::use_awaitable, error));
      if (error) continue;
      std::shared_ptr<Client>& client = clients[from];
      if (!client) {
        client = std::make_shared<Client>(Client{from, nullptr, 0});
        connect(client);
      }
      pass(to_server, Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count)), client);
    }
  }

  // TCP connections are passed on whole: the pages that say how to connect come this way.
  asio::awaitable<void> connections() {
    for (;;) {
      const auto near = std::make_shared<tcp::socket>(co_await acceptor.async_accept(asio::use_awaitable));
      const auto far = std::make_shared<tcp::socket>(io);
      boost::system::error_code error;
      co_await far->async_connect({server, port()}, asio::redirect_error(asio::use_awaitable, error));
      if (error) continue;
      asio::co_spawn(io, copy(near, far), asio::detached);
      asio::co_spawn(io, copy(far, near), asio::detached);
    }
  }
};

LossyRelay::LossyRelay(const std::string& client_side, const std::string& server_side, std::uint16_t port,
                       const std::array<Line, 2>& lines, std::uint64_t seed)
    : impl_(std::make_unique<Impl>(*this, lines, seed)) {
  const asio::ip::address here = asio::ip::make_address(client_side);
  impl_->server = asio::ip::make_address(server_side);
  const udp::endpoint address(here, port);
  impl_->packets.open(address.protocol());
  impl_->packets.bind(address);
  impl_->acceptor.open(here.is_v6() ? tcp::v6() : tcp::v4());
  impl_->acceptor.set_option(tcp::acceptor::reuse_address(true));
  impl_->acceptor.bind({here, port});
  impl_->acceptor.listen();
  asio::co_spawn(impl_->io, impl_->requests(), asio::detached);
  asio::co_spawn(impl_->io, impl_->connections(), asio::detached);
  impl_->thread = std::thread([impl = impl_.get()] { impl->io.run(); });
}

LossyRelay::~LossyRelay() {
  impl_->io.stop();
  impl_->thread.join();
}

void LossyRelay::change_network() {
  asio::post(impl_->io, [impl = impl_.get()] {
    for (auto& [address, client] : impl->clients) {
      if (client->answer_count < kHandshakeAnswers) continue;
      // The next packet comes to the server from another port, as when a NAT forgets its mapping.
      client->socket->close();
      impl->connect(client);
    }
  });
}

void LossyRelay::repair() {
  asio::post(impl_->io, [impl = impl_.get()] { impl->lines = {}; });
}

}  // namespace hairnet::whole
