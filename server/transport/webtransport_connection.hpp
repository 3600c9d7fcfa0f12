#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "schema/channel/packet_splitter.hpp"
#include "server/quic/connection.hpp"
#include "server/session/connection.hpp"
#include "server/transport/admission.hpp"
#include "server/transport/transport_counters.hpp"

namespace hairnet::server {

// Counts a QUIC connection as one of the port's connections for as long as the ticket lives.
struct QuicTicket {
  explicit QuicTicket(Admission::Ticket entered, TransportCounters& to) : ticket(std::move(entered)), counters(&to) {
    counters->connections_accepted.add();
  }
  QuicTicket(const QuicTicket&) = delete;
  QuicTicket& operator=(const QuicTicket&) = delete;
  ~QuicTicket() { counters->connections_closed.add(); }

  Admission::Ticket ticket;
  TransportCounters* counters;
};

// A WebTransport session as sessions see it: size-prefixed packets on the channel, as over TCP, and on the stream of
// each download, and a packet in each datagram.
class WebTransportConnection final : public Connection, public quic::SessionSink {
 public:
  static constexpr std::string_view kPath = "/wt";

  // `network`: see Connection. `on_work`: the endpoint has something to send.
  WebTransportConnection(quic::Connection& quic, std::string peer, std::string network,
                         std::shared_ptr<QuicTicket> ticket, TransportCounters& counters,
                         std::function<void()> on_work);

  // `sink` is null when the connection was refused and has been closed.
  void start(PacketSink* sink) { sink_ = sink; }

  // These functions implement Connection (server/session/connection.hpp). Without `quic_` the session has ended, and
  // they do nothing.
  void mark_joined() override;
  void send(std::vector<std::uint8_t> packet) override;
  [[nodiscard]] std::size_t datagram_bytes_max() const override;
  void send_datagram(std::vector<std::uint8_t> packet) override;
  [[nodiscard]] double bytes_per_s() const override { return quic_ ? quic_->bytes_per_s() : 0; }
  [[nodiscard]] bool writable() const override { return quic_ && quic_->is_writable(); }
  [[nodiscard]] bool takes_datagrams() const override { return quic_ && quic_->takes_datagrams(); }
  [[nodiscard]] bool has_download_streams() const override { return true; }
  std::optional<DownloadStream> open_download() override { return quic_ ? quic_->open_download() : std::nullopt; }
  [[nodiscard]] bool takes_more(DownloadStream stream) const override { return quic_ && quic_->is_writable(stream); }
  void send_download(DownloadStream stream, std::vector<std::uint8_t> packet, bool is_last) override;
  void reset_download(DownloadStream stream) override;
  void close(std::string_view reason) override;
  [[nodiscard]] std::string_view peer() const override { return peer_; }
  [[nodiscard]] std::string_view network() const override { return network_; }
  [[nodiscard]] std::string_view transport() const override { return "wt"; }

  void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t now_ns) override;
  void on_datagram(std::span<const std::uint8_t> bytes, std::int64_t now_ns) override;
  void on_writable(std::int64_t now_ns) override;
  void on_downloads_writable(std::int64_t now_ns) override;
  void on_download_stopped(DownloadStream stream, std::int64_t now_ns) override;
  void on_sent(std::size_t bytes) override;
  void on_closed(std::string_view error, std::int64_t now_ns) override;

 private:
  // Null once closed. The endpoint owns the QUIC connection, and on_closed() reports its end.
  quic::Connection* quic_;
  std::string peer_, network_;
  // Null once closed. The QUIC connection shares the ticket, and may exist a little longer.
  std::shared_ptr<QuicTicket> ticket_;
  TransportCounters* counters_;
  std::function<void()> on_work_;
  // Finds packets in the channel's bytes; datagrams need none.
  channel::PacketSplitter splitter_;
  // Null once closed.
  PacketSink* sink_ = nullptr;
  bool is_joined_ = false;
};

}  // namespace hairnet::server
