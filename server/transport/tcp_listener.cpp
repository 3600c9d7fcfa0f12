#include "server/transport/tcp_listener.hpp"

#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "server/transport/io_loop_core.hpp"
#include "server/transport/tcp_connection.hpp"

namespace hairnet::server {
namespace {

using asio::ip::tcp;

// After a failed accept (no file descriptors left, say) the next try waits, so that it does not spin.
constexpr std::chrono::milliseconds kRetry{100};

std::string shown(const TcpListenerDef& def) {
  const bool is_v6 = def.address.find(':') != std::string::npos;
  return (is_v6 ? "[" + def.address + "]" : def.address) + ":" + std::to_string(def.port);
}

}  // namespace

struct TcpListener::Impl {
  Impl(const SerialExecutor& executor, const TcpListenerDef& d, TransportCounters& c, OnConnection on)
      : acceptor(executor), def(d), counters(&c), on_connection(std::move(on)) {}

  tcp::acceptor acceptor;
  TcpListenerDef def;
  TransportCounters* counters;
  OnConnection on_connection;

  boost::system::error_code listen() {
    boost::system::error_code error;
    const auto address = asio::ip::make_address(def.address, error);
    if (error) return error;
    const tcp::endpoint endpoint(address, def.port);
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    return error;
  }

  static asio::awaitable<void> accept(std::shared_ptr<Impl> self) {
    asio::steady_timer retry(self->acceptor.get_executor());
    while (self->acceptor.is_open()) {
      auto [error, socket] = co_await self->acceptor.async_accept(asio::as_tuple(asio::use_awaitable));
      if (!self->acceptor.is_open()) co_return;
      if (error) {
        self->counters->accepts_failed.add();
        spdlog::warn("a connection could not be accepted: {}", error.message());
        retry.expires_after(kRetry);
        co_await retry.async_wait(asio::as_tuple(asio::use_awaitable));
        continue;
      }
      self->counters->connections_accepted.add();
      auto connection = std::make_shared<TcpConnection>(std::move(socket), self->def.packet_bytes_max, *self->counters);
      PacketSink* sink = self->on_connection(connection, monotonic_now_ns());
      connection->start(sink);
    }
  }
};

Result<std::unique_ptr<TcpListener>> TcpListener::create(IoLoop& loop, const TcpListenerDef& def,
                                                         TransportCounters& counters, OnConnection on_connection) {
  auto impl = std::make_shared<Impl>(loop.core().serial, def, counters, std::move(on_connection));
  if (const auto error = impl->listen()) return Refusal("cannot listen on " + shown(def) + ": " + error.message());
  asio::co_spawn(loop.core().serial, Impl::accept(impl), asio::detached);
  return std::unique_ptr<TcpListener>(new TcpListener(std::move(impl)));
}

TcpListener::TcpListener(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

TcpListener::~TcpListener() {
  close();
}

std::uint16_t TcpListener::port() const {
  boost::system::error_code ignored;
  return impl_->acceptor.local_endpoint(ignored).port();
}

void TcpListener::close() {
  boost::system::error_code ignored;
  impl_->acceptor.close(ignored);
}

}  // namespace hairnet::server
