#include "tests/support/quic_client.hpp"

#include <arpa/inet.h>
#include <gnutls/crypto.h>
#include <ngtcp2/ngtcp2_crypto_gnutls.h>

#include <array>
#include <cstdlib>

#include "server/quic/outgoing.hpp"
#include "tests/support/http3_client.hpp"

namespace hairnet::quic {

Address loopback(std::uint16_t port, std::uint8_t last) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(0x7f000000u | last);
  return Address::of(reinterpret_cast<const sockaddr*>(&address), sizeof(address));
}

struct QuicClientCallbacks {
  static QuicClient& of(void* user) { return *static_cast<QuicClient*>(user); }

  static int handshake_completed(ngtcp2_conn*, void* user) {
    of(user).is_ready_ = true;
    return 0;
  }
  static int recv_stream_data(ngtcp2_conn* quic, std::uint32_t flags, std::int64_t stream, std::uint64_t,
                              const std::uint8_t* bytes, std::size_t count, void* user, void*) {
    Bytes& all = of(user).received[stream];
    all.insert(all.end(), bytes, bytes + count);
    if ((flags & NGTCP2_STREAM_DATA_FLAG_FIN) != 0) of(user).ended[stream] = true;
    ngtcp2_conn_extend_max_stream_offset(quic, stream, count);
    ngtcp2_conn_extend_max_offset(quic, count);
    return 0;
  }
  static int stream_reset(ngtcp2_conn*, std::int64_t stream, std::uint64_t, std::uint64_t code, void* user, void*) {
    of(user).resets[stream] = code;
    return 0;
  }
  static int recv_datagram(ngtcp2_conn*, std::uint32_t, const std::uint8_t* bytes, std::size_t count, void* user) {
    of(user).datagrams.emplace_back(bytes, bytes + count);
    return 0;
  }
  static int recv_new_token(ngtcp2_conn*, const ngtcp2_vec* token, void* user) {
    of(user).token.assign(token->base, token->base + token->len);
    return 0;
  }
  static int recv_stateless_reset(ngtcp2_conn*, const ngtcp2_pkt_stateless_reset*, void* user) {
    of(user).was_reset = true;
    return 0;
  }
  static int get_new_connection_id(ngtcp2_conn*, ngtcp2_cid* id, std::uint8_t* token, std::size_t bytes, void*) {
    id->datalen = bytes;
    gnutls_rnd(GNUTLS_RND_NONCE, id->data, bytes);
    gnutls_rnd(GNUTLS_RND_NONCE, token, NGTCP2_STATELESS_RESET_TOKENLEN);
    return 0;
  }
  static void put_random(std::uint8_t* out, std::size_t bytes, const ngtcp2_rand_ctx*) {
    gnutls_rnd(GNUTLS_RND_NONCE, out, bytes);
  }
};

