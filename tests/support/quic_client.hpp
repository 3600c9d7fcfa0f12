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

// 127.0.0.1, or another address of 127.0.0.0/8.
Address loopback(std::uint16_t port, std::uint8_t last = 1);

// The client's end of a QUIC connection that stores what it is told: for tests. It takes every certificate.
class QuicClient : private link::QuicEvents {
 public:
  using Options = link::QuicOptions;

  QuicClient(const Path& path, std::int64_t now_ns, const Options& options = {});

  // The packets that it wants to send, each once.
  std::vector<Bytes> write(std::int64_t now_ns);
  void receive(std::span<const std::uint8_t> packet, std::int64_t now_ns);
  void poll(std::int64_t now_ns) { connection_->poll(now_ns); }
  void migrate(const Address& local, std::int64_t now_ns) { connection_->migrate(local, now_ns); }

  std::int64_t open_stream(bool one_way = false) { return connection_->open_stream(one_way); }
  void send(std::int64_t stream, const Bytes& bytes, bool is_last = false) {
    connection_->send(stream, bytes, is_last);
  }
  void stop(std::int64_t stream) { connection_->stop_reading(stream, {}); }  // its bytes are not wanted
  void send_datagram(Bytes bytes) { connection_->send_datagram(std::move(bytes)); }
  // Control stream, CONNECT, channel. The channel's number is returned.
  std::int64_t open_session(std::string_view authority = "localhost:7420", std::string_view path = "/ws",
                            std::string_view origin = "");
  std::int64_t open_channel(std::int64_t session);
  void close(std::int64_t now_ns) { connection_->close(http3::ErrorCode::no_error, "", now_ns); }
  void go_silent() { is_silent_ = true; }  // sends nothing more

  [[nodiscard]] const Path& path() const { return connection_->path(); }
  [[nodiscard]] bool is_ready() const { return connection_->is_ready(); }
  // The code of a QUIC library that ended it; 0: none did.
  [[nodiscard]] int error() const { return connection_->error(); }
  [[nodiscard]] const std::string& reason() const { return connection_->reason(); }
  [[nodiscard]] ngtcp2_connection_close_error close_error() const { return connection_->close_error(); }

  std::map<std::int64_t, Bytes> received;  // by stream
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
