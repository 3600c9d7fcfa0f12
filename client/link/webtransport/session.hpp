#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/link/webtransport/http3_session.hpp"
#include "client/link/webtransport/quic_connection.hpp"

namespace hairnet::link {

// Where a session is opened.
struct WebTransportTarget {
  quic::Path path;
  // The server as HOST:PORT.
  std::string authority;
  std::string url_path;
  CertificateCheck certificate;
};

// What a WebTransportSession reports, from within its receive(), poll() and write(). No call may destroy the session.
class WebTransportEvents {
 public:
  virtual ~WebTransportEvents() = default;
  // The bytes come on the channel. They count as waiting until WebTransportSession::take().
  virtual void on_channel_bytes(std::span<const std::uint8_t> bytes) = 0;
  virtual void on_datagram(std::span<const std::uint8_t> bytes) = 0;
  // The bytes come on a one-way stream that the server has opened. They count as waiting until
  // WebTransportSession::take_download(). `is_last`: it ends behind them.
  virtual void on_download_bytes(StreamId download, std::span<const std::uint8_t> bytes, bool is_last) = 0;
  // The server sends no more of that download.
  virtual void on_download_reset(StreamId download) = 0;
};

// The client's end of a WebTransport session: QUIC, HTTP/3, an extended CONNECT, and then the channel, which is the
// session's first bidirectional stream, datagrams, and downloads. No I/O, no clock: packets and times in, packets out.
// One thread.
class WebTransportSession final : private QuicEvents, private Http3Owner {
 public:
  // Bytes that may wait to be sent before is_writable() is false.
  static constexpr std::size_t kUnsentBytesMax = std::size_t{64} << 10;
  // Bytes that were sent and are not acknowledged are stored; more than these make is_writable() false, too.
  static constexpr std::size_t kKeptBytesMax = std::size_t{1} << 20;
  // Datagrams wait while the network takes none. When more than kDatagramsMax wait, or one has waited for
  // kDatagramAge_ns, the oldest are dropped: their poses are outdated, and the newest datagram brings the last ones
  // again.
  static constexpr std::size_t kDatagramsMax = 16;
  static constexpr std::int64_t kDatagramAge_ns = 30'000'000;

  // The error is one line: the certificate's check cannot be set up. `events` must outlive the session.
  static Result<std::unique_ptr<WebTransportSession>> create(WebTransportTarget target, WebTransportEvents& events,
                                                             std::int64_t now_ns, const QuicOptions& options = {});

  void receive(std::span<const std::uint8_t> packet, std::int64_t now_ns);
  // Call it when due_ns() has come.
  void poll(std::int64_t now_ns);
  [[nodiscard]] std::int64_t due_ns() const;
  // Passes on the packets that it wants to send now.
  void write(const std::function<void(std::span<const std::uint8_t>)>& send, std::int64_t now_ns) {
    quic_->write(send, now_ns);
  }

  [[nodiscard]] bool is_open() const { return http3_.channel() >= 0 && !is_over(); }
  [[nodiscard]] bool is_over() const { return quic_->is_over(); }
  // One line that says why the session is over; empty: the server has closed it without a reason.
  [[nodiscard]] const std::string& reason() const { return quic_->reason(); }

  // The following calls assert that the session has been open, and do nothing once it is over.

  // Sends on the channel.
  void send(std::vector<std::uint8_t> bytes);
  // Ends the channel behind what was sent.
  void end_channel();
  // Returns false when the datagram is too large. Datagrams that wait are dropped when they are outdated
  // (kDatagramsMax, kDatagramAge_ns).
  [[nodiscard]] bool send_datagram(std::vector<std::uint8_t> bytes, std::int64_t now_ns);
  // Takes bytes that on_channel_bytes() has passed on: the server may send as many more.
  void take(std::size_t bytes);
  // Does the same for on_download_bytes().
  void take_download(StreamId download, std::size_t bytes);
  [[nodiscard]] bool is_writable() const;
  [[nodiscard]] std::size_t unsent_bytes() const { return quic_->unsent_bytes(); }
  // Ends the session at once; the next write() tells the server. `error` is one line.
  void close(std::string_view error, std::int64_t now_ns) { quic_->close(http3::ErrorCode::no_error, error, now_ns); }

 private:
  WebTransportSession(const WebTransportTarget& target, WebTransportEvents& events)
      : events_(&events), http3_(*this, target.authority, target.url_path) {}

  // QuicEvents
  void on_ready() override;
  void on_stream_bytes(StreamId id, std::span<const std::uint8_t> bytes, bool is_last) override;
  void on_stream_reset(StreamId id, std::uint64_t) override { http3_.on_reset(id); }
  void on_stream_stopped(StreamId id) override { http3_.on_stop(id); }
  void on_quic_datagram(std::span<const std::uint8_t> bytes) override { http3_.on_datagram(bytes); }

  // Http3Owner
  StreamId open_stream(bool one_way) override { return quic_->open_stream(one_way); }
  void send(StreamId stream, http3::Bytes bytes) override { quic_->send(stream, std::move(bytes)); }
  void stop_reading(StreamId stream, http3::ErrorCode code) override { quic_->stop_reading(stream, code); }
  void fail(http3::ErrorCode code, std::string_view error) override;
  void on_channel_open() override;
  void on_channel_bytes(std::span<const std::uint8_t> bytes) override;
  void on_channel_end() override;
  void on_datagram(std::span<const std::uint8_t> bytes) override { events_->on_datagram(bytes); }
  void on_download_bytes(StreamId stream, std::span<const std::uint8_t> bytes, bool is_last) override;
  void on_download_reset(StreamId stream) override { events_->on_download_reset(stream); }

  WebTransportEvents* events_;
  std::unique_ptr<QuicConnection> quic_;
  Http3Session http3_;
  // For each datagram that waits, the time at which send_datagram() got it.
  std::deque<std::int64_t> datagram_ns_;
  // How many of the bytes that on_stream_bytes() handles now were passed on to events_, whose owner gives them back by
  // take().
  std::size_t passed_bytes_ = 0;
  // The server has ended the channel.
  bool has_ended_ = false;
  // The time of the current call.
  std::int64_t now_ns_ = 0;
  // The time until which the session must open, or the reason of its end must arrive; zero means no deadline.
  std::int64_t deadline_ns_ = 0;
  // The time that the opening may take after QUIC's handshake.
  std::int64_t opening_ns_max_ = 0;
};

}  // namespace hairnet::link
