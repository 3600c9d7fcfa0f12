#include "server/transport/tcp_connection.hpp"

#include <new>
#include <utility>

#include "core/assert.hpp"
#include "schema/limits.hpp"
#include "server/transport/io_loop.hpp"

namespace hairnet::server {
namespace {

// Up to this size copying costs less than gathering buffers in the system call.
constexpr std::size_t kFlatBytesMax = std::size_t{16} << 10;
// A larger buffer is freed after its write, so that one burst does not cost memory for the connection's life.
constexpr std::size_t kFlatKeptBytes = std::size_t{128} << 10;

}  // namespace

TcpConnection::TcpConnection(std::shared_ptr<ByteStream> stream, TransportCounters& counters)
    : stream_(std::move(stream)),
      // The timer never fires: send() wakes the writer by cancelling it.
      wake_writer_(stream_->get_executor(), asio::steady_timer::time_point::max()),
      splitter_(kHelloPacketBytesMax),
      counters_(&counters) {}

void TcpConnection::start(PacketSink* sink) {
  HAIRNET_ASSERT(!sink_);
  HAIRNET_ASSERT(sink || closing_);
  sink_ = sink;
  const auto self = shared_from_this();
  asio::co_spawn(
      stream_->get_executor(), [self] { return self->read(); }, asio::detached);
  asio::co_spawn(
      stream_->get_executor(), [self] { return self->write(); }, asio::detached);
}

asio::awaitable<void> TcpConnection::read() {
  // The buffer is not cleared, so that the system provides memory only for the used part.
  std::size_t buffer_bytes = 0;
  std::unique_ptr<std::uint8_t[]> buffer;
  while (!shut_) {
    // A stranger costs 16 KiB of buffer; only a session that has joined gets the larger one, which saves system calls.
    if (const std::size_t wanted = is_joined_ ? kReadBytes : kHelloPacketBytesMax; buffer_bytes < wanted) {
      buffer.reset(new (std::nothrow) std::uint8_t[wanted]);
      if (!buffer) {
        end("no memory was left");
        co_return;
      }
      buffer_bytes = wanted;
    }
    const auto [error, count] = co_await stream_->async_read_some(asio::buffer(buffer.get(), buffer_bytes), kAwaitable);
    if (error) {
      // A peer that closes its socket without TLS' own end is no error: browsers and phones do so.
      const bool ended = error == asio::error::eof || error == asio::ssl::error::stream_truncated;
      end(ended ? "the peer closed" : error.message());
      co_return;
    }
    counters_->bytes_read.add(count);
    counters_->received_bytes_tcp.add(count);
    // While the connection closes, what still arrives is dropped: unread bytes would reset the connection.
    if (!sink_) continue;
    const std::int64_t now_ns = channel::monotonic_ns();
    try {
      const bool valid = splitter_.feed({buffer.get(), count}, [&](std::span<const std::uint8_t> packet) {
        counters_->received_packets_tcp.add();
        if (sink_) sink_->on_packet(packet, now_ns);
      });
      // The sink may have closed the connection within on_packet(), so sink_ is asked again each time.
      if (!valid && sink_) sink_->on_broken_stream(now_ns);
    } catch (const std::bad_alloc&) {
      end("no memory was left");
    }
  }
}

asio::awaitable<void> TcpConnection::write() {
  while (!shut_) {
    if (unsent_.empty()) {
      if (closing_) break;
      co_await wake_writer_.async_wait(kAwaitable);
      continue;
    }
    HAIRNET_ASSERT(sending_.empty());
    HAIRNET_ASSERT(!is_writing_);
    // Packets that come during this write gather in unsent_ and leave together in the next one.
    std::swap(sending_, unsent_);
    is_writing_ = true;
    // The queue has just become empty. The session fills it while the system writes, so the connection never runs dry.
    if (sink_) sink_->on_writable(channel::monotonic_ns());
    if (const auto error = co_await write_out()) {
      end(error.message());
      co_return;
    }
    sending_.clear();
    is_writing_ = false;
    if (flat_.capacity() > kFlatKeptBytes) flat_ = std::vector<std::uint8_t>();
  }
  // Close only our direction first: the peer reads everything and then the end. The peer's own end, or the linger
  // time-out, ends the reader.
  if (!shut_) co_await stream_->end_writing();
}

asio::awaitable<boost::system::error_code> TcpConnection::write_out() {
  boost::system::error_code error;
  std::size_t count = 0;
  HAIRNET_ASSERT(!sending_.empty());
  if (sending_.packets.size() == 1) {
    std::tie(error, count) = co_await asio::async_write(*stream_, asio::buffer(sending_.packets[0]), kAwaitable);
  } else if (stream_->is_tls() || sending_.bytes <= kFlatBytesMax) {
    // One buffer becomes one record of TLS; without it each packet would have a record.
    flat_.clear();
    for (const auto& packet : sending_.packets) flat_.insert(flat_.end(), packet.begin(), packet.end());
    std::tie(error, count) = co_await asio::async_write(*stream_, asio::buffer(flat_), kAwaitable);
  } else {
    gathered_.clear();
    for (const auto& packet : sending_.packets) gathered_.push_back(asio::buffer(packet));
    std::tie(error, count) = co_await asio::async_write(*stream_, gathered_, kAwaitable);
  }
  count_written(count, error ? 0 : sending_.packets.size());
  co_return error;
}

void TcpConnection::count_written(std::size_t bytes, std::size_t packet_count) {
  counters_->bytes_written.add(bytes);
  counters_->sent_bytes_tcp.add(bytes);
  counters_->sent_packets_tcp.add(packet_count);
}

void TcpConnection::mark_joined() {
  is_joined_ = true;
  // Before this call a packet beyond kHelloPacketBytesMax breaks the stream, so strangers cannot fill the memory.
  splitter_.allow(wire::kPacketBytesMax);
}

void TcpConnection::send(std::vector<std::uint8_t> packet) {
  HAIRNET_ASSERT(!packet.empty());
  if (closing_) return;
  // The usual frame goes straight to the socket: no queue, no wake-up of the writer. Inside TLS a write is
  // asynchronous, and a packet that waits must not be overtaken.
  if (!is_writing_ && unsent_.empty() && !stream_->is_tls()) {
    const std::size_t bytes = stream_->write_now(packet);
    count_written(bytes, bytes == packet.size() ? 1 : 0);
    if (bytes == packet.size()) return;
    packet.erase(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(bytes));
  }
  unsent_.push(std::move(packet));
  wake_writer_.cancel();
}

void TcpConnection::close(std::string_view) {
  if (closing_) return;
  closing_ = true;
  sink_ = nullptr;
  // A connection that has not joined may wait until its peer has read the Goodbye, but only Admission::kLeavingMax of
  // them at a time. One that has joined always may.
  if (!is_joined_ && !stream_->move_to(Admission::Place::leaving)) {
    counters_->connections_cut_leaving.add();
    return shut();
  }
  wake_writer_.cancel();
  // A peer that neither reads nor closes is cut after this time.
  stream_->expires_after(kLinger);
}

void TcpConnection::end(std::string_view reason) {
  shut();
  if (PacketSink* sink = std::exchange(sink_, nullptr)) sink->on_closed(reason, channel::monotonic_ns());
}

void TcpConnection::shut() {
  if (shut_) return;
  shut_ = closing_ = true;
  stream_->close();
  wake_writer_.cancel();
}

}  // namespace hairnet::server
