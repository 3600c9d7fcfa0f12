#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "schema/channel/packet_splitter.hpp"
#include "server/session/connection.hpp"
#include "server/transport/asio.hpp"
#include "server/transport/transport_counters.hpp"

namespace hairnet::server {

// One TCP socket: bytes read are cut into packets for the sink, packets to send are gathered and written. Two
// coroutines on the loop's serial executor keep it alive until both have ended.
class TcpConnection final : public Connection, public std::enable_shared_from_this<TcpConnection> {
 public:
  static constexpr std::size_t kUnsentBytesMax = std::size_t{256} << 10;  // above it, not writable
  static constexpr std::chrono::seconds kLinger{2};                       // for what waits when closed

  TcpConnection(asio::ip::tcp::socket socket, std::size_t packet_bytes_max, TransportCounters& counters);
  ~TcpConnection() override;

  void start(PacketSink* sink);  // null: it was refused and has been closed

  void send(std::vector<std::uint8_t> packet) override;
  [[nodiscard]] bool writable() const override { return !closing_ && unsent_.size() < kUnsentBytesMax; }
  void close(std::string_view reason) override;
  [[nodiscard]] std::string_view peer() const override { return peer_; }

 private:
  asio::awaitable<void> read();
  asio::awaitable<void> write();
  asio::awaitable<void> linger();
  void end(std::string_view reason);  // by the peer or the network
  void shut();

  asio::ip::tcp::socket socket_;
  asio::steady_timer wake_writer_, linger_;
  channel::PacketSplitter splitter_;
  TransportCounters* counters_;
  std::string peer_;
  PacketSink* sink_ = nullptr;        // null once closed
  std::vector<std::uint8_t> unsent_;  // gathered while `sending_` is on its way
  std::vector<std::uint8_t> sending_;
  bool closing_ = false, shut_ = false;
};

}  // namespace hairnet::server
