#include <gnutls/crypto.h>
#include <ngtcp2/ngtcp2_crypto_gnutls.h>

#include <new>
#include <utility>

#include "core/assert.hpp"
#include "schema/quic/crypto_callbacks.hpp"
#include "schema/quic/parameters.hpp"
#include "server/quic/connection.hpp"

namespace hairnet::quic {
namespace {

// A stranger's bytes that wait for earlier, lost ones take no more memory than this. widen() adds to it once the
// session has joined.
constexpr std::uint64_t kStreamBytesMax = std::uint64_t{64} << 10, kConnectionBytesMax = kStreamBytesMax;
// One-way streams of a client carry settings alone here.
constexpr std::uint64_t kOneWayBytesMax = 4096;
// The peer may have this many streams open at a time. A client needs few: its control and QPACK streams, the session
// and the channel.
constexpr std::uint64_t kStreamsMax = 8, kOneWayStreamsMax = 8;

}  // namespace

// What ngtcp2 calls. No exception may cross it.
struct ConnectionCallbacks {
  static Connection& of(void* user) { return *static_cast<Connection*>(user); }

  // Runs `task`, and returns the code of a failure if it throws, or has failed the connection. ngtcp2 is C: an
  // exception through its frames would be undefined. A failure is kept, and end_with_error() explains it to the peer.
  template <class Task>
  static int guard(void* user, const Task& task) {
    Connection& connection = of(user);
    try {
      task(connection);
    } catch (const std::bad_alloc&) {
      connection.failure_ = Connection::Failure::no_memory;
    }
    return connection.failure_ == Connection::Failure::none ? 0 : NGTCP2_ERR_CALLBACK_FAILURE;
  }

  static int handshake_completed(ngtcp2_conn*, void* user) {
    return guard(user, [](Connection& c) { c.on_handshake_done(); });
  }
  static int recv_stream_data(ngtcp2_conn*, std::uint32_t flags, std::int64_t stream, std::uint64_t,
                              const std::uint8_t* bytes, std::size_t count, void* user, void*) {
    return guard(user, [&](Connection& c) {
      c.on_stream_bytes(stream, {bytes, count}, (flags & NGTCP2_STREAM_DATA_FLAG_FIN) != 0);
    });
  }
  static int acked_stream_data_offset(ngtcp2_conn*, std::int64_t stream, std::uint64_t offset, std::uint64_t count,
                                      void* user, void*) {
    // ngtcp2 reads bytes from our buffer again when a packet is lost, so they are freed only here.
    if (SendBuffer* buffer = of(user).queues_.find(stream)) buffer->acknowledge(offset + count);
    return 0;
  }
  static int stream_open(ngtcp2_conn*, std::int64_t, void*) { return 0; }
  static int stream_close(ngtcp2_conn*, std::uint32_t, std::int64_t stream, std::uint64_t, void* user, void*) {
    return guard(user, [&](Connection& c) { c.on_stream_closed(stream); });
  }
  static int stream_reset(ngtcp2_conn*, std::int64_t stream, std::uint64_t, std::uint64_t, void* user, void*) {
    return guard(user, [&](Connection& c) { c.http3_.on_reset(stream); });
  }
  static int recv_datagram(ngtcp2_conn*, std::uint32_t, const std::uint8_t* bytes, std::size_t count, void* user) {
    return guard(user, [&](Connection& c) { c.on_quic_datagram({bytes, count}); });
  }
  static int lost_datagram(ngtcp2_conn*, std::uint64_t, void* user) {
    of(user).counters_->datagrams_lost.add();
    return 0;
  }
  static int get_new_connection_id(ngtcp2_conn*, ngtcp2_cid* id, std::uint8_t* token, std::size_t bytes, void* user) {
    return guard(user, [&](Connection& c) {
      id->datalen = bytes;
      gnutls_rnd(GNUTLS_RND_RANDOM, id->data, bytes);
      c.host_->make_reset_token(*id, token);
      c.ids_.push_back(*id);
      c.host_->add_id(*id, c);
    });
  }
  static int remove_connection_id(ngtcp2_conn*, const ngtcp2_cid* id, void* user) {
    Connection& c = of(user);
    std::erase_if(c.ids_, [&](const ngtcp2_cid& known) { return ngtcp2_cid_eq(&known, id) != 0; });
    c.host_->remove_id(*id);
    return 0;
  }

