#include "server/transport/webtransport_connection.hpp"

#include <utility>

#include "core/assert.hpp"
#include "schema/limits.hpp"
#include "server/transport/io_loop.hpp"

namespace hairnet::server {

WebTransportConnection::WebTransportConnection(quic::Connection& quic, std::string peer, std::string network,
                                               std::shared_ptr<QuicTicket> ticket, TransportCounters& counters,
                                               std::function<void()> on_work)
    : quic_(&quic),
      peer_(std::move(peer)),
      network_(std::move(network)),
      ticket_(std::move(ticket)),
      counters_(&counters),
      on_work_(std::move(on_work)),
      // Until the session has joined, only packets up to this size are read.
      splitter_(kHelloPacketBytesMax) {}

void WebTransportConnection::mark_joined() {
  is_joined_ = true;
  splitter_.allow(wire::kPacketBytesMax);
  // A member's uploads need a larger window than a stranger's Hello.
  if (quic_) quic_->widen();
}

void WebTransportConnection::send(std::vector<std::uint8_t> packet) {
  HAIRNET_ASSERT(!packet.empty());
  if (!quic_) return;
  counters_->sent_packets_webtransport.add();
  quic_->send(std::move(packet));
  on_work_();
}

std::size_t WebTransportConnection::datagram_bytes_max() const {
  return quic_ ? quic_->datagram_bytes_max() : 0;
}

void WebTransportConnection::send_datagram(std::vector<std::uint8_t> packet) {
  HAIRNET_ASSERT(!packet.empty());
  if (!quic_) return;
  counters_->sent_packets_webtransport.add();
  quic_->send_datagram(std::move(packet));
  on_work_();
}

void WebTransportConnection::send_download(DownloadStream stream, std::vector<std::uint8_t> packet, bool is_last) {
  HAIRNET_ASSERT(!packet.empty());
  if (!quic_) return;
  counters_->sent_packets_webtransport.add();
  quic_->send_download(stream, std::move(packet), is_last);
  on_work_();
}

void WebTransportConnection::reset_download(DownloadStream stream) {
  if (!quic_) return;
  quic_->reset_download(stream);
  on_work_();
}

void WebTransportConnection::close(std::string_view reason) {
  sink_ = nullptr;
  // The pointer is cleared before anything else: the QUIC connection may end within its close().
  quic::Connection* quic = std::exchange(quic_, nullptr);
  if (!quic) return;
  const std::int64_t now_ns = channel::monotonic_ns();
  // A refused stranger waits for its Goodbye to be read only while few others do.
  if (!is_joined_ && !ticket_->ticket.move_to(Admission::Place::leaving)) {
    counters_->connections_cut_leaving.add();
    quic->cut(now_ns);
  } else {
    quic->close(reason, now_ns);
  }
  ticket_ = nullptr;
  on_work_();
}

void WebTransportConnection::on_bytes(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  counters_->bytes_read.add(bytes.size());
  counters_->received_bytes_webtransport.add(bytes.size());
  const bool is_valid = splitter_.feed(bytes, [&](std::span<const std::uint8_t> packet) {
    counters_->received_packets_webtransport.add();
    if (sink_) sink_->on_packet(packet, now_ns);
  });
  // The sink may have closed the connection within on_packet().
  if (!is_valid && sink_) sink_->on_broken_stream(now_ns);
}

void WebTransportConnection::on_datagram(std::span<const std::uint8_t> bytes, std::int64_t now_ns) {
  counters_->bytes_read.add(bytes.size());
  counters_->received_bytes_webtransport.add(bytes.size());
  counters_->received_packets_webtransport.add();
  // A datagram is a whole packet without a size prefix. It may be lost, come twice or late.
  if (sink_) sink_->on_datagram(bytes, now_ns);
}

void WebTransportConnection::on_writable(std::int64_t now_ns) {
  if (sink_) sink_->on_writable(now_ns);
}

void WebTransportConnection::on_downloads_writable(std::int64_t now_ns) {
  if (sink_) sink_->on_streams_writable(now_ns);
}

void WebTransportConnection::on_download_stopped(DownloadStream stream, std::int64_t now_ns) {
  if (sink_) sink_->on_download_stopped(stream, now_ns);
}

void WebTransportConnection::on_sent(std::size_t bytes) {
  counters_->bytes_written.add(bytes);
  counters_->sent_bytes_webtransport.add(bytes);
}

// The QUIC connection is about to be destroyed, so nothing may use it any more.
void WebTransportConnection::on_closed(std::string_view error, std::int64_t now_ns) {
  quic_ = nullptr;
  ticket_ = nullptr;
  if (PacketSink* sink = std::exchange(sink_, nullptr)) sink->on_closed(error, now_ns);
}

}  // namespace hairnet::server
