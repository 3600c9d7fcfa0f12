#include "server/transport/tcp_connection.hpp"

#include <array>
#include <utility>

#include "server/transport/io_loop.hpp"

namespace hairnet::server {
namespace {

constexpr std::size_t kReadBytes = std::size_t{64} << 10;

constexpr auto kAwaitable = asio::as_tuple(asio::use_awaitable);

std::string name_of(const asio::ip::tcp::socket& socket) {
  boost::system::error_code error;
  const auto endpoint = socket.remote_endpoint(error);
  return error ? "unknown" : endpoint.address().to_string() + ":" + std::to_string(endpoint.port());
}

}  // namespace

TcpConnection::TcpConnection(asio::ip::tcp::socket socket, std::size_t packet_bytes_max, TransportCounters& counters)
    : socket_(std::move(socket)),
      wake_writer_(socket_.get_executor()),
      linger_(socket_.get_executor()),
      splitter_(packet_bytes_max),
      counters_(&counters),
      peer_(name_of(socket_)) {
  boost::system::error_code ignored;
  socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
  wake_writer_.expires_at(asio::steady_timer::time_point::max());
}

TcpConnection::~TcpConnection() {
  counters_->connections_closed.add();
}

void TcpConnection::start(PacketSink* sink) {
  sink_ = sink;
  const auto self = shared_from_this();
  asio::co_spawn(
      socket_.get_executor(), [self] { return self->read(); }, asio::detached);
  asio::co_spawn(
      socket_.get_executor(), [self] { return self->write(); }, asio::detached);
}

asio::awaitable<void> TcpConnection::read() {
  std::vector<std::uint8_t> buffer(kReadBytes);
  while (!shut_) {
    const auto [error, count] = co_await socket_.async_read_some(asio::buffer(buffer), kAwaitable);
    if (error) {
      end(error == asio::error::eof ? "the peer closed" : error.message());
      co_return;
    }
    counters_->bytes_read.add(count);
    if (!sink_) continue;  // closing: what still comes is read away, so that our last bytes are not lost to a reset
    const std::int64_t now_ns = monotonic_now_ns();
    const bool sound = splitter_.feed({buffer.data(), count}, [&](std::span<const std::uint8_t> packet) {
      if (sink_) sink_->on_packet(packet, now_ns);
    });
    if (!sound && sink_) sink_->on_broken_stream(now_ns);
  }
}

asio::awaitable<void> TcpConnection::write() {
  while (!shut_) {
    if (unsent_.empty()) {
      if (closing_) break;
      co_await wake_writer_.async_wait(kAwaitable);
      continue;
    }
    sending_.clear();
    std::swap(sending_, unsent_);
    if (sink_) sink_->on_writable(monotonic_now_ns());
    const auto [error, count] = co_await asio::async_write(socket_, asio::buffer(sending_), kAwaitable);
    counters_->bytes_written.add(count);
    if (error) {
      end(error.message());
      co_return;
    }
  }
  // Half-closed first: the peer reads everything and then the end; its own end, or the linger time-out, ends the
  // reader.
  boost::system::error_code ignored;
  if (!shut_) socket_.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
}

asio::awaitable<void> TcpConnection::linger() {
  linger_.expires_after(kLinger);
  co_await linger_.async_wait(kAwaitable);
  shut();
}

void TcpConnection::send(std::vector<std::uint8_t> packet) {
  if (closing_) return;
  if (unsent_.empty())
    unsent_ = std::move(packet);
  else
    unsent_.insert(unsent_.end(), packet.begin(), packet.end());
  wake_writer_.cancel();
}

void TcpConnection::close(std::string_view) {
  if (closing_) return;
  closing_ = true;
  sink_ = nullptr;
  wake_writer_.cancel();
  asio::co_spawn(
      socket_.get_executor(), [self = shared_from_this()] { return self->linger(); }, asio::detached);
}

void TcpConnection::end(std::string_view reason) {
  shut();
  if (PacketSink* sink = std::exchange(sink_, nullptr)) sink->on_closed(reason, monotonic_now_ns());
}

void TcpConnection::shut() {
  if (shut_) return;
  shut_ = closing_ = true;
  boost::system::error_code ignored;
  socket_.close(ignored);
  wake_writer_.cancel();
  linger_.cancel();
}

}  // namespace hairnet::server
