#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "schema/channel/packet_splitter.hpp"
#include "server/session/connection.hpp"
#include "server/transport/byte_stream.hpp"
#include "server/transport/packet_queue.hpp"

namespace hairnet::server {

// Sends and receives size-prefixed packets over TCP, plain or inside TLS. send() writes a packet at once; packets that
// the system does not take, and all packets inside TLS, are queued and sent in one write. Two coroutines on the loop's
// serial executor, a reader and a writer, keep the object alive until both have ended.
class TcpConnection final : public Connection, public std::enable_shared_from_this<TcpConnection> {
 public:
  // Packets that wait when the connection closes have this long to leave; after it the socket is cut.
  static constexpr std::chrono::seconds kLinger{2};

  TcpConnection(std::shared_ptr<ByteStream> stream, TransportCounters& counters);

  // Begins to read and write. `sink` is null when the connection was refused and has been closed; it must live until
  // close() or PacketSink::on_closed.
  void start(PacketSink* sink);

  // These functions implement Connection (server/session/connection.hpp).
  void mark_joined() override;
  void send(std::vector<std::uint8_t> packet) override;
  [[nodiscard]] bool writable() const override { return !closing_ && unsent_.bytes < PacketQueue::kBytesMax; }
  void close(std::string_view reason) override;
  [[nodiscard]] std::string_view peer() const override { return stream_->peer(); }
  [[nodiscard]] std::string_view network() const override { return stream_->network(); }
  [[nodiscard]] std::string_view transport() const override { return stream_->is_tls() ? "tls" : "tcp"; }

 private:
  // The two coroutines of the connection. write() waits for send() or close().
  asio::awaitable<void> read();
  asio::awaitable<void> write();
  // Writes all of sending_.
  asio::awaitable<boost::system::error_code> write_out();
  // A packet counts when its last byte was given to the system; `packet_count` may be 0 for a part of one.
  void count_written(std::size_t bytes, std::size_t packet_count);
  // The peer or the network has ended the connection: closes the socket, and tells the sink once.
  void end(std::string_view reason);
  // Closes the socket at once, and lets both coroutines end. Does not tell the sink.
  void shut();

  std::shared_ptr<ByteStream> stream_;
  asio::steady_timer wake_writer_;
  channel::PacketSplitter splitter_;
  TransportCounters* counters_;
  // Null once closed.
  PacketSink* sink_ = nullptr;
  // send() fills unsent_ while sending_ is being written.
  PacketQueue unsent_, sending_;
  // Joins small packets, or those for TLS, for one write.
  std::vector<std::uint8_t> flat_;
  std::vector<asio::const_buffer> gathered_;
  // sending_ is being written.
  bool is_writing_ = false;
  // is_joined_: mark_joined() was called. closing_: close() was called, so nothing more is queued. shut_: the socket is
  // closed.
  bool is_joined_ = false, closing_ = false, shut_ = false;
};

}  // namespace hairnet::server
