#include "client/link/webtransport/quic_connection.hpp"

#include <gnutls/crypto.h>
#include <ngtcp2/ngtcp2_crypto_gnutls.h>

#include <algorithm>
#include <array>
#include <limits>
#include <new>
#include <utility>

#include "core/assert.hpp"
#include "schema/quic/crypto_callbacks.hpp"

namespace hairnet::link {
namespace {

// This is the usual limit of an Ethernet path. ngtcp2 makes smaller packets until it has found out what the path takes.
constexpr std::size_t kPacketBytesMax = 1500;
// The client calls the server at first by an ID of this length.
constexpr std::size_t kIdBytes = 12;

}  // namespace

// The functions that ngtcp2 and GnuTLS call. `user` is the QuicConnection. No exception may cross them, since the
// callers are C.
struct QuicConnectionCallbacks {
  static QuicConnection& of(void* user) { return *static_cast<QuicConnection*>(user); }

  template <class Task>
  static int guard(void* user, const Task& task) {
    QuicConnection& connection = of(user);
    try {
      task(connection);
    } catch (const std::bad_alloc&) {
      connection.reason_ = "no memory is left";
      return NGTCP2_ERR_CALLBACK_FAILURE;
    }
    // A task that wants to close ends ngtcp2's call this way; close() says why it cannot do so itself.
    return connection.close_wanted_ ? NGTCP2_ERR_CALLBACK_FAILURE : 0;
  }

