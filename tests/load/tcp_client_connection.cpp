#include "tests/load/tcp_client_connection.hpp"

#include <netinet/in.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "schema/channel/monotonic_clock.hpp"
#include "schema/channel/packet_splitter.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::load {
namespace {

using asio::ip::tcp;
using boost::system::error_code;

// All connections read into one buffer of this size, since one thread serves them. The kernel buffer of a limited
// reader is small.
constexpr std::size_t kReceiveBytes = 256u << 10;
constexpr int kLimitedReceiveBytes = 8 << 10;
constexpr std::size_t kUnlimited = std::numeric_limits<std::size_t>::max();

std::string_view reason_of(const error_code& error) {
  if (error == asio::error::eof) return "by_server";
  if (error == asio::error::connection_refused) return "refused";
  if (error == asio::error::connection_reset || error == asio::error::broken_pipe) return "reset";
  if (error == asio::error::timed_out) return "timed_out";
  if (error == asio::error::no_descriptors) return "no_descriptors";
  if (error == asio::error::network_unreachable || error == asio::error::host_unreachable) return "unreachable";
  return "failed";
}

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(asio::io_context& io, ConnectionEvents& events, std::shared_ptr<std::vector<std::uint8_t>> buffer)
      : socket_(io), events_(&events), buffer_(std::move(buffer)), splitter_(wire::kPacketBytesMax) {}

  void connect(const tcp::endpoint& server, std::uint32_t host) {
    error_code error;
    socket_.open(server.protocol(), error);
    if (!error && host > 0 && server.address().is_v4() && server.address().is_loopback()) bind(host, error);
    if (error) {
      asio::post(socket_.get_executor(), [self = shared_from_this(), error] { self->fail(error); });
      return;
    }
    socket_.non_blocking(true, error);
    socket_.set_option(tcp::no_delay(true), error);
    socket_.async_connect(server, [self = shared_from_this()](const error_code& ec) { self->on_connected(ec); });
  }

  // The owner hears nothing more after this call.
  void abandon() {
    events_ = nullptr;
    error_code ignored;
    socket_.close(ignored);
  }

  void send(std::span<const std::uint8_t> bytes) {
    if (!events_ || sending_closed_) return;
    // A socket that is ready gets the bytes at once, without a turn of the loop. Only what the kernel does not take is
    // stored.
    if (unsent_.empty() && open_) {
      error_code error;
      const std::size_t count = socket_.write_some(asio::buffer(bytes.data(), bytes.size()), error);
      // The reader gets the same error, and reports it.
      if (error && error != asio::error::would_block) return;
      bytes = bytes.subspan(count);
    }
    if (bytes.empty()) return;
    unsent_.insert(unsent_.end(), bytes.begin(), bytes.end());
    wait_to_write();
  }

  void close_sending() {
    sending_closed_ = true;
    error_code ignored;
    if (unsent_.empty() && open_) socket_.shutdown(tcp::socket::shutdown_send, ignored);
  }

  // Reads so many bytes more, and then nothing until the next call.
  void limit_reading(std::size_t bytes) {
    // With its default buffer the kernel would receive megabytes, although nobody reads them.
    error_code ignored;
    if (readable_ == kUnlimited)
      socket_.set_option(asio::socket_base::receive_buffer_size(kLimitedReceiveBytes), ignored);
    readable_ = bytes;
    wait_to_read();
  }

  [[nodiscard]] std::size_t unsent_bytes() const { return unsent_.size(); }

 private:
  void bind(std::uint32_t host, error_code& error) {
    const asio::detail::socket_option::boolean<IPPROTO_IP, IP_BIND_ADDRESS_NO_PORT> port_later(true);
    // A port that is chosen at bind() is blocked for a minute after its connection. One address would then have ports
    // for 28 000 connections a minute only.
    socket_.set_option(port_later, error);
    socket_.bind({asio::ip::address_v4(0x7f000000u + host), 0}, error);
  }

  void on_connected(const error_code& error) {
    if (!events_) return;
    if (error) return fail(error);
    open_ = true;
    wait_to_read();
    events_->on_open(channel::monotonic_ns());
  }

