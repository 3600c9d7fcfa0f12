#include "tests/load/stream_client_connection.hpp"

#include <deque>
#include <limits>
#include <utility>
#include <vector>

#include "client/link/server_stream.hpp"
#include "schema/channel/monotonic_clock.hpp"
#include "schema/channel/packet_splitter.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::load {
namespace {

using boost::system::error_code;

constexpr std::size_t kAnyBytes = std::numeric_limits<std::size_t>::max();

class StreamConnection : public std::enable_shared_from_this<StreamConnection> {
 public:
  // `attempt`: the same stream, if it is WebTransport; else null.
  StreamConnection(asio::io_context& io, ConnectionEvents& events, std::shared_ptr<link::ServerStream> stream,
                   std::shared_ptr<link::WebTransportAttempt> attempt)
      : stream_(std::move(stream)),
        attempt_(std::move(attempt)),
        events_(&events),
        may_read_(io, asio::steady_timer::time_point::max()),
        may_write_(io, asio::steady_timer::time_point::max()),
        splitter_(wire::kPacketBytesMax) {}

  void start(asio::io_context& io) {
    asio::post(io, [&io, self = shared_from_this()] { asio::co_spawn(io, self->receive(self), asio::detached); });
  }
  // The owner hears nothing more after this call.
  void abandon() {
    events_ = nullptr;
    stream_->close();
    may_read_.cancel();
    may_write_.cancel();
  }
  void send(std::span<const std::uint8_t> bytes, bool may_be_lost) {
    if (!events_ || sending_closed_ || bytes.empty()) return;
    unsent_bytes_ += bytes.size();
    unsent_.push_back({{bytes.begin(), bytes.end()}, may_be_lost});
    may_write_.cancel();
  }
  void close_sending() {
    sending_closed_ = true;
    may_write_.cancel();
  }
  void limit_reading(std::size_t bytes) {
    readable_ = bytes;
    may_read_.cancel();
  }
  [[nodiscard]] std::size_t unsent_bytes() const { return unsent_bytes_; }
  [[nodiscard]] bool has_datagrams() const { return stream_->has_datagrams(); }

 private:
  struct Unsent {
    std::vector<std::uint8_t> bytes;
    bool may_be_lost = false;
  };

  asio::awaitable<void> receive(std::shared_ptr<StreamConnection> self) {
    std::string error = co_await stream_->open();
    if (!events_) {
      stream_->close();
      co_return;
    }
    if (error.empty()) {
      asio::co_spawn(may_write_.get_executor(), transmit(self), asio::detached);
      events_->on_open(channel::monotonic_ns());
    }
    while (events_ && error.empty()) {
      co_await until_readable();
      if (!events_) co_return;
      const link::ServerStream::Read read = co_await stream_->read();
      error = read.error;
      if (!error.empty()) break;
      const bool is_valid = co_await take(read);
      if (!is_valid) error = "the server sent a size that no packet has";
    }
    if (events_) events_->on_closed(error, channel::monotonic_ns());
  }

  // QUIC goes on meanwhile: who reads slowly still answers.
  asio::awaitable<void> until_readable() {
    while (events_ && readable_ == 0) {
      bool goes_on = false;
      if (attempt_) goes_on = co_await attempt_->rest();
      if (!goes_on) co_await wait(may_read_);
    }
  }

  // Takes no more bytes at once than may be read. False when the stream holds no packets.
  asio::awaitable<bool> take(const link::ServerStream::Read& read) {
    const auto pass = [this](std::span<const std::uint8_t> packet) {
      if (events_) events_->on_packet(packet, channel::monotonic_ns());
    };
    if (read.is_packet) {
      count_read(read.bytes.size());
      pass(read.bytes);
      co_return true;
    }
    for (std::span<const std::uint8_t> left = read.bytes; events_ && !left.empty();) {
      co_await until_readable();
      const std::size_t count = std::min(left.size(), readable_);
      count_read(count);
      if (!splitter_.feed(left.first(count), pass)) co_return false;
      left = left.subspan(count);
    }
    co_return true;
  }
  void count_read(std::size_t bytes) {
    if (readable_ != kAnyBytes) readable_ -= std::min(readable_, bytes);
  }

