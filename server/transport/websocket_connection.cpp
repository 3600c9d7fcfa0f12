#include "server/transport/websocket_connection.hpp"

#include <algorithm>
#include <new>
#include <utility>

#include "core/assert.hpp"
#include "schema/limits.hpp"
#include "server/transport/io_loop.hpp"

namespace hairnet::server {
namespace {

// After a message, memory of the read buffer beyond this size is freed.
constexpr std::size_t kKeptBytes = std::size_t{64} << 10;
// Packets of this many bytes together are copied and sent in one system call: up to this size, a copy costs less than
// another call.
constexpr std::size_t kCorkedBytesMax = std::size_t{32} << 10;

}  // namespace

WebSocketConnection::WebSocketConnection(std::shared_ptr<ByteStream> stream, const TransportOptions& options,
                                         TransportCounters& counters)
    : stream_(std::move(stream)),
      socket_(*stream_),
      // The timer never fires: send() wakes the writer by cancelling it.
      wake_writer_(stream_->get_executor(), asio::steady_timer::time_point::max()),
      counters_(&counters) {
  socket_.binary(true);
  // One packet is one message in one frame; browsers join fragments in any case, so splitting would only add headers.
  socket_.auto_fragment(false);
  socket_.read_message_max(kHelloPacketBytesMax);
  // The three values: the upgrade's time; the silence after which the peer counts as gone; and pings at half of this
  // silence.
  socket_.set_option(websocket::stream_base::timeout{options.opening_timeout, 2 * options.ping_after, true});
}

asio::awaitable<boost::system::error_code> WebSocketConnection::accept(const Request& request, bool with_subprotocol) {
  socket_.set_option(websocket::stream_base::decorator([with_subprotocol](websocket::response_type& response) {
    response.set(http::field::server, "hairnet");
    if (with_subprotocol) response.set(http::field::sec_websocket_protocol, kSubprotocol);
  }));
  const auto [error] = co_await socket_.async_accept(request, kAwaitable);
  co_return error;
}

void WebSocketConnection::start(PacketSink* sink) {
  HAIRNET_ASSERT(!sink_);
  HAIRNET_ASSERT(sink || closing_);
  sink_ = sink;
  const auto self = shared_from_this();
  asio::co_spawn(
      stream_->get_executor(), [self] { return self->read(); }, asio::detached);
  asio::co_spawn(
      stream_->get_executor(), [self] { return self->write(); }, asio::detached);
}

asio::awaitable<void> WebSocketConnection::read() {
  while (true) {
    // Reading in pieces lets the buffer grow with what has come. The announced length alone would make a stranger's
    // header cost memory.
    const auto [error, count] = co_await socket_.async_read_some(message_, kReadBytes, kAwaitable);
    if (error) {
      report_closed(count_end(error));
      break;
    }
    counters_->bytes_read.add(count);
    counters_->received_bytes_websocket.add(count);
    // The connection closes, so everything is read and dropped until the peer's own end.
    if (!sink_) {
      message_.consume(message_.size());
    } else if (!socket_.got_binary()) {
      // Text is refused at its first piece, before the rest of the message has come.
      counters_->websockets_closed_text.add();
      message_.consume(message_.size());
      // close_with() clears sink_, so it is copied before.
      PacketSink* sink = sink_;
      close_with(websocket::close_code::unknown_data, "packets are binary messages");
      sink->on_closed("a text message", channel::monotonic_ns());
    } else if (socket_.is_message_done()) {
      deliver();
    }
  }
  // The writer may be in the middle of a message that the peer no longer reads.
  closing_ = ended_ = true;
  wake_writer_.cancel();
  co_await stream_->close_gracefully();
}

void WebSocketConnection::deliver() {
  HAIRNET_ASSERT(sink_);
  counters_->received_packets_websocket.add();
  const auto bytes = message_.cdata();
  try {
    sink_->on_packet({static_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, channel::monotonic_ns());
  } catch (const std::bad_alloc&) {
    // The session whose packet found no memory ends; the others go on.
    report_closed("no memory was left");
    stream_->close();
  }
  message_.consume(message_.size());
  if (message_.capacity() > kKeptBytes) message_.shrink_to_fit();
}

asio::awaitable<void> WebSocketConnection::write() {
  while (!ended_) {
    if (unsent_.empty()) {
      if (closing_) break;
      co_await wake_writer_.async_wait(kAwaitable);
      continue;
    }
    HAIRNET_ASSERT(sending_.empty());
    std::swap(sending_, unsent_);
    if (sink_) sink_->on_writable(channel::monotonic_ns());
    if (const auto error = co_await write_out()) {
      // A reader that is failing the connection reports the reason by itself; if the socket is broken, the reader has
      // got the error too.
      if (error != asio::error::operation_aborted) stream_->close();
      co_return;
    }
    sending_.clear();
  }
  if (!ended_) co_await socket_.async_close(close_reason_, kAwaitable);
}

asio::awaitable<boost::system::error_code> WebSocketConnection::write_out() {
  const std::size_t count = sending_.packets.size();
  const bool together = sending_.bytes <= kCorkedBytesMax;
  for (std::size_t i = 0; i < count; ++i) {
    // The last message is written uncorked, and takes the buffered ones along in one system call.
    stream_->cork(together && i + 1 < count);
    const auto [error, bytes] = co_await socket_.async_write(asio::buffer(sending_.packets[i]), kAwaitable);
    counters_->bytes_written.add(bytes);
    counters_->sent_bytes_websocket.add(bytes);
    if (error) {
      stream_->cork(false);
      co_return error;
    }
    counters_->sent_packets_websocket.add();
  }
  co_return boost::system::error_code();
}

void WebSocketConnection::mark_joined() {
  is_joined_ = true;
  socket_.read_message_max(wire::kPacketBytesMax);
}

void WebSocketConnection::send(std::vector<std::uint8_t> packet) {
  if (closing_) return;
  unsent_.push(std::move(packet));
  wake_writer_.cancel();
}

void WebSocketConnection::close(std::string_view reason) {
  close_with(websocket::close_code::normal, reason);
}

void WebSocketConnection::close_with(websocket::close_code code, std::string_view reason) {
  if (closing_) return;
  closing_ = true;
  sink_ = nullptr;
  // A close frame has at most 125 bytes: 2 of the code, and the reason, which is cut at 100.
  close_reason_ = {code, beast::string_view(reason.data(), std::min<std::size_t>(reason.size(), 100))};
  if (!is_joined_ && !stream_->move_to(Admission::Place::leaving)) {
    counters_->connections_cut_leaving.add();
    return stream_->close();
  }
  wake_writer_.cancel();
  stream_->expires_after(kLinger);
}

std::string_view WebSocketConnection::count_end(const boost::system::error_code& error) {
  if (error == websocket::error::closed) return "the peer closed";
  // A closed tab or a lost network often ends a WebSocket without a close frame.
  if (error == asio::error::eof || error == asio::ssl::error::stream_truncated) return "the peer went";
  if (error == websocket::error::message_too_big) {
    counters_->websockets_closed_oversize.add();
    return "a message beyond the limit";
  }
  if (error == beast::error::timeout) {
    counters_->websockets_closed_timeout.add();
    return "no answer to a ping";
  }
  if (error == websocket::condition::protocol_violation) {
    counters_->websockets_closed_malformed.add();
    return "not a WebSocket frame";
  }
  return "the connection broke";
}

void WebSocketConnection::report_closed(std::string_view reason) {
  closing_ = true;
  if (PacketSink* sink = std::exchange(sink_, nullptr)) sink->on_closed(reason, channel::monotonic_ns());
}

void teardown(beast::role_type, ByteStream& stream, boost::system::error_code& error) {
  error = {};
  stream.close();
}

void beast_close_socket(ByteStream& stream) {
  stream.close();
}

}  // namespace hairnet::server