  void wait_to_read() {
    if (reading_ || !open_ || readable_ == 0) return;
    reading_ = true;
    socket_.async_wait(tcp::socket::wait_read, [self = shared_from_this()](const error_code& ec) {
      self->reading_ = false;
      self->read(ec);
    });
  }

  void read(error_code error) {
    if (!events_) return;
    if (error) return fail(error);
    const std::size_t wanted = std::min(buffer_->size(), readable_);
    const std::size_t count = socket_.read_some(asio::buffer(buffer_->data(), wanted), error);
    if (error == asio::error::would_block) return wait_to_read();
    if (error) return fail(error);
    if (readable_ != kUnlimited) readable_ -= count;
    const std::int64_t arrival_ns = channel::monotonic_ns();
    const bool valid = splitter_.feed({buffer_->data(), count}, [&](std::span<const std::uint8_t> packet) {
      if (events_) events_->on_packet(packet, arrival_ns);
    });
    if (!events_) return;
    if (!valid) {
      events_->on_closed("stream_broken", arrival_ns);
      return;
    }
    wait_to_read();
  }

  void wait_to_write() {
    if (writing_ || !open_ || unsent_.empty()) return;
    writing_ = true;
    socket_.async_wait(tcp::socket::wait_write, [self = shared_from_this()](const error_code& ec) {
      self->writing_ = false;
      self->write(ec);
    });
  }

  void write(error_code error) {
    if (!events_ || error) return;
    const std::size_t count = socket_.write_some(asio::buffer(unsent_), error);
    if (error && error != asio::error::would_block) return;
    unsent_.erase(unsent_.begin(), unsent_.begin() + static_cast<std::ptrdiff_t>(count));
    if (unsent_.empty() && sending_closed_) socket_.shutdown(tcp::socket::shutdown_send, error);
    wait_to_write();
  }

  void fail(const error_code& error) {
    if (events_) events_->on_closed(reason_of(error), channel::monotonic_ns());
  }

  tcp::socket socket_;
  ConnectionEvents* events_;
  std::shared_ptr<std::vector<std::uint8_t>> buffer_;
  channel::PacketSplitter splitter_;
  std::vector<std::uint8_t> unsent_;
  std::size_t readable_ = kUnlimited;
  bool open_ = false, reading_ = false, writing_ = false, sending_closed_ = false;
};

class TcpClientConnection final : public ClientConnection {
 public:
  explicit TcpClientConnection(std::shared_ptr<Connection> connection) : connection_(std::move(connection)) {}
  ~TcpClientConnection() override { connection_->abandon(); }
  TcpClientConnection(const TcpClientConnection&) = delete;
  TcpClientConnection& operator=(const TcpClientConnection&) = delete;
  void send(std::span<const std::uint8_t> bytes) override { connection_->send(bytes); }
  void close_sending() override { connection_->close_sending(); }
  void limit_reading(std::size_t bytes) override { connection_->limit_reading(bytes); }
  [[nodiscard]] std::size_t unsent_bytes() const override { return connection_->unsent_bytes(); }

 private:
  std::shared_ptr<Connection> connection_;
};

}  // namespace

Result<tcp::endpoint> resolve(const Address& address) {
  asio::io_context io;
  error_code error;
  const auto found = tcp::resolver(io).resolve(address.host, std::to_string(address.port), error);
  if (error || found.empty()) return Refusal("cannot find " + address.host + ": " + error.message());
  return found.begin()->endpoint();
}

TcpConnector::TcpConnector(asio::io_context& io, tcp::endpoint server)
    : io_(&io),
      server_(std::move(server)),
      receive_buffer_(std::make_shared<std::vector<std::uint8_t>>(kReceiveBytes)) {}

std::unique_ptr<ClientConnection> TcpConnector::connect(ConnectionEvents& events, std::uint32_t host) {
  auto connection = std::make_shared<Connection>(*io_, events, receive_buffer_);
  connection->connect(server_, host);
  return std::make_unique<TcpClientConnection>(std::move(connection));
}

}  // namespace hairnet::load
