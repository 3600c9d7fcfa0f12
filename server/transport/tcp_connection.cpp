#include "server/transport/tcp_connection.hpp"

#include <new>
#include <utility>

#include "core/assert.hpp"
#include "schema/limits.hpp"
#include "server/transport/io_loop.hpp"

namespace hairnet::server {
namespace {

constexpr std::size_t kFlatBytesMax = std::size_t{16} << 10;  // up to this size copying costs less than gathering
constexpr std::size_t kFlatKeptBytes = std::size_t{128} << 10;

}  // namespace

TcpConnection::TcpConnection(std::shared_ptr<ByteStream> stream, TransportCounters& counters)
    : stream_(std::move(stream)),
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
  // Not cleared, so that the system provides memory only for the used part.
  std::size_t buffer_bytes = kHelloPacketBytesMax;
  auto buffer = std::make_unique_for_overwrite<std::uint8_t[]>(buffer_bytes);
  while (!shut_) {
    if (is_joined_ && buffer_bytes < kReadBytes) {
      buffer_bytes = kReadBytes;
      buffer = std::make_unique_for_overwrite<std::uint8_t[]>(buffer_bytes);
    }
    const auto [error, count] = co_await stream_->async_read_some(asio::buffer(buffer.get(), buffer_bytes), kAwaitable);
    if (error) {
      const bool ended = error == asio::error::eof || error == asio::ssl::error::stream_truncated;
      end(ended ? "the peer closed" : error.message());
      co_return;
    }
    counters_->bytes_read.add(count);
    counters_->received_bytes_tcp.add(count);
    if (!sink_) continue;  // closing: drop what still arrives; unread bytes would reset the connection
    const std::int64_t now_ns = channel::monotonic_ns();
    try {
      const bool sound = splitter_.feed({buffer.get(), count}, [&](std::span<const std::uint8_t> packet) {
        counters_->received_packets_tcp.add();
        if (sink_) sink_->on_packet(packet, now_ns);
      });
      if (!sound && sink_) sink_->on_broken_stream(now_ns);
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
    std::swap(sending_, unsent_);
    is_writing_ = true;
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
    flat_.clear();  // one record of TLS; without it each buffer would become a record
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
  splitter_.allow(wire::kPacketBytesMax);
}

void TcpConnection::send(std::vector<std::uint8_t> packet) {
  HAIRNET_ASSERT(!packet.empty());
  if (closing_) return;
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
  if (!is_joined_ && !stream_->move_to(Admission::Place::leaving)) {
    counters_->connections_cut_leaving.add();
    return shut();
  }
  wake_writer_.cancel();
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
