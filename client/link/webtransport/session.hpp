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
  std::string authority;  // HOST:PORT
  std::string url_path;
  CertificateCheck certificate;
};

// What a WebTransportSession tells, from within receive(), poll() and write(). No call may destroy it.
class WebTransportEvents {
 public:
  virtual ~WebTransportEvents() = default;
  // The bytes come on the channel. They count as waiting until WebTransportSession::take().
  virtual void on_channel_bytes(std::span<const std::uint8_t> bytes) = 0;
  virtual void on_datagram(std::span<const std::uint8_t> bytes) = 0;
  // The bytes come on a one-way stream that the server has opened. They count as waiting until
  // WebTransportSession::take_download(). `is_last`: it ends behind them.
  virtual void on_download_bytes(StreamId download, std::span<const std::uint8_t> bytes, bool is_last) = 0;
  // The server sends no more of it.
  virtual void on_download_reset(StreamId download) = 0;
};

// The client's end of a WebTransport session: QUIC, HTTP/3, an extended CONNECT, and then the channel, which is the
// session's first bidirectional stream, datagrams, and downloads. No I/O, no clock: packets and times in, packets out.
// One thread.
class WebTransportSession final : private QuicEvents, private Http3Owner {
 public:
  // Bytes that may wait to be sent before is_writable() is false.
  static constexpr std::size_t kUnsentBytesMax = std::size_t{64} << 10;
  // The same for bytes that were sent and are not acknowledged.
  static constexpr std::size_t kKeptBytesMax = std::size_t{1} << 20;
  // More poses than that, or poses that have waited so long, are outdated before they leave: the newest datagram brings
  // the last ones again.
  static constexpr std::size_t kDatagramsMax = 16;
  static constexpr std::int64_t kDatagramAge_ns = 30'000'000;

  // One line when the certificate's check cannot be set up. `events` must outlive it.
  static Result<std::unique_ptr<WebTransportSession>> create(WebTransportTarget target, WebTransportEvents& events,
                                                             std::int64_t now_ns, const QuicOptions& options = {});

  void receive(std::span<const std::uint8_t> packet, std::int64_t now_ns);
  void poll(std::int64_t now_ns);  // when due_ns() has come
  [[nodiscard]] std::int64_t due_ns() const;
  // Passes on the packets that it wants to send now.
  void write(const std::function<void(std::span<const std::uint8_t>)>& send, std::int64_t now_ns) {
    quic_->write(send, now_ns);
  }

  [[nodiscard]] bool is_open() const { return http3_.channel() >= 0 && !is_over(); }
  [[nodiscard]] bool is_over() const { return quic_->is_over(); }
  // Why it is over, in one line; empty: the server has closed it without a word.
  [[nodiscard]] const std::string& reason() const { return quic_->reason(); }

  // The following assert that it has been open, and do nothing once it is over.
  // Sends on the channel.
  void send(std::vector<std::uint8_t> bytes);
  // Ends the channel behind what was sent.
  void end_channel();
  // False: it is too large. Those that wait for the window are dropped when they are outdated.
  [[nodiscard]] bool send_datagram(std::vector<std::uint8_t> bytes, std::int64_t now_ns);
  // Takes bytes that on_channel_bytes() has passed on: the server may send as many more.
  void take(std::size_t bytes);
  // Does the same for on_download_bytes().
  void take_download(StreamId download, std::size_t bytes);
  [[nodiscard]] bool is_writable() const;
  [[nodiscard]] std::size_t unsent_bytes() const { return quic_->unsent_bytes(); }
  // Ends it at once; the next write() tells the server. `error`: one line.
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
  // Holds the time at which each datagram that waits was to be sent.
  std::deque<std::int64_t> datagram_ns_;
  // The events have so many of the bytes in hand, and take them later.
  std::size_t passed_bytes_ = 0;
  // The server has ended the channel.
  bool has_ended_ = false;
  // Is the time of the current call.
  std::int64_t now_ns_ = 0;
  // Bounds the opening and the end; zero means no deadline.
  std::int64_t deadline_ns_ = 0;
  std::int64_t opening_ns_max_ = 0;
};

}  // namespace hairnet::link