QuicClient::QuicClient(const Path& path, std::int64_t now_ns, const Options& options)
    : path_(path), protocol_(options.protocol) {
  using Callbacks = QuicClientCallbacks;
  ngtcp2_callbacks callbacks{};
  callbacks.client_initial = ngtcp2_crypto_client_initial_cb;
  callbacks.recv_crypto_data = ngtcp2_crypto_recv_crypto_data_cb;
  callbacks.encrypt = ngtcp2_crypto_encrypt_cb;
  callbacks.decrypt = ngtcp2_crypto_decrypt_cb;
  callbacks.hp_mask = ngtcp2_crypto_hp_mask_cb;
  callbacks.recv_retry = ngtcp2_crypto_recv_retry_cb;
  callbacks.update_key = ngtcp2_crypto_update_key_cb;
  callbacks.delete_crypto_aead_ctx = ngtcp2_crypto_delete_crypto_aead_ctx_cb;
  callbacks.delete_crypto_cipher_ctx = ngtcp2_crypto_delete_crypto_cipher_ctx_cb;
  callbacks.get_path_challenge_data = ngtcp2_crypto_get_path_challenge_data_cb;
  callbacks.version_negotiation = ngtcp2_crypto_version_negotiation_cb;
  callbacks.rand = Callbacks::put_random;
  callbacks.handshake_completed = Callbacks::handshake_completed;
  callbacks.recv_stream_data = Callbacks::recv_stream_data;
  callbacks.stream_reset = Callbacks::stream_reset;
  callbacks.recv_datagram = Callbacks::recv_datagram;
  callbacks.recv_new_token = Callbacks::recv_new_token;
  callbacks.recv_stateless_reset = Callbacks::recv_stateless_reset;
  callbacks.get_new_connection_id = Callbacks::get_new_connection_id;

  ngtcp2_settings settings;
  ngtcp2_settings_default(&settings);
  settings.initial_ts = static_cast<ngtcp2_tstamp>(now_ns);
  ngtcp2_transport_params params;
  ngtcp2_transport_params_default(&params);
  params.initial_max_streams_uni = 8;
  params.initial_max_streams_bidi = 8;
  params.initial_max_stream_data_bidi_local = options.window_bytes;
  params.initial_max_stream_data_uni = options.window_bytes;
  params.initial_max_data = options.window_bytes;
  params.max_idle_timeout = static_cast<ngtcp2_duration>(options.idle_timeout_ns);
  params.max_datagram_frame_size = options.datagram_frame_bytes_max;
  ngtcp2_cid source{}, destination{};
  source.datalen = destination.datalen = 12;
  gnutls_rnd(GNUTLS_RND_NONCE, source.data, source.datalen);
  gnutls_rnd(GNUTLS_RND_NONCE, destination.data, destination.datalen);
  const ngtcp2_path native{path_.local.native(), path_.remote.native(), nullptr};
  const int error = ngtcp2_conn_client_new(&quic_, &destination, &source, &native, options.version, &callbacks,
                                           &settings, &params, nullptr, this);
  if (error != 0 || gnutls_init(&tls_, GNUTLS_CLIENT) != 0 ||
      gnutls_certificate_allocate_credentials(&credentials_) != 0)
    std::abort();
  gnutls_priority_set_direct(tls_, "NORMAL:-VERS-ALL:+VERS-TLS1.3:%DISABLE_TLS13_COMPAT_MODE", nullptr);
  ngtcp2_crypto_gnutls_configure_client_session(tls_);
  gnutls_credentials_set(tls_, GNUTLS_CRD_CERTIFICATE, credentials_);
  gnutls_datum_t protocol{reinterpret_cast<unsigned char*>(protocol_.data()), static_cast<unsigned>(protocol_.size())};
  if (!protocol_.empty()) gnutls_alpn_set_protocols(tls_, &protocol, 1, 0);
  reference_.get_conn = [](ngtcp2_crypto_conn_ref* reference) {
    return static_cast<QuicClient*>(reference->user_data)->quic_;
  };
  reference_.user_data = this;
  gnutls_session_set_ptr(tls_, &reference_);
  ngtcp2_conn_set_tls_native_handle(quic_, tls_);
}

QuicClient::~QuicClient() {
  ngtcp2_conn_del(quic_);
  gnutls_deinit(tls_);
  gnutls_certificate_free_credentials(credentials_);
}

std::vector<Bytes> QuicClient::write(std::int64_t now_ns) {
  std::vector<Bytes> packets(closing_.begin(), closing_.end());
  closing_.clear();
  if (is_silent_) return {};
  const auto time = static_cast<ngtcp2_tstamp>(now_ns);
  std::array<std::uint8_t, Outgoing::kPacketBytesMax> room;
  for (bool more = error_ == 0; more;) {
    ngtcp2_path_storage path;
    ngtcp2_path_storage_zero(&path);
    ngtcp2_pkt_info info{};
    ngtcp2_ssize bytes = 0;
    if (is_ready_ && !datagrams_.empty()) {
      const ngtcp2_vec piece{datagrams_.front().data(), datagrams_.front().size()};
      int taken = 0;
      bytes = ngtcp2_conn_writev_datagram(quic_, &path.path, &info, room.data(), room.size(), &taken,
                                          NGTCP2_WRITE_DATAGRAM_FLAG_NONE, 0, &piece, 1, time);
      if (taken || bytes < 0) datagrams_.pop_front();
    } else {
      Stream* next = nullptr;
      std::int64_t id = -1;
      for (auto& [number, stream] : streams_) {
        if (next || (stream.next == stream.chunks.size() && stream.is_ended == stream.is_end_sent)) continue;
        next = &stream;
        id = number;
      }
      ngtcp2_vec piece{};
      std::uint32_t flags = NGTCP2_WRITE_STREAM_FLAG_NONE;
      if (next && next->next < next->chunks.size())
        piece = {next->chunks[next->next].data() + next->offset, next->chunks[next->next].size() - next->offset};
      if (next && next->is_ended && next->next + 1 >= next->chunks.size()) flags |= NGTCP2_WRITE_STREAM_FLAG_FIN;
      ngtcp2_ssize taken = -1;
      bytes = ngtcp2_conn_writev_stream(quic_, &path.path, &info, room.data(), room.size(), &taken, flags, id, &piece,
                                        next ? 1 : 0, time);
      if (next && taken >= 0) {
        next->offset += static_cast<std::size_t>(taken);
        const bool is_whole = next->offset == (next->next < next->chunks.size() ? next->chunks[next->next].size() : 0);
        if (is_whole && next->next < next->chunks.size()) {
          ++next->next;
          next->offset = 0;
        }
        if (is_whole && (flags & NGTCP2_WRITE_STREAM_FLAG_FIN) != 0) next->is_end_sent = true;
      }
      if (bytes == NGTCP2_ERR_STREAM_SHUT_WR || bytes == NGTCP2_ERR_STREAM_NOT_FOUND) {
        streams_.erase(id);
        continue;
      }
    }
    if (bytes == NGTCP2_ERR_STREAM_DATA_BLOCKED) bytes = 0;
    if (bytes < 0) error_ = static_cast<int>(bytes);
    more = bytes > 0;
    if (more) packets.emplace_back(room.data(), room.data() + bytes);
  }
  if (error_ == 0) ngtcp2_conn_update_pkt_tx_time(quic_, time);
  return packets;
}

