#include "server/quic/endpoint.hpp"

#include <gnutls/crypto.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "core/assert.hpp"

namespace hairnet::quic {
namespace {

// A token of a Retry is valid for 10 s, since a client answers a Retry at once. An address token is valid for an hour,
// for a client that connects again within this time.
constexpr std::uint64_t kRetryTokenLife_ns = 10'000'000'000, kAddressTokenLife_ns = 3'600'000'000'000;
// With more used Retry tokens than this, the oldest ones are forgotten. The admission limits let in fewer clients
// within the 10 s of a token's life.
constexpr std::size_t kUsedRetriesMax = 16'384;
// The rate and the burst of answers without a connection. A flood of packets from forged addresses makes the server
// send no more than this to the owners of the addresses.
constexpr double kStatelessPerS = 200, kStatelessBurst = 200;
// A stateless reset has this size, and only longer packets are answered by one. A shorter reset could be distinguished
// from a packet of a connection (RFC 9000, section 10.3).
constexpr std::size_t kResetBytesMin = 41;

}  // namespace

Endpoint::Id Endpoint::Id::of(const std::uint8_t* bytes, std::size_t count) {
  HAIRNET_ASSERT(count <= NGTCP2_MAX_CIDLEN);
  Id id;
  if (count > 0) std::memcpy(id.bytes.data(), bytes, count);
  id.count = static_cast<std::uint8_t>(count);
  return id;
}

Endpoint::Endpoint(const EndpointOptions& options, std::shared_ptr<const Credentials> credentials, Gate& gate,
                   QuicCounters& counters, Outgoing::Writer writer, std::int64_t now_ns)
    : options_(options),
      credentials_(std::move(credentials)),
      gate_(&gate),
      counters_(&counters),
      out_([this, write = std::move(writer)](std::span<const Burst> bursts) {
        for (const Burst& burst : bursts) {
          counters_->bytes_sent.add(burst.bytes.size());
          counters_->packets_sent.add((burst.bytes.size() + burst.segment_bytes - 1) / burst.segment_bytes);
        }
        write(bursts);
      }),
      stateless_(kStatelessPerS, kStatelessBurst, now_ns) {
  HAIRNET_ASSERT(credentials_);
  // Tokens of an earlier server prove nothing to this one, and are treated like none.
  gnutls_rnd(GNUTLS_RND_KEY, token_secret_.data(), token_secret_.size());
  gnutls_rnd(GNUTLS_RND_KEY, reset_secret_.data(), reset_secret_.size());
  if (options_.identity.empty()) return;
  // The text makes the key one of resets only: another use of the same secret would have another text.
  constexpr std::string_view kUse = "hairnet stateless reset";
  // The key of resets must outlive the process, as only the next server sends resets for it. The hash keeps the
  // machine's name itself out of what is used on the wire.
  const int error = gnutls_hmac_fast(GNUTLS_MAC_SHA256, options_.identity.data(), options_.identity.size(), kUse.data(),
                                     kUse.size(), reset_secret_.data());
  HAIRNET_ASSERT(error == 0);
}

Endpoint::~Endpoint() {
  for (auto& [key, entry] : connections_) entry.first->abandon();
}

// The functions from here to remember_used() handle what comes in.

void Endpoint::receive(const Path& path, std::uint8_t ecn, std::span<const std::uint8_t> packet, std::int64_t now_ns) {
  counters_->packets_received.add();
  counters_->bytes_received.add(packet.size());
  if (packet.empty()) return counters_->dropped_malformed.add();
  ngtcp2_version_cid header{};
  const int error = ngtcp2_pkt_decode_version_cid(&header, packet.data(), packet.size(), Connection::kIdBytes);
  if (error == NGTCP2_ERR_VERSION_NEGOTIATION) return negotiate_version(path, packet, header, now_ns);
  if (error != 0 || header.dcidlen > NGTCP2_MAX_CIDLEN) return counters_->dropped_malformed.add();
  // The ID decides and not the address: a client that changes its network keeps its connection.
  const auto found = by_id_.find(Id::of(header.dcid, header.dcidlen));
  if (found == by_id_.end()) return take_stranger(path, ecn, packet, header, now_ns);
  Connection& connection = *found->second;
  connection.receive(path, ecn, packet, now_ns);
  if (connection.may_wait(now_ns))
    settle(connection);
  else
    dirty_.insert(&connection);
}

void Endpoint::take_stranger(const Path& path, std::uint8_t ecn, std::span<const std::uint8_t> packet,
                             const ngtcp2_version_cid& header, std::int64_t now_ns) {
  // The highest bit of the first byte is set in a long header (RFC 9000, section 17.2). A short header belongs to a
  // finished handshake: this peer talks to a server that has died.
  const bool is_long = (packet[0] & 0x80) != 0;
  if (!is_long) return send_reset(path, packet, header, now_ns);
  ngtcp2_pkt_hd initial{};
  if (ngtcp2_accept(&initial, packet.data(), packet.size()) != 0 || initial.type != NGTCP2_PKT_INITIAL)
    return counters_->dropped_unknown.add();
  // A server that stops accepts no new clients, and does not answer them.
  if (is_closed_) return counters_->dropped_closed.add();
  if (!gate_->may_begin(now_ns)) return counters_->dropped_rate.add();
  Connection::Opening opening{path, initial.scid, initial.dcid, std::nullopt, initial.version, false};
  const TokenCheck check = check_token(initial, path, opening, now_ns);
  if (check == TokenCheck::wrong) {
    counters_->refused_token.add();
    return send_refusal(path, initial, NGTCP2_INVALID_TOKEN);
  }
  // The endpoint now stores nothing of a new client until it has shown that it reads at its address.
  if (check == TokenCheck::none && unverified_count_ >= options_.unverified_max)
    return send_retry(path, initial, now_ns);
  opening.is_verified = check == TokenCheck::verified;
  const std::shared_ptr<void> ticket = opening.is_verified ? gate_->admit(path.remote, now_ns) : nullptr;
  if (opening.is_verified && !ticket) {
    counters_->refused_admission.add();
    return send_refusal(path, initial, NGTCP2_CONNECTION_REFUSED);
  }
  auto made = Connection::create(*this, options_.connection, opening, credentials_, *counters_, now_ns);
  if (!made) return counters_->dropped_unknown.add();
  Connection& connection = *made;
  // Only a connection that was made uses its token up; a client that was refused may try again.
  if (opening.original_destination) remember_used(Id::of(initial.dcid.data, initial.dcid.datalen), now_ns);
  unverified_count_ += opening.is_verified ? 0 : 1;
  connection.set_ticket(ticket);
  const std::int64_t never_ns = std::numeric_limits<std::int64_t>::max();
  connections_.emplace(&connection, std::pair(std::move(made), never_ns));
  timers_.emplace(never_ns, &connection);
  connection.receive(path, ecn, packet, now_ns);
  dirty_.insert(&connection);
}

Endpoint::TokenCheck Endpoint::check_token(const ngtcp2_pkt_hd& header, Path path, Connection::Opening& opening,
                                           std::int64_t now_ns) const {
  if (header.token.len == 0) return TokenCheck::none;
  const auto time = static_cast<ngtcp2_tstamp>(now_ns);
  if (header.token.base[0] == NGTCP2_CRYPTO_TOKEN_MAGIC_RETRY) {
    ngtcp2_cid original{};
    if (ngtcp2_crypto_verify_retry_token(&original, header.token.base, header.token.len, token_secret_.data(),
                                         token_secret_.size(), header.version, &path.remote.any, path.remote.bytes,
                                         &header.dcid, kRetryTokenLife_ns, time) != 0 ||
        // The connection ID that we chose in the Retry names the token; a copied packet has the same one.
        used_retries_.contains(Id::of(header.dcid.data, header.dcid.datalen)))
      return TokenCheck::wrong;
    opening.original_destination = original;
    return TokenCheck::verified;
  }
  // A token of an earlier connection. A wrong one, or one of an earlier server, is like none.
  const bool is_valid = header.token.base[0] == NGTCP2_CRYPTO_TOKEN_MAGIC_REGULAR &&
                        ngtcp2_crypto_verify_regular_token(header.token.base, header.token.len, token_secret_.data(),
                                                           token_secret_.size(), &path.remote.any, path.remote.bytes,
                                                           kAddressTokenLife_ns, time) == 0;
  return is_valid ? TokenCheck::verified : TokenCheck::none;
}

void Endpoint::remember_used(const Id& retry, std::int64_t now_ns) {
  while (!used_until_.empty() && (used_until_.front().first < now_ns || used_until_.size() >= kUsedRetriesMax)) {
    used_retries_.erase(used_until_.front().second);
    used_until_.pop_front();
  }
  used_retries_.insert(retry);
  used_until_.emplace_back(now_ns + static_cast<std::int64_t>(kRetryTokenLife_ns), retry);
}

// The next four functions answer without a connection. Each answer is shorter than the packet that it answers, so that
// a forged packet gains nothing.

void Endpoint::send_retry(const Path& path, const ngtcp2_pkt_hd& header, std::int64_t now_ns) {
  ngtcp2_cid source{};
  source.datalen = Connection::kIdBytes;
  gnutls_rnd(GNUTLS_RND_RANDOM, source.data, source.datalen);
  std::array<std::uint8_t, NGTCP2_CRYPTO_MAX_RETRY_TOKENLEN> token{};
  Path copy = path;
  const ngtcp2_ssize token_bytes = ngtcp2_crypto_generate_retry_token(
      token.data(), token_secret_.data(), token_secret_.size(), header.version, &copy.remote.any, copy.remote.bytes,
      &source, &header.dcid, static_cast<ngtcp2_tstamp>(now_ns));
  if (token_bytes < 0) return counters_->dropped_unknown.add();
  const std::span<std::uint8_t> room = out_.room();
  const ngtcp2_ssize bytes =
      ngtcp2_crypto_write_retry(room.data(), room.size(), header.version, &header.scid, &source, &header.dcid,
                                token.data(), static_cast<std::size_t>(token_bytes));
  if (bytes <= 0) return counters_->dropped_unknown.add();
  counters_->retries_sent.add();
  out_.add(path, static_cast<std::size_t>(bytes), 0);
}

void Endpoint::send_refusal(const Path& path, const ngtcp2_pkt_hd& header, std::uint64_t error) {
  const std::span<std::uint8_t> room = out_.room();
  const ngtcp2_ssize bytes = ngtcp2_crypto_write_connection_close(room.data(), room.size(), header.version,
                                                                  &header.scid, &header.dcid, error, nullptr, 0);
  if (bytes > 0) out_.add(path, static_cast<std::size_t>(bytes), 0);
}

void Endpoint::negotiate_version(const Path& path, std::span<const std::uint8_t> packet,
                                 const ngtcp2_version_cid& header, std::int64_t now_ns) {
  // A first packet must be padded. A smaller one may be forged, to make this server send more than it got to somebody
  // else.
  if (packet.size() < NGTCP2_MAX_UDP_PAYLOAD_SIZE) return counters_->dropped_malformed.add();
  if (!stateless_.take(1, now_ns)) return counters_->dropped_rate.add();
  const std::uint32_t ours = NGTCP2_PROTO_VER_V1;
  std::uint8_t unused = 0;
  gnutls_rnd(GNUTLS_RND_NONCE, &unused, 1);
  const std::span<std::uint8_t> room = out_.room();
  const ngtcp2_ssize bytes = ngtcp2_pkt_write_version_negotiation(
      room.data(), room.size(), unused, header.scid, header.scidlen, header.dcid, header.dcidlen, &ours, 1);
  if (bytes <= 0) return counters_->dropped_malformed.add();
  counters_->versions_negotiated.add();
  out_.add(path, static_cast<std::size_t>(bytes), 0);
}

void Endpoint::send_reset(const Path& path, std::span<const std::uint8_t> packet, const ngtcp2_version_cid& header,
                          std::int64_t now_ns) {
  counters_->dropped_unknown.add();
  if (packet.size() <= kResetBytesMin || header.dcidlen != Connection::kIdBytes || !stateless_.take(1, now_ns)) return;
  ngtcp2_cid id{};
  ngtcp2_cid_init(&id, header.dcid, header.dcidlen);
  std::array<std::uint8_t, NGTCP2_STATELESS_RESET_TOKENLEN> token{};
  make_reset_token(id, token.data());
  // A reset looks like any short packet to those who do not have the token. It is shorter than the packet that it
  // answers, so two servers cannot answer each other without end.
  std::array<std::uint8_t, kResetBytesMin - NGTCP2_STATELESS_RESET_TOKENLEN> noise{};
  gnutls_rnd(GNUTLS_RND_NONCE, noise.data(), noise.size());
  const std::span<std::uint8_t> room = out_.room();
  const ngtcp2_ssize bytes =
      ngtcp2_pkt_write_stateless_reset(room.data(), kResetBytesMin, token.data(), noise.data(), noise.size());
  if (bytes <= 0) return;
  counters_->resets_sent.add();
  out_.add(path, static_cast<std::size_t>(bytes), 0);
}

// The functions from here to due_ns() write what goes out, and keep the time-outs.

void Endpoint::flush(std::int64_t now_ns) {
  // The loop ends, because each turn moves one entry to a later time.
  while (!timers_.empty() && timers_.begin()->first <= now_ns) {
    Connection* connection = timers_.begin()->second;
    std::int64_t due_ns = connection->due_ns();
    if (due_ns <= now_ns) {
      connection->poll(now_ns);
      // The connection is written and settled below, which sets its next time. Until then it is not due again, or the
      // loop could find it again and again.
      due_ns = std::numeric_limits<std::int64_t>::max();
      dirty_.insert(connection);
    }
    timers_.erase(timers_.begin());
    connections_.at(connection).second = due_ns;
    timers_.emplace(due_ns, connection);
  }
  // Writing may make connections want to write again, through their sessions.
  for (const auto& connection : std::exchange(dirty_, {})) {
    connection->write(out_, now_ns);
    settle(*connection);
  }
  out_.flush();
}

void Endpoint::settle(Connection& connection) {
  const auto found = connections_.find(&connection);
  HAIRNET_ASSERT(found != connections_.end());
  std::int64_t& entered_ns = found->second.second;
  // The connection leaves all tables before it is destroyed, so no packet or timer finds it.
  if (connection.is_over()) {
    timers_.erase({entered_ns, &connection});
    for (const ngtcp2_cid& id : connection.ids()) remove_id(id);
    unverified_count_ -= connection.is_verified() ? 0 : 1;
    dirty_.erase(&connection);
    connections_.erase(found);
    return;
  }
  // Most packets move the time-out to a later time. The entry in timers_ then stays, and flush() finds the later time
  // when the entry is due.
  const std::int64_t due_ns = connection.due_ns();
  if (due_ns >= entered_ns) return;
  timers_.erase({entered_ns, &connection});
  timers_.emplace(entered_ns = due_ns, &connection);
}

std::int64_t Endpoint::due_ns() const {
  return timers_.empty() ? std::numeric_limits<std::int64_t>::max() : timers_.begin()->first;
}

// These functions implement ConnectionHost: connections call them.

void Endpoint::add_id(const ngtcp2_cid& id, Connection& connection) {
  by_id_.emplace(Id::of(id.data, id.datalen), &connection);
}

void Endpoint::remove_id(const ngtcp2_cid& id) {
  by_id_.erase(Id::of(id.data, id.datalen));
}

void Endpoint::make_reset_token(const ngtcp2_cid& id, std::uint8_t* token) {
  const int error =
      ngtcp2_crypto_generate_stateless_reset_token(token, reset_secret_.data(), reset_secret_.size(), &id);
  HAIRNET_ASSERT(error == 0);
}

bool Endpoint::on_verified(Connection& connection, std::int64_t now_ns) {
  std::shared_ptr<void> ticket = gate_->admit(connection.remote(), now_ns);
  if (!ticket) {
    counters_->refused_admission.add();
    return false;
  }
  connection.set_ticket(std::move(ticket));
  --unverified_count_;
  return true;
}

std::vector<std::uint8_t> Endpoint::make_address_token(const Address& remote, std::int64_t now_ns) {
  std::vector<std::uint8_t> token(NGTCP2_CRYPTO_MAX_REGULAR_TOKENLEN);
  // ngtcp2 takes a pointer that is not const.
  Address copy = remote;
  const ngtcp2_ssize bytes =
      ngtcp2_crypto_generate_regular_token(token.data(), token_secret_.data(), token_secret_.size(), &copy.any,
                                           copy.bytes, static_cast<ngtcp2_tstamp>(now_ns));
  token.resize(bytes > 0 ? static_cast<std::size_t>(bytes) : 0);
  return token;
}

int Endpoint::on_request(Connection& connection, const http3::Request& request, std::int64_t) {
  return gate_->on_request(connection.remote(), request);
}

std::shared_ptr<SessionSink> Endpoint::on_session(Connection& connection, std::int64_t now_ns) {
  return gate_->on_session(connection, now_ns);
}

}  // namespace hairnet::quic