  // GnuTLS calls this during the handshake, before a byte of the application is sent.
  static int verify(gnutls_session_t tls) {
    auto* reference = static_cast<ngtcp2_crypto_conn_ref*>(gnutls_session_get_ptr(tls));
    return of(reference->user_data).verify();
  }
  static int handshake_completed(ngtcp2_conn*, void* user) {
    return guard(user, [](QuicConnection& c) {
      gnutls_datum_t protocol{};
      // A server without HTTP/3 on this port would take our streams for something else.
      if (gnutls_alpn_get_selected_protocol(c.tls_, &protocol) != 0)
        return c.close(http3::ErrorCode::general_protocol_error, "the server does not say that it speaks HTTP/3", 0);
      c.is_ready_ = true;
      c.events_->on_ready();
    });
  }
  static int recv_stream_data(ngtcp2_conn* quic, std::uint32_t flags, StreamId stream, std::uint64_t,
                              const std::uint8_t* bytes, std::size_t count, void* user, void*) {
    const bool is_last = (flags & NGTCP2_STREAM_DATA_FLAG_FIN) != 0;
    if (is_last) allow_next(quic, stream);
    return guard(user, [&](QuicConnection& c) {
      // The server waits for these acknowledgements before it sends more of a stream.
      c.answer_.send_soon();
      c.events_->on_stream_bytes(stream, {bytes, count}, is_last);
    });
  }
  static int acked_stream_data_offset(ngtcp2_conn*, StreamId stream, std::uint64_t offset, std::uint64_t count,
                                      void* user, void*) {
    if (quic::SendBuffer* buffer = of(user).queues_.find(stream)) buffer->acknowledge(offset + count);
    return 0;
  }
  static int stream_close(ngtcp2_conn*, std::uint32_t, StreamId stream, std::uint64_t, void* user, void*) {
    // ngtcp2 refers to the stream's bytes no longer.
    of(user).queues_.erase(stream);
    return 0;
  }
  // The peer's one-way stream has ended, so the peer may open another one. ngtcp2 0.12 does not report the end of such
  // a stream by stream_close.
  static void allow_next(ngtcp2_conn* quic, StreamId stream) {
    if (!ngtcp2_conn_is_local_stream(quic, stream)) ngtcp2_conn_extend_max_streams_uni(quic, 1);
  }
  static int stream_reset(ngtcp2_conn* quic, StreamId stream, std::uint64_t, std::uint64_t code, void* user, void*) {
    allow_next(quic, stream);
    return guard(user, [&](QuicConnection& c) { c.events_->on_stream_reset(stream, code); });
  }
  static int recv_datagram(ngtcp2_conn*, std::uint32_t, const std::uint8_t* bytes, std::size_t count, void* user) {
    return guard(user, [&](QuicConnection& c) {
      // A datagram's acknowledgement may wait: nobody sends it again.
      c.answer_.on_datagram(c.now_ns_);
      c.events_->on_quic_datagram({bytes, count});
    });
  }
  static int recv_stateless_reset(ngtcp2_conn*, const ngtcp2_pkt_stateless_reset*, void* user) {
    of(user).was_reset_ = true;
    return 0;
  }
  static int get_new_connection_id(ngtcp2_conn*, ngtcp2_cid* id, std::uint8_t* token, std::size_t bytes, void*) {
    id->datalen = bytes;
    gnutls_rnd(GNUTLS_RND_NONCE, id->data, bytes);
    // The token is random and stored nowhere: this end never resets a connection that it has forgotten.
    gnutls_rnd(GNUTLS_RND_NONCE, token, NGTCP2_STATELESS_RESET_TOKENLEN);
    return 0;
  }
  static const ngtcp2_callbacks& table() {
    static const ngtcp2_callbacks callbacks = [] {
      ngtcp2_callbacks made = quic::crypto_callbacks();
      made.client_initial = ngtcp2_crypto_client_initial_cb;
      made.recv_retry = ngtcp2_crypto_recv_retry_cb;
      made.handshake_completed = handshake_completed;
      made.recv_stream_data = recv_stream_data;
      made.acked_stream_data_offset = acked_stream_data_offset;
      made.stream_close = stream_close;
      made.stream_reset = stream_reset;
      made.recv_datagram = recv_datagram;
      made.recv_stateless_reset = recv_stateless_reset;
      made.get_new_connection_id = get_new_connection_id;
      return made;
    }();
    return callbacks;
  }
};

Result<std::unique_ptr<QuicConnection>> QuicConnection::create(const quic::Path& path, CertificateCheck check,
                                                               QuicOptions options, QuicEvents& events,
                                                               std::int64_t now_ns) {
  Result<CertificateVerifier> verifier = CertificateVerifier::make(std::move(check));
  if (!verifier) return Refusal(std::move(verifier.error()));
  std::unique_ptr<QuicConnection> made(new QuicConnection(path, std::move(*verifier), std::move(options), events));
  if (!made->begin(now_ns)) return Refusal("QUIC cannot be set up");
  return made;
}

QuicConnection::QuicConnection(const quic::Path& path, CertificateVerifier verifier, QuicOptions options,
                               QuicEvents& events)
    : path_(path), verifier_(std::move(verifier)), options_(std::move(options)), events_(&events) {}

QuicConnection::~QuicConnection() {
  // ngtcp2 goes first, as it refers to the TLS session.
  ngtcp2_conn_del(quic_);
  if (tls_) gnutls_deinit(tls_);
}

// Sets up QUIC and TLS, which refer to each other. After a failure the destructor frees what there is.
bool QuicConnection::begin(std::int64_t now_ns) {
  ngtcp2_settings settings;
  ngtcp2_settings_default(&settings);
  settings.initial_ts = static_cast<ngtcp2_tstamp>(now_ns);
  settings.handshake_timeout = static_cast<ngtcp2_duration>(options_.handshake_timeout_ns);
  ngtcp2_transport_params params;
  ngtcp2_transport_params_default(&params);
  params.initial_max_streams_uni = options_.one_way_streams_max;
  params.initial_max_stream_data_bidi_local = options_.window_bytes;
  params.initial_max_stream_data_uni = options_.one_way_window_bytes;
  // The connection's window is the sum of its streams' windows. A smaller one would let a download that nobody reads
  // stop the channel.
  params.initial_max_data = options_.window_bytes + options_.one_way_streams_max * options_.one_way_window_bytes;
  // QUIC takes the shorter of the two ends' times, so the server's counts where it is shorter.
  params.max_idle_timeout = static_cast<ngtcp2_duration>(options_.idle_timeout_ns);
  params.max_datagram_frame_size = options_.datagram_frame_bytes_max;
  params.max_ack_delay = static_cast<ngtcp2_duration>(quic::AnswerDelay::kAnnouncedDelay_ns);
  ngtcp2_cid source{}, destination{};
  // The server's packets come to a socket of their own, so they need no ID.
  destination.datalen = kIdBytes;
  gnutls_rnd(GNUTLS_RND_NONCE, destination.data, destination.datalen);
  const ngtcp2_path native{path_.local.native(), path_.remote.native(), nullptr};
  if (ngtcp2_conn_client_new(&quic_, &destination, &source, &native, options_.version,
                             &QuicConnectionCallbacks::table(), &settings, &params, nullptr, this) != 0) {
    quic_ = nullptr;
    return false;
  }
  if (options_.keep_alive_ns > 0)
    ngtcp2_conn_set_keep_alive_timeout(quic_, static_cast<ngtcp2_duration>(options_.keep_alive_ns));
  if (gnutls_init(&tls_, GNUTLS_CLIENT) != 0) {
    tls_ = nullptr;
    return false;
  }
  if (gnutls_priority_set_direct(tls_, quic::kTlsPriorities, nullptr) != 0 ||
      ngtcp2_crypto_gnutls_configure_client_session(tls_) != 0 || !verifier_.set_up(tls_))
    return false;
  gnutls_session_set_verify_function(tls_, QuicConnectionCallbacks::verify);
  const gnutls_datum_t protocol{reinterpret_cast<unsigned char*>(options_.protocol.data()),
                                static_cast<unsigned>(options_.protocol.size())};
  // The server must say that it speaks HTTP/3, see handshake_completed().
  if (!options_.protocol.empty() && gnutls_alpn_set_protocols(tls_, &protocol, 1, 0) != 0) return false;
  // TLS finds its connection by this reference, from within its callbacks.
  reference_.get_conn = [](ngtcp2_crypto_conn_ref* reference) {
    return static_cast<QuicConnection*>(reference->user_data)->quic_;
  };
  reference_.user_data = this;
  gnutls_session_set_ptr(tls_, &reference_);
  ngtcp2_conn_set_tls_native_handle(quic_, tls_);
  return true;
}

int QuicConnection::verify() {
  reason_ = verifier_.verify(tls_);
  return reason_.empty() ? 0 : GNUTLS_E_CERTIFICATE_VERIFICATION_ERROR;
}

// What comes in.

void QuicConnection::receive(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  // Anybody may send an empty datagram, which ngtcp2 takes for an error of its caller.
  if (is_over() || packet.empty()) return;
  const ngtcp2_path native{path_.local.native(), path_.remote.native(), nullptr};
  // No marks of congestion (ECN) are read from the socket.
  const ngtcp2_pkt_info info{};
  now_ns_ = now_ns;
  is_in_quic_ = true;
  const int error =
      ngtcp2_conn_read_pkt(quic_, &native, &info, packet.data(), packet.size(), static_cast<ngtcp2_tstamp>(now_ns));
  is_in_quic_ = false;
  if (error != 0) end(error, now_ns);
}

void QuicConnection::poll(std::int64_t now_ns) {
  if (is_over() || due_ns() > now_ns) return;
  // Handles lost packets, pings and time-outs; some of these end the connection.
  if (const int error = ngtcp2_conn_handle_expiry(quic_, static_cast<ngtcp2_tstamp>(now_ns)); error != 0)
    end(error, now_ns);
}

std::int64_t QuicConnection::due_ns() const {
  constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();
  if (is_over()) return kNever_ns;
  const ngtcp2_tstamp expiry = ngtcp2_conn_get_expiry(quic_);
  if (expiry >= static_cast<ngtcp2_tstamp>(kNever_ns)) return kNever_ns;
  const auto expiry_ns = static_cast<std::int64_t>(expiry);
  // A lone acknowledgement may wait for the next pose, which carries it along. A timer of ngtcp2 that is due for it
  // alone is put off as well.
  return is_quiet() ? answer_.due_ns(expiry_ns) : expiry_ns;
}

// What goes out.

void QuicConnection::write(const std::function<void(std::span<const std::uint8_t>)>& send, std::int64_t now_ns) {
  std::array<std::uint8_t, kPacketBytesMax> room;
  if (!is_over() && !(is_quiet() && answer_.holds(now_ns))) {
    // The congestion control says how much may leave at once. The rest is due a little later (pacing), so that a burst
    // does not fill the buffers on the way.
    const std::size_t packets_max =
        std::max<std::size_t>(1, ngtcp2_conn_get_send_quantum(quic_) / ngtcp2_conn_get_max_tx_udp_payload_size(quic_));
    std::size_t packets = 0;
    for (; packets < packets_max; ++packets) {
      ngtcp2_path_storage path;
      ngtcp2_path_storage_zero(&path);
      ngtcp2_pkt_info info{};
      is_in_quic_ = true;
      const ngtcp2_ssize bytes = queues_.write(quic_, path.path, info, room, now_ns, *this);
      is_in_quic_ = false;
      if (bytes < 0) {
        end(static_cast<int>(bytes), now_ns);
        break;
      }
      if (bytes == 0) break;
      send(std::span(room).first(static_cast<std::size_t>(bytes)));
    }
    if (!is_over()) {
      ngtcp2_conn_stat statistics{};
      ngtcp2_conn_get_conn_stat(quic_, &statistics);
      answer_.set_delay(quic::AnswerDelay::of_client(static_cast<std::int64_t>(statistics.smoothed_rtt)));
      answer_.on_written(packets > 0, now_ns);
      // The call tells ngtcp2 when this burst has ended; it paces the next one from here.
      ngtcp2_conn_update_pkt_tx_time(quic_, static_cast<ngtcp2_tstamp>(now_ns));
    }
  }
  // The packet that tells of the end goes last, and once. If it is lost, the server ends the connection after its idle
  // time.
  if (!close_packet_.empty()) send(std::exchange(close_packet_, {}));
}

bool QuicConnection::on_stopped(StreamId stream) {
  events_->on_stream_stopped(stream);
  return !close_wanted_;
}

StreamId QuicConnection::open_stream(bool one_way) {
  if (is_over()) return -1;
  StreamId id = -1;
  const int error =
      one_way ? ngtcp2_conn_open_uni_stream(quic_, &id, nullptr) : ngtcp2_conn_open_bidi_stream(quic_, &id, nullptr);
  return error == 0 ? id : -1;
}

void QuicConnection::send(StreamId stream, std::vector<std::uint8_t> bytes, bool is_last) {
  quic::SendBuffer& buffer = queues_.stream(stream);
  buffer.push(std::move(bytes));
  if (is_last) buffer.end();
}

void QuicConnection::take(StreamId stream, std::size_t bytes) {
  if (is_over()) return;
  answer_.send_soon();
  // Both windows open again: that of the stream, and that of the connection.
  ngtcp2_conn_extend_max_stream_offset(quic_, stream, bytes);
  ngtcp2_conn_extend_max_offset(quic_, bytes);
}

void QuicConnection::stop_reading(StreamId stream, http3::ErrorCode code) {
  if (is_over()) return;
  answer_.send_soon();
  ngtcp2_conn_shutdown_stream_read(quic_, stream, static_cast<std::uint64_t>(code));
}

std::size_t QuicConnection::datagram_frame_bytes_max() const {
  const ngtcp2_transport_params* peer = ngtcp2_conn_get_remote_transport_params(quic_);
  return peer ? static_cast<std::size_t>(peer->max_datagram_frame_size) : 0;
}

void QuicConnection::migrate(const quic::Address& local, std::int64_t now_ns) {
  path_.local = local;
  answer_.send_soon();
  const ngtcp2_path native{path_.local.native(), path_.remote.native(), nullptr};
  const int error = ngtcp2_conn_initiate_immediate_migration(quic_, &native, static_cast<ngtcp2_tstamp>(now_ns));
  if (error != 0) end(error, now_ns);
}

// How it ends.

void QuicConnection::close(http3::ErrorCode code, std::string_view reason, std::int64_t now_ns) {
  if (is_over()) return;
  // ngtcp2 must not be closed from within its own calls. The callback returns an error instead, and end() then closes
  // with what was wanted.
  if (is_in_quic_) {
    if (!close_wanted_) close_wanted_.emplace(code, reason);
    return;
  }
  reason_ = reason;
  ngtcp2_connection_close_error error;
  ngtcp2_connection_close_error_default(&error);
  ngtcp2_connection_close_error_set_application_error(&error, static_cast<std::uint64_t>(code),
                                                      reinterpret_cast<std::uint8_t*>(reason_.data()), reason_.size());
  write_close(error, now_ns);
  error_ = NGTCP2_ERR_CLOSING;
  queues_.clear();
}

void QuicConnection::end(int error, std::int64_t now_ns) {
  if (is_over()) return;
  if (const auto wanted = std::exchange(close_wanted_, {})) return close(wanted->first, wanted->second, now_ns);
  if (reason_.empty()) reason_ = describe(error);
  // In these cases nobody listens, or QUIC forbids an answer, so the peer is told nothing.
  const bool is_silent = error == NGTCP2_ERR_DRAINING || error == NGTCP2_ERR_IDLE_CLOSE ||
                         error == NGTCP2_ERR_HANDSHAKE_TIMEOUT || error == NGTCP2_ERR_RECV_VERSION_NEGOTIATION ||
                         error == NGTCP2_ERR_DROP_CONN;
  if (!is_silent) {
    ngtcp2_connection_close_error sent;
    ngtcp2_connection_close_error_default(&sent);
    if (error == NGTCP2_ERR_CRYPTO)
      // The server learns of a failed handshake by TLS's own alert, so that its log says what was wrong.
      ngtcp2_connection_close_error_set_transport_error_tls_alert(&sent, ngtcp2_conn_get_tls_alert(quic_), nullptr, 0);
    else
      ngtcp2_connection_close_error_set_transport_error_liberr(&sent, error, nullptr, 0);
    write_close(sent, now_ns);
  }
  error_ = error;
  queues_.clear();
}

// Says in one line what a person can act on; ngtcp2's own texts name functions of QUIC.
std::string QuicConnection::describe(int error) const {
  if (was_reset_) return "the server does not know the connection any more";
  if (error == NGTCP2_ERR_HANDSHAKE_TIMEOUT) return "nothing answers on its UDP port";
  if (error == NGTCP2_ERR_IDLE_CLOSE) return "nothing came for too long";
  if (error == NGTCP2_ERR_RECV_VERSION_NEGOTIATION) return "it speaks another version of QUIC";
  if (error != NGTCP2_ERR_DRAINING) return std::string("QUIC: ") + ngtcp2_strerror(error);
  const ngtcp2_connection_close_error received = close_error();
  const std::string reason(reinterpret_cast<const char*>(received.reason), received.reasonlen);
  // The reason is the peer's, and goes to a terminal or a log: control characters could forge lines there.
  const bool is_printable = std::ranges::all_of(reason, [](char c) { return c >= ' ' && c < '\x7f'; });
  if (received.reasonlen > 0 && is_printable) return "the server closed the connection: " + reason;
  if (received.type == NGTCP2_CONNECTION_CLOSE_ERROR_CODE_TYPE_TRANSPORT &&
      received.error_code == NGTCP2_CONNECTION_REFUSED)
    return "the server refused the connection";
  return "the server closed the connection";
}

ngtcp2_connection_close_error QuicConnection::close_error() const {
  ngtcp2_connection_close_error error;
  ngtcp2_conn_get_connection_close_error(quic_, &error);
  return error;
}

// The packet is kept until the next write(), since this may be called from within receive(), where nothing can be sent.
void QuicConnection::write_close(const ngtcp2_connection_close_error& error, std::int64_t now_ns) {
  close_packet_.resize(kPacketBytesMax);
  ngtcp2_path_storage path;
  ngtcp2_path_storage_zero(&path);
  ngtcp2_pkt_info info{};
  const ngtcp2_ssize bytes = ngtcp2_conn_write_connection_close(
      quic_, &path.path, &info, close_packet_.data(), close_packet_.size(), &error, static_cast<ngtcp2_tstamp>(now_ns));
  close_packet_.resize(bytes > 0 ? static_cast<std::size_t>(bytes) : 0);
}

}  // namespace hairnet::link
