#pragma once

#include <gnutls/gnutls.h>
#include <ngtcp2/ngtcp2.h>
#include <ngtcp2/ngtcp2_crypto.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/link/webtransport/certificate_check.hpp"
#include "client/link/webtransport/http3_session.hpp"
#include "core/result.hpp"
#include "schema/http3/error_code.hpp"
#include "schema/quic/answer_delay.hpp"
#include "schema/quic/parameters.hpp"
#include "schema/quic/send_queues.hpp"
#include "schema/quic/socket_address.hpp"

namespace hairnet::link {

struct QuicOptions {
  // The default of one_way_window_bytes, 512 KiB.
  static constexpr std::uint64_t kOneWayWindowBytes = std::uint64_t{512} << 10;
  // The application's protocol, as TLS names it; empty means none.
  std::string protocol = "h3";
  std::uint32_t version = NGTCP2_PROTO_VER_V1;
  // The connection ends if the handshake takes longer.
  std::int64_t handshake_timeout_ns = 5'000'000'000;
  // The connection ends after this time without a packet of the peer's.
  std::int64_t idle_timeout_ns = 15'000'000'000;
  // After this time without a packet, a ping is sent, which the peer must acknowledge; zero means never.
  std::int64_t keep_alive_ns = 5'000'000'000;
  // The peer may send this many bytes on a two-way stream before take() has taken any.
  std::uint64_t window_bytes = std::uint64_t{1} << 20;
  // The same limit for each one-way stream of the peer. A stream cannot use up the window of another one.
  std::uint64_t one_way_window_bytes = kOneWayWindowBytes;
  // The peer may have this many one-way streams open at a time, and no two-way streams.
  std::uint64_t one_way_streams_max = 8;
  std::uint64_t datagram_frame_bytes_max = quic::kDatagramFrameBytesMax;
};

// What a QuicConnection reports, from within its receive(), poll() and write(). No call may destroy the connection.
class QuicEvents {
 public:
  virtual ~QuicEvents() = default;
  // The handshake is done.
  virtual void on_ready() = 0;
  // The bytes come in order. `is_last`: the stream ends behind them. They fill the stream's window until take().
  virtual void on_stream_bytes(StreamId stream, std::span<const std::uint8_t> bytes, bool is_last) = 0;
  // The peer sends no more on the stream.
  virtual void on_stream_reset(StreamId stream, std::uint64_t code) = 0;
  // The peer reads no more of the stream.
  virtual void on_stream_stopped(StreamId stream) = 0;
  virtual void on_quic_datagram(std::span<const std::uint8_t> bytes) = 0;
};

// The client's end of a QUIC connection. No I/O, no clock: packets and times in, packets out. One thread.
class QuicConnection final : private quic::SendObserver {
 public:
  // The error is one line: the certificate's check cannot be set up. `events` must outlive the connection.
  static Result<std::unique_ptr<QuicConnection>> create(const quic::Path& path, CertificateCheck check,
                                                        QuicOptions options, QuicEvents& events, std::int64_t now_ns);
  QuicConnection(const QuicConnection&) = delete;
  QuicConnection& operator=(const QuicConnection&) = delete;
  ~QuicConnection() override;

  // Takes one UDP packet of the peer.
  void receive(std::span<const std::uint8_t> packet, std::int64_t now_ns);
  // Call it when due_ns() has come.
  void poll(std::int64_t now_ns);
  [[nodiscard]] std::int64_t due_ns() const;
  // Passes the packets that may leave now to `send`. More packets may be due at due_ns().
  void write(const std::function<void(std::span<const std::uint8_t>)>& send, std::int64_t now_ns);