void QuicClient::receive(std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  if (error_ != 0 || is_silent_) return;
  const ngtcp2_path native{path_.local.native(), path_.remote.native(), nullptr};
  const ngtcp2_pkt_info info{};
  error_ =
      ngtcp2_conn_read_pkt(quic_, &native, &info, packet.data(), packet.size(), static_cast<ngtcp2_tstamp>(now_ns));
}

void QuicClient::poll(std::int64_t now_ns) {
  const auto time = static_cast<ngtcp2_tstamp>(now_ns);
  if (error_ == 0 && ngtcp2_conn_get_expiry(quic_) <= time) error_ = ngtcp2_conn_handle_expiry(quic_, time);
}

void QuicClient::migrate(const Address& local, std::int64_t now_ns) {
  path_.local = local;
  const ngtcp2_path native{path_.local.native(), path_.remote.native(), nullptr};
  if (ngtcp2_conn_initiate_immediate_migration(quic_, &native, static_cast<ngtcp2_tstamp>(now_ns)) != 0) std::abort();
}

std::int64_t QuicClient::open_stream(bool one_way) {
  std::int64_t id = -1;
  const int error =
      one_way ? ngtcp2_conn_open_uni_stream(quic_, &id, nullptr) : ngtcp2_conn_open_bidi_stream(quic_, &id, nullptr);
  if (error != 0) return -1;
  streams_[id];
  return id;
}

void QuicClient::send(std::int64_t stream, const Bytes& bytes, bool is_last) {
  if (!bytes.empty()) streams_[stream].chunks.push_back(bytes);
  streams_[stream].is_ended = is_last;
}

std::int64_t QuicClient::open_session(std::string_view authority, std::string_view path, std::string_view origin) {
  send(open_stream(true), http3::control_stream());
  const std::int64_t session = open_stream();
  send(session, http3::connect_request(authority, path, origin));
  return session;
}

std::int64_t QuicClient::open_channel(std::int64_t session) {
  const std::int64_t channel = open_stream();
  send(channel, http3::channel_begin(static_cast<std::uint64_t>(session)));
  return channel;
}

void QuicClient::close(std::int64_t now_ns) {
  ngtcp2_connection_close_error error;
  ngtcp2_connection_close_error_default(&error);
  ngtcp2_connection_close_error_set_application_error(&error, 0x100, nullptr, 0);
  Bytes packet(Outgoing::kPacketBytesMax);
  ngtcp2_path_storage path;
  ngtcp2_path_storage_zero(&path);
  ngtcp2_pkt_info info{};
  const ngtcp2_ssize bytes = ngtcp2_conn_write_connection_close(quic_, &path.path, &info, packet.data(), packet.size(),
                                                                &error, static_cast<ngtcp2_tstamp>(now_ns));
  packet.resize(bytes > 0 ? static_cast<std::size_t>(bytes) : 0);
  if (!packet.empty()) closing_.push_back(std::move(packet));
  error_ = NGTCP2_ERR_CLOSING;
}

ngtcp2_connection_close_error QuicClient::close_error() const {
  ngtcp2_connection_close_error error;
  ngtcp2_conn_get_connection_close_error(quic_, &error);
  return error;
}

std::string QuicClient::leaf_certificate() const {
  unsigned count = 0;
  const gnutls_datum_t* chain = gnutls_certificate_get_peers(tls_, &count);
  return chain ? std::string(reinterpret_cast<const char*>(chain->data), chain->size) : std::string();
}

}  // namespace hairnet::quic