  static const ngtcp2_callbacks& table() {
    static const ngtcp2_callbacks callbacks = [] {
      ngtcp2_callbacks made = crypto_callbacks();
      made.recv_client_initial = ngtcp2_crypto_recv_client_initial_cb;
      made.handshake_completed = handshake_completed;
      made.recv_stream_data = recv_stream_data;
      made.acked_stream_data_offset = acked_stream_data_offset;
      made.stream_open = stream_open;
      made.stream_close = stream_close;
      made.stream_reset = stream_reset;
      made.recv_datagram = recv_datagram;
      made.lost_datagram = lost_datagram;
      made.get_new_connection_id = get_new_connection_id;
      made.remove_connection_id = remove_connection_id;
      return made;
    }();
    return callbacks;
  }
};

std::unique_ptr<Connection> Connection::create(ConnectionHost& host, const ConnectionOptions& options,
                                               const Opening& opening, std::shared_ptr<const Credentials> credentials,
                                               QuicCounters& counters, std::int64_t now_ns) {
  std::unique_ptr<Connection> made(new Connection(host, options, counters));
  if (!made->begin(opening, std::move(credentials), now_ns)) return nullptr;
  return made;
}

bool Connection::begin(const Opening& opening, std::shared_ptr<const Credentials> credentials, std::int64_t now_ns) {
  credentials_ = std::move(credentials);
  remote_ = opening.path.remote;
  path_ = opening.path;
  is_verified_ = opening.is_verified;
  now_ns_ = now_ns;

  ngtcp2_settings settings;
  ngtcp2_settings_default(&settings);
  settings.initial_ts = static_cast<ngtcp2_tstamp>(now_ns);
  // ngtcp2 ends the connection by itself after this time, also if the client sends packets all the while.
  settings.handshake_timeout = static_cast<ngtcp2_duration>(options_.handshake_timeout_ns);

  ngtcp2_transport_params params;
  ngtcp2_transport_params_default(&params);
  params.initial_max_stream_data_bidi_remote = kStreamBytesMax;
  params.initial_max_stream_data_uni = kOneWayBytesMax;
  params.initial_max_data = kConnectionBytesMax;
  params.initial_max_streams_bidi = kStreamsMax;
  params.initial_max_streams_uni = kOneWayStreamsMax;
  params.max_idle_timeout = static_cast<ngtcp2_duration>(options_.idle_timeout_ns);
  params.max_datagram_frame_size = kDatagramFrameBytesMax;
  // The server stores at most this many connection IDs of the client; it uses another one when the path changes.
  params.active_connection_id_limit = 4;
  // Peers must know our delay, or they would take late acknowledgements for a longer round trip.
  params.max_ack_delay = static_cast<ngtcp2_duration>(AnswerDelay::kAnnouncedDelay_ns);
  ngtcp2_cid own{};
  own.datalen = kIdBytes;
  gnutls_rnd(GNUTLS_RND_RANDOM, own.data, own.datalen);
  params.stateless_reset_token_present = 1;
  host_->make_reset_token(own, params.stateless_reset_token);
  if (opening.original_destination) {
    // Both IDs prove to the client that the Retry was ours, and not of somebody on the path (RFC 9000, section 7.3).
    params.original_dcid = *opening.original_destination;
    params.retry_scid = opening.client_destination;
    params.retry_scid_present = 1;
  } else {
    params.original_dcid = opening.client_destination;
  }

  Path copy = opening.path;
  const ngtcp2_path path{copy.local.native(), copy.remote.native(), nullptr};
  if (ngtcp2_conn_server_new(&quic_, &opening.client_source, &own, &path, opening.version,
                             &ConnectionCallbacks::table(), &settings, &params, nullptr, this) != 0) {
    quic_ = nullptr;
    return false;
  }
  ngtcp2_conn_set_keep_alive_timeout(quic_, static_cast<ngtcp2_duration>(options_.keep_alive_ns));

  // Session tickets of TLS are not sent: a returning client does a full handshake and needs no state here.
  if (gnutls_init(&tls_, GNUTLS_SERVER | GNUTLS_NO_AUTO_SEND_TICKET | GNUTLS_NO_END_OF_EARLY_DATA) != 0) {
    tls_ = nullptr;
    return false;
  }
  constexpr std::uint8_t kProtocol[] = {'h', '3'};
  const gnutls_datum_t protocol{const_cast<std::uint8_t*>(kProtocol), sizeof(kProtocol)};
  if (gnutls_priority_set_direct(tls_, kTlsPriorities, nullptr) != 0 ||
      ngtcp2_crypto_gnutls_configure_server_session(tls_) != 0 ||
      gnutls_credentials_set(tls_, GNUTLS_CRD_CERTIFICATE, credentials_->native()) != 0 ||
      gnutls_alpn_set_protocols(tls_, &protocol, 1, GNUTLS_ALPN_MANDATORY) != 0)
    return false;
  reference_.get_conn = [](ngtcp2_crypto_conn_ref* reference) {
    return static_cast<Connection*>(reference->user_data)->quic_;
  };
  reference_.user_data = this;
  gnutls_session_set_ptr(tls_, &reference_);
  ngtcp2_conn_set_tls_native_handle(quic_, tls_);

  // Until the client has learnt our ID its packets carry the one that it chose at random.
  ids_ = {own, opening.client_destination};
  for (const ngtcp2_cid& id : ids_) host_->add_id(id, *this);
  return true;
}

}  // namespace hairnet::quic