  asio::awaitable<void> transmit(std::shared_ptr<StreamConnection>) {
    while (events_) {
      if (!unsent_.empty()) {
        const Unsent next = std::move(unsent_.front());
        unsent_.pop_front();
        const bool is_written = co_await stream_->write(next.bytes, next.may_be_lost);
        unsent_bytes_ -= next.bytes.size();
        // The reader gets the same error, and reports it.
        if (!is_written) co_return;
      } else if (sending_closed_) {
        stream_->half_close();
        co_return;
      } else {
        co_await wait(may_write_);
      }
    }
  }

  static asio::awaitable<void> wait(asio::steady_timer& timer) {
    error_code ignored;
    co_await timer.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }

  std::shared_ptr<link::ServerStream> stream_;
  std::shared_ptr<link::WebTransportAttempt> attempt_;
  ConnectionEvents* events_;
  // The reader and the writer wait on these timers, which never fire. Cancelling one lets its coroutine continue.
  asio::steady_timer may_read_, may_write_;
  channel::PacketSplitter splitter_;
  std::deque<Unsent> unsent_;
  std::size_t unsent_bytes_ = 0, readable_ = kAnyBytes;
  bool sending_closed_ = false;
};

class StreamClientConnection final : public ClientConnection {
 public:
  explicit StreamClientConnection(std::shared_ptr<StreamConnection> connection) : connection_(std::move(connection)) {}
  ~StreamClientConnection() override { connection_->abandon(); }
  StreamClientConnection(const StreamClientConnection&) = delete;
  StreamClientConnection& operator=(const StreamClientConnection&) = delete;
  void send(std::span<const std::uint8_t> bytes) override { connection_->send(bytes, false); }
  [[nodiscard]] bool has_datagrams() const override { return connection_->has_datagrams(); }
  void send_unreliably(std::span<const std::uint8_t> bytes) override { connection_->send(bytes, true); }
  void close_sending() override { connection_->close_sending(); }
  void limit_reading(std::size_t bytes) override { connection_->limit_reading(bytes); }
  [[nodiscard]] std::size_t unsent_bytes() const override { return connection_->unsent_bytes(); }

 private:
  std::shared_ptr<StreamConnection> connection_;
};

class StreamConnector final : public Connector {
 public:
  StreamConnector(asio::io_context& io, Transport transport, const Address& server) : io_(&io), transport_(transport) {
    options_.server.host = server.host;
    options_.server.port = server.port;
    options_.server.transport = transport == Transport::tls  ? link::Transport::tls
                                : transport == Transport::ws ? link::Transport::ws
                                                             : link::Transport::tcp;
    // A load test takes any certificate, such as one that was made for the test.
    options_.tls.insecure = true;
  }
  std::unique_ptr<ClientConnection> connect(ConnectionEvents& events, std::uint32_t host) override {
    link::StreamOptions options = options_;
    error_code no_address;
    const auto server = asio::ip::make_address(options.server.host, no_address);
    // On the loopback every client may have an address of its own in 127.0.0.0/8, so that the server's limits for one
    // address do not count all of them as one.
    if (host > 0 && !no_address && server.is_v4() && server.is_loopback())
      options.local = asio::ip::address_v4(0x7f000000u + host);
    std::shared_ptr<link::ServerStream> stream;
    std::shared_ptr<link::WebTransportAttempt> attempt;
    if (transport_ == Transport::webtransport)
      stream = attempt = link::make_web_transport_stream(*io_, std::move(options), memory_);
    else
      stream = link::make_server_stream(*io_, std::move(options));
    auto connection = std::make_shared<StreamConnection>(*io_, events, std::move(stream), std::move(attempt));
    connection->start(*io_);
    return std::make_unique<StreamClientConnection>(std::move(connection));
  }

 private:
  asio::io_context* io_;
  const Transport transport_;
  link::StreamOptions options_;
  std::shared_ptr<link::WebTransportMemory> memory_ = std::make_shared<link::WebTransportMemory>();
};

}  // namespace

std::unique_ptr<Connector> make_connector(asio::io_context& io, Transport transport, const Address& server,
                                          const asio::ip::tcp::endpoint& endpoint) {
  if (transport == Transport::tcp) return std::make_unique<TcpConnector>(io, endpoint);
  return std::make_unique<StreamConnector>(io, transport, server);
}

}  // namespace hairnet::load
