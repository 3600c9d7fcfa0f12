#pragma once

#include <gnutls/gnutls.h>
#include <ngtcp2/ngtcp2.h>
#include <ngtcp2/ngtcp2_crypto.h>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "schema/quic/answer_delay.hpp"
#include "schema/quic/parameters.hpp"
#include "schema/quic/send_queues.hpp"
#include "schema/quic/socket_address.hpp"
#include "server/http3/connection.hpp"
#include "server/quic/credentials.hpp"
#include "server/quic/outgoing.hpp"
#include "server/quic/quic_counters.hpp"

namespace hairnet::quic {

// The time limits of a connection, from the first packet to the last acknowledgement.
struct ConnectionOptions {
  // The handshake ends within this time of the first packet.
  std::int64_t handshake_timeout_ns = 5'000'000'000;
  // The client opens the channel of a session within this time of the handshake, or the connection ends.
  std::int64_t opening_timeout_ns = 5'000'000'000;
  // A peer without a packet for this long is lost.
  std::int64_t idle_timeout_ns = 30'000'000'000;
  // A peer that is silent for this long is asked for a sign of life.
  std::int64_t keep_alive_ns = 15'000'000'000;
  // The peer has this long to acknowledge the last bytes.
  std::int64_t linger_ns = 2'000'000'000;
};

class Connection;

// Receives the bytes and events of a WebTransport session. Calls come from within Endpoint::receive and flush, and
// on_closed() also from its destructor.
class SessionSink {
 public:
  virtual ~SessionSink() = default;
  // The channel has brought these bytes.
  virtual void on_bytes(std::span<const std::uint8_t> bytes, std::int64_t now_ns) = 0;
  virtual void on_datagram(std::span<const std::uint8_t> bytes, std::int64_t now_ns) = 0;
  // The channel takes bytes again, after is_writable() was false.
  virtual void on_writable(std::int64_t now_ns) = 0;
  // A download may be opened, or has room, again.
  virtual void on_downloads_writable(std::int64_t now_ns) = 0;
  // The peer wants no more of this download.
  virtual void on_download_stopped(http3::StreamId download, std::int64_t now_ns) = 0;
  // Bytes of the channel, downloads or datagrams were sent; counters need this.
  virtual void on_sent(std::size_t bytes) = 0;
  // The session is over, and with it the Connection; the last call. Does not follow Connection::close().
  virtual void on_closed(std::string_view error, std::int64_t now_ns) = 0;
};

// What a Connection asks of its Endpoint. Its calls come from within a Connection's, so it must not destroy the
// Connection there: the endpoint does so afterwards, once is_over().
class ConnectionHost {
 public:
  virtual ~ConnectionHost() = default;
  // Packets with this ID belong to the connection from now on; a peer uses a new one when its address changes.
  virtual void add_id(const ngtcp2_cid& id, Connection& connection) = 0;
  virtual void remove_id(const ngtcp2_cid& id) = 0;
  // Writes the token by which a later server of this port can end connections that it does not know (stateless reset).
  virtual void make_reset_token(const ngtcp2_cid& id, std::uint8_t* token) = 0;
  // The peer's address is verified. False: the connection is refused.
  virtual bool on_verified(Connection& connection, std::int64_t now_ns) = 0;
  // Makes a token with which this address needs no Retry next time; empty: none.
  virtual std::vector<std::uint8_t> make_address_token(const Address& remote, std::int64_t now_ns) = 0;
  // Returns the status of the response: 200 opens the session.
  virtual int on_request(Connection& connection, const http3::Request& request, std::int64_t now_ns) = 0;
  // Null: no session is opened, and the connection ends.
  virtual std::shared_ptr<SessionSink> on_session(Connection& connection, std::int64_t now_ns) = 0;
  // The connection has something to send at the next flush.
  virtual void want_write(Connection& connection) = 0;
};

// One QUIC connection of the server's side, its HTTP/3 and its session. No I/O: packets in, packets out. The endpoint
// owns it and calls it on one thread. Its session holds a plain pointer, which is valid until SessionSink::on_closed or
// close().
class Connection final : private http3::Owner, private SendObserver {
 public:
  // Bytes that may wait to be sent before is_writable() is false; more would only delay a slow peer's frames. Of
  // datagrams fewer may wait, see DatagramQueue.
  static constexpr std::size_t kUnsentBytesMax = std::size_t{64} << 10;
  // is_writable() is also false while this many bytes of the channel are stored, unsent or not acknowledged.
  static constexpr std::size_t kKeptBytesMax = std::size_t{1} << 20;
  // A download is writable while fewer bytes than these wait to be sent on it, and all downloads together store less
  // than kKeptBytesMax.
  static constexpr std::size_t kDownloadUnsentBytesMax = std::size_t{32} << 10;
  // The length of the connection IDs that the server chooses. They are random, so that nobody guesses the ID of another
  // client's connection.
  static constexpr std::size_t kIdBytes = 16;

