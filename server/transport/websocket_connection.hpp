#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "server/session/connection.hpp"
#include "server/transport/beast.hpp"
#include "server/transport/byte_stream.hpp"
#include "server/transport/packet_queue.hpp"
#include "server/transport/transport_options.hpp"

namespace hairnet::server {

// Sends and receives packets over a WebSocket, each as one binary message. Two coroutines on the loop's serial
// executor, a reader and a writer, keep the object alive until both have ended.
class WebSocketConnection final : public Connection, public std::enable_shared_from_this<WebSocketConnection> {
 public:
  // The path of the upgrade request, and the subprotocol that a client may offer.
  static constexpr std::string_view kPath = "/ws";
  static constexpr std::string_view kSubprotocol = "hairnet";
  // After close(), the packets that wait have this long to be sent, and the peer's close frame to come.
  static constexpr std::chrono::seconds kLinger{2};

  using Request = http::request<http::string_body>;

  WebSocketConnection(std::shared_ptr<ByteStream> stream, const TransportOptions& options, TransportCounters& counters);

  // Answers the upgrade request, or refuses it. The answer names the subprotocol if the client offered it.
  asio::awaitable<boost::system::error_code> accept(const Request& request, bool with_subprotocol);
  // Begins to read and write. `sink` is null when the connection was refused and has been closed.
  void start(PacketSink* sink);

  // These functions implement Connection (server/session/connection.hpp).
  void mark_joined() override;
  void send(std::vector<std::uint8_t> packet) override;
  [[nodiscard]] bool writable() const override { return !closing_ && unsent_.bytes < PacketQueue::kBytesMax; }
  void close(std::string_view reason) override;
  [[nodiscard]] std::string_view peer() const override { return stream_->peer(); }
  [[nodiscard]] std::string_view network() const override { return stream_->network(); }
  [[nodiscard]] std::string_view transport() const override { return stream_->is_tls() ? "wss" : "ws"; }

 private:
  // The two coroutines of the connection. write() waits for send() or close().
  asio::awaitable<void> read();
  asio::awaitable<void> write();
  // Sends sending_, a message for each packet, in as few system calls as their size allows.
  asio::awaitable<boost::system::error_code> write_out();
  // Gives the message that was read to the sink.
  void deliver();
  // Lets the writer send what waits, and then a close frame. Does not tell the sink.
  void close_with(websocket::close_code code, std::string_view reason);
  // Counts the reason why the reader has ended, and returns this reason in words for the log.
  std::string_view count_end(const boost::system::error_code& error);
  // The peer or the network has ended the connection: tells the sink once.
  void report_closed(std::string_view reason);

  std::shared_ptr<ByteStream> stream_;
  // The template's `false` leaves out compression: frames are packed bits, and compression would keep memory for each
  // connection.
  websocket::stream<ByteStream&, false> socket_;
  beast::flat_buffer message_;
  asio::steady_timer wake_writer_;
  TransportCounters* counters_;
  // Null once closed.
  PacketSink* sink_ = nullptr;
  // send() fills unsent_ while sending_ is being written.
  PacketQueue unsent_, sending_;
  websocket::close_reason close_reason_{websocket::close_code::normal};
  bool is_joined_ = false, closing_ = false, ended_ = false;
};

// Beast calls it to end the socket below the WebSocket.
template <class Handler>
void async_teardown(beast::role_type, ByteStream& stream, Handler&& handler) {
  asio::co_spawn(
      stream.get_executor(), [self = stream.shared_from_this()] { return self->end_writing(); },
      asio::bind_executor(stream.get_executor(),
                          [handler = std::forward<Handler>(handler)](const std::exception_ptr&) mutable {
                            std::move(handler)(boost::system::error_code());
                          }));
}
void teardown(beast::role_type, ByteStream& stream, boost::system::error_code& error);
void beast_close_socket(ByteStream& stream);

}  // namespace hairnet::server