  // Returns -1 when the peer allows no further stream now.
  StreamId open_stream(bool one_way);
  // Queues bytes on the stream. `is_last`: the stream ends behind them.
  void send(StreamId stream, std::vector<std::uint8_t> bytes, bool is_last = false);
  // The caller has used this many bytes of on_stream_bytes(): the peer may send as many more.
  void take(StreamId stream, std::size_t bytes);
  // Tells the peer that no more bytes of the stream are wanted.
  void stop_reading(StreamId stream, http3::ErrorCode code);
  // The bytes with which each datagram begins.
  void set_datagram_prefix(std::vector<std::uint8_t> prefix) { queues_.set_datagram_prefix(std::move(prefix)); }
  void send_datagram(std::vector<std::uint8_t> bytes) { queues_.push_datagram(std::move(bytes)); }
  void drop_first_datagram() { queues_.drop_first_datagram(); }
  // The number of datagrams that wait.
  [[nodiscard]] std::size_t datagram_count() const { return queues_.datagram_count(); }
  // The largest datagram frame that the peer takes; zero when it takes none.
  [[nodiscard]] std::size_t datagram_frame_bytes_max() const;
  // unsent_bytes() have not been sent yet. kept_bytes() includes those that were sent and not acknowledged.
  [[nodiscard]] std::size_t unsent_bytes() const { return queues_.unsent_bytes(); }
  [[nodiscard]] std::size_t kept_bytes() const { return queues_.kept_bytes(); }
  // Ends the connection with an application's code; the next write() tells the peer. `reason` is one line.
  void close(http3::ErrorCode code, std::string_view reason, std::int64_t now_ns);
  // Continues from another local address.
  void migrate(const quic::Address& local, std::int64_t now_ns);

  [[nodiscard]] bool is_ready() const { return is_ready_; }
  [[nodiscard]] bool is_over() const { return error_ != 0; }
  // One line that says why the connection is over.
  [[nodiscard]] const std::string& reason() const { return reason_; }
  // Returns ngtcp2's error; zero until the connection is over.
  [[nodiscard]] int error() const { return error_; }
  [[nodiscard]] const quic::Path& path() const { return path_; }
  [[nodiscard]] ngtcp2_connection_close_error close_error() const;

 private:
  friend struct QuicConnectionCallbacks;
  QuicConnection(const quic::Path& path, CertificateVerifier verifier, QuicOptions options, QuicEvents& events);
  bool begin(std::int64_t now_ns);

  void on_stream_sent(StreamId, std::size_t) override {}
  void on_datagram_sent(std::size_t, bool) override {}
  // SendObserver's calls (schema/quic/send_queues.hpp), from within write().
  bool on_stopped(StreamId stream) override;

  // Whether nothing but datagrams is on its way, so that acknowledgements may wait (quic::AnswerDelay).
  [[nodiscard]] bool is_quiet() const { return is_ready_ && queues_.is_idle(); }
  // TLS calls it during the handshake. Returns 0 for a good certificate, else GnuTLS's error.
  int verify();
  // Ends the connection with an error of ngtcp2, and tells the peer where the peer listens.
  void end(int error, std::int64_t now_ns);
  [[nodiscard]] std::string describe(int error) const;
  void write_close(const ngtcp2_connection_close_error& error, std::int64_t now_ns);

  quic::Path path_;
  CertificateVerifier verifier_;
  QuicOptions options_;
  QuicEvents* events_;
  gnutls_session_t tls_ = nullptr;
  ngtcp2_conn* quic_ = nullptr;
  ngtcp2_crypto_conn_ref reference_{};
  quic::SendQueues queues_;
  quic::AnswerDelay answer_;
  // The time of the receive() that is running.
  std::int64_t now_ns_ = 0;
  // The packet that tells the peer of the end, until write() sends it.
  std::vector<std::uint8_t> close_packet_;
  std::string reason_;
  int error_ = 0;
  // The arguments of a close() that came from within ngtcp2, which must not be closed there. end() closes with them.
  std::optional<std::pair<http3::ErrorCode, std::string>> close_wanted_;
  // is_ready_: the handshake is done. was_reset_: the peer says that it does not know the connection. is_in_quic_: a
  // call of ngtcp2 is running.
  bool is_ready_ = false, was_reset_ = false, is_in_quic_ = false;
};

}  // namespace hairnet::link