  // What the endpoint knows of a first packet.
  struct Opening {
    Path path;
    ngtcp2_cid client_source{}, client_destination{};
    // Set after a Retry: the destination ID of the packet that the Retry answered, which the client checks.
    std::optional<ngtcp2_cid> original_destination;
    std::uint32_t version = 0;
    // The peer has answered at its address before, so nobody else's address can be meant.
    bool is_verified = false;
  };

  // Null when there is no memory or TLS refuses.
  static std::unique_ptr<Connection> create(ConnectionHost& host, const ConnectionOptions& options,
                                            const Opening& opening, std::shared_ptr<const Credentials> credentials,
                                            QuicCounters& counters, std::int64_t now_ns);
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() override;

  // The endpoint calls the functions from here to set_ticket(). It destroys a connection that is_over(). `ecn` has the
  // two ECN bits of the packet's IP header.
  void receive(const Path& path, std::uint8_t ecn, std::span<const std::uint8_t> packet, std::int64_t now_ns);
  // Call it when due_ns() has come.
  void poll(std::int64_t now_ns);
  // Writes packets while congestion control and its pace allow. Calls the sink when there is room again.
  void write(Outgoing& out, std::int64_t now_ns);
  // The time of the next time-out or of the next paced packet. The largest number: never.
  [[nodiscard]] std::int64_t due_ns() const;
  // Whether writing may wait until due_ns(): the connection has nothing to send but acknowledgements.
  [[nodiscard]] bool may_wait(std::int64_t now_ns) const { return is_quiet() && answer_.holds(now_ns); }
  [[nodiscard]] bool is_over() const { return state_ == State::over; }
  [[nodiscard]] bool is_verified() const { return is_verified_; }
  [[nodiscard]] bool is_opening() const { return state_ == State::open && !sink_; }
  [[nodiscard]] const std::vector<ngtcp2_cid>& ids() const { return ids_; }
  // The ticket holds the connection's place in the admission limits (Gate::admit). It is released when the connection
  // ends.
  void set_ticket(std::shared_ptr<void> ticket) { ticket_ = std::move(ticket); }
  [[nodiscard]] const std::shared_ptr<void>& ticket() const { return ticket_; }

  // The session calls the functions from here to cut(). The channel is the bidirectional stream that carries the
  // session's packets in order.

