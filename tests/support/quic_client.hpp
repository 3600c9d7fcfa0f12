#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "client/link/webtransport/quic_connection.hpp"
#include "schema/quic/socket_address.hpp"

namespace hairnet::quic {

using Bytes = std::vector<std::uint8_t>;

// Returns an address of the loopback, 127.0.0.`last`. Different last numbers make different clients, or one that has
// moved.
Address loopback(std::uint16_t port, std::uint8_t last = 1);

// The client's end of a QUIC connection, without sockets: a test passes its packets on, and sets its clock. It
// accepts every certificate, keeps itself alive with no pings, and stores what it receives.
class QuicClient : private link::QuicEvents {
 public:
  using Options = link::QuicOptions;

  QuicClient(const Path& path, std::int64_t now_ns, const Options& options = {});

  // Returns the packets that the connection wants to send now. Each is returned once.
  std::vector<Bytes> write(std::int64_t now_ns);
  void receive(std::span<const std::uint8_t> packet, std::int64_t now_ns);
  void poll(std::int64_t now_ns) { connection_->poll(now_ns); }
  void migrate(const Address& local, std::int64_t now_ns) { connection_->migrate(local, now_ns); }

  std::int64_t open_stream(bool one_way = false) { return connection_->open_stream(one_way); }
  void send(std::int64_t stream, const Bytes& bytes, bool is_last = false) {
    connection_->send(stream, bytes, is_last);
  }
  // Asks the server to send no more on a stream.
  void stop(std::int64_t stream) { connection_->stop_reading(stream, {}); }
  void send_datagram(Bytes bytes) { connection_->send_datagram(std::move(bytes)); }
  // Sends the control stream and a CONNECT request for a WebTransport session. Returns the session's stream.
  std::int64_t open_session(std::string_view authority = "localhost:7420", std::string_view path = "/ws",
                            std::string_view origin = "");
  // Opens the session's channel, its first two-way stream, and returns its number.
  std::int64_t open_channel(std::int64_t session);
  void close(std::int64_t now_ns) { connection_->close(http3::ErrorCode::no_error, "", now_ns); }
  // From now on no packet is sent or received, as when a cable is pulled.
  void go_silent() { is_silent_ = true; }

  [[nodiscard]] const Path& path() const { return connection_->path(); }
  [[nodiscard]] bool is_ready() const { return connection_->is_ready(); }
  // Returns the error of ngtcp2 that ended the connection; 0 means none.
  [[nodiscard]] int error() const { return connection_->error(); }
  [[nodiscard]] const std::string& reason() const { return connection_->reason(); }
  [[nodiscard]] ngtcp2_connection_close_error close_error() const { return connection_->close_error(); }

  // By stream: the bytes that came. All are taken at once, so the server's window is always open.
  std::map<std::int64_t, Bytes> received;
  // By stream: true once the server has ended it.
  std::map<std::int64_t, bool> ended;
  std::vector<Bytes> datagrams;

 private:
  void on_ready() override {}
  void on_stream_bytes(std::int64_t stream, std::span<const std::uint8_t> bytes, bool is_last) override;
  void on_stream_reset(std::int64_t, std::uint64_t) override {}
  void on_stream_stopped(std::int64_t) override {}
  void on_quic_datagram(std::span<const std::uint8_t> bytes) override {
    datagrams.emplace_back(bytes.begin(), bytes.end());
  }

  std::unique_ptr<link::QuicConnection> connection_;
  bool is_silent_ = false;
};

}  // namespace hairnet::quic