  // Queues bytes on the channel.
  void send(std::vector<std::uint8_t> bytes);
  // Queues a datagram; asserts that it has at most datagram_bytes_max().
  void send_datagram(std::vector<std::uint8_t> bytes);
  // True while the channel and the datagrams have room. A session that does not get true waits for
  // SessionSink::on_writable.
  [[nodiscard]] bool is_writable() const;
  [[nodiscard]] bool takes_datagrams() const { return state_ == State::open && !queues_.datagrams().is_full(); }
  // The largest payload of a datagram; 0: the peer takes none.
  [[nodiscard]] std::size_t datagram_bytes_max() const;
  // A download is a unidirectional stream of the session, for one groom or file. open_download() returns none while the
  // peer allows no further stream, or while kDownloadsMax downloads are not completely acknowledged;
  // SessionSink::on_downloads_writable follows.
  static constexpr std::size_t kDownloadsMax = 4;
  std::optional<http3::StreamId> open_download();
  [[nodiscard]] bool is_writable(http3::StreamId download) const;
  void send_download(http3::StreamId download, std::vector<std::uint8_t> bytes, bool is_last);
  // Gives a download up: resets the stream, and drops what waits to be sent on it.
  void reset_download(http3::StreamId download);
  // The session has joined: allows the peer 448 KiB more on the channel and in all before the server has read them.
  void widen();
  // Sends what waits on the channel, for up to linger_ns, then ends the session and the connection. `reason`: one line.
  void close(std::string_view reason, std::int64_t now_ns);
  // Ends the connection at once, and drops what waits.
  void cut(std::int64_t now_ns);
  // The endpoint is being destroyed: tells the sink of the end, and sends nothing.
  void abandon() { end("the server stops", now_ns_); }
  [[nodiscard]] const Address& remote() const { return remote_; }
  [[nodiscard]] std::size_t unsent_bytes() const { return queues_.unsent_bytes(); }
  [[nodiscard]] ngtcp2_conn_stat statistics() const;
  // The rate that congestion control lets through: its window each round trip. 0: unknown, because the window has held
  // nothing back in the last second. After losses the window may be small without being the limit.
  [[nodiscard]] double bytes_per_s() const;

 private:
  friend struct ConnectionCallbacks;
  // open: from the first packet until the session or the connection ends. finishing: the last bytes of the channel
  // leave and are acknowledged. closing: CONNECTION_CLOSE was written, and is repeated for packets that still come.
  // over: the endpoint destroys the connection.
  enum class State : std::uint8_t { open, finishing, closing, over };
  // Why a callback has failed ngtcp2's call; end_with_error() makes the peer's error code of it.
  enum class Failure : std::uint8_t { none, http3, refused, alpn, no_memory };

  Connection(ConnectionHost& host, const ConnectionOptions& options, QuicCounters& counters);
  // Makes the TLS session and the ngtcp2 connection. False: there is no memory, or TLS refuses.
  bool begin(const Opening& opening, std::shared_ptr<const Credentials> credentials, std::int64_t now_ns);

  // These functions implement http3::Owner (server/http3/connection.hpp).
  void send(http3::StreamId stream, std::span<const std::uint8_t> bytes, bool is_last) override;
  void stop_reading(http3::StreamId stream, http3::ErrorCode code) override;
  void reset(http3::StreamId stream, http3::ErrorCode code) override;
  void fail(http3::ErrorCode code, std::string_view error) override;
  int on_request(const http3::Request& request) override;
  void on_channel_open(http3::StreamId stream) override;
  void on_channel_bytes(std::span<const std::uint8_t> bytes) override;
  void on_datagram(std::span<const std::uint8_t> bytes) override;
  void on_session_end() override;

  // SendObserver
  void on_stream_sent(http3::StreamId stream, std::size_t bytes) override;
  void on_datagram_sent(std::size_t bytes, bool is_sent) override;
  bool on_stopped(http3::StreamId stream) override;

  // ConnectionCallbacks calls these functions while a call of ngtcp2 is on the stack. A failure goes into failure_.
  bool on_handshake_done();
  void on_stream_bytes(http3::StreamId stream, std::span<const std::uint8_t> bytes, bool is_last);
  void on_stream_closed(http3::StreamId stream);
  void on_quic_datagram(std::span<const std::uint8_t> bytes);

  // Writes one packet into `out`. Returns false when none was written, because there is nothing to send or congestion
  // control and pacing forbid it.
  bool write_packet(Outgoing& out, std::int64_t now_ns);
  // True for a session that has nothing to send on streams and nothing to report: only acknowledgements of datagrams
  // may be due.
  [[nodiscard]] bool is_quiet() const {
    return state_ == State::open && sink_ && !was_full_ && !was_download_refused_ && stopped_downloads_.empty() &&
           queues_.is_idle();
  }
  // Tells the session once when the channel has room after it had none.
  void tell_writable();
  // Tells the session which downloads the peer has stopped, and that there is room for more.
  void tell_of_downloads();
  // The stream of a download is closed: the peer has all of it, or wants no more. In the second case the sink is told.
  void forget_download(http3::StreamId stream);
  // Takes the next step of an orderly end, when the peer has acknowledged the last one.
  void advance_finish(std::int64_t now_ns);
  // Ends the connection because a call of ngtcp2 has failed, with the error code that tells the peer why.
  void end_with_error(int ngtcp2_error, std::int64_t now_ns);
  // Sends CONNECTION_CLOSE, and sends it again to packets that still come.
  void begin_closing(const ngtcp2_connection_close_error& error, std::int64_t now_ns);
  // Tells the sink of the end, once.
  void end(std::string_view error, std::int64_t now_ns);
  // Asks the endpoint to call write() at its next flush.
  void touch() { host_->want_write(*this); }
  // The queue of the channel's bytes; null before the channel is open.
  SendBuffer* channel();

  ConnectionHost* host_;
  ConnectionOptions options_;
  QuicCounters* counters_;
  std::shared_ptr<const Credentials> credentials_;
  // The TLS session and the QUIC connection; the destructor frees them. `reference_` lets GnuTLS' callbacks find quic_.
  gnutls_session_t tls_ = nullptr;
  ngtcp2_conn* quic_ = nullptr;
  ngtcp2_crypto_conn_ref reference_{};
  http3::Connection http3_{*this};
  // Null before the session's channel is open, and after the end of the session.
  std::shared_ptr<SessionSink> sink_;
  // The ticket of set_ticket().
  std::shared_ptr<void> ticket_;
  // The IDs by which the endpoint finds this connection.
  std::vector<ngtcp2_cid> ids_;
  // The peer's address in its first packet.
  Address remote_;
  // The local and the remote address of the last packet that came.
  Path path_;
  // ngtcp2 0.12 alone would acknowledge each pose by a packet of its own. A connection with only datagrams on the way
  // therefore waits for AnswerDelay, for some datagrams, or for a frame that takes the acknowledgements along. Bytes of
  // streams, a changed path and ECN's marks are answered at once.
  AnswerDelay answer_;
  SendQueues queues_;
  struct Download {
    // was_full: the stream had no room after the last piece. is_ended: the last piece of the download was queued.
    bool was_full = false, is_ended = false;
  };
  // The downloads that the peer has not completely acknowledged.
  std::map<http3::StreamId, Download> downloads_;
  // The downloads that the peer has stopped and of which the sink does not know yet.
  std::vector<http3::StreamId> stopped_downloads_;
  // The last open_download() returned none, so the sink is told when there is room.
  bool was_download_refused_ = false;
  // The packet with CONNECTION_CLOSE, while closing.
  std::vector<std::uint8_t> close_packet_;
  // close_packet_ must be sent, or sent again.
  bool is_close_due_ = false;
  // The bytes that have come from the peer since close_packet_ was sent last.
  std::size_t closing_bytes_ = 0;
  State state_ = State::open;
  Failure failure_ = Failure::none;
  http3::ErrorCode http3_error_ = http3::ErrorCode::no_error;
  // Describes the failure.
  std::string error_;
  // The reason given to close(), while finishing.
  std::string close_reason_;
  // The close capsule has been queued, while finishing.
  bool is_session_closed_ = false;
  // The time of the current call.
  std::int64_t now_ns_ = 0;
  // The congestion window last held something back at this time.
  std::optional<std::int64_t> held_back_ns_;
  // Opening, finishing or closing ends at this time; zero: never.
  std::int64_t deadline_ns_ = 0;
  // A call of ngtcp2 is on the stack, so the connection must not be closed now.
  bool is_in_quic_ = false;
  // is_verified_: the peer has answered at its address. was_full_: the channel was not writable, and the sink was not
  // told since that it is. has_peer_ended_: the peer has ended the session.
  bool is_verified_ = false, was_full_ = false, has_peer_ended_ = false;
};

}  // namespace hairnet::quic
