#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "server/quic/connection.hpp"
#include "server/threading/token_bucket.hpp"

namespace hairnet::quic {

struct EndpointOptions {
  ConnectionOptions connection;
  // When this many connections have a peer that has not answered at its address, a new client must first repeat its
  // packet with a token, which the server sends to its address (Retry).
  std::size_t unverified_max = 64;
  // A secret that is the same at the server's next start. From it the endpoint makes the tokens of stateless resets, so
  // that a client of a server that has died is told at its first packet to the next server. Empty: such a client waits
  // for its idle time-out.
  std::string identity;
};

// Decides about connections and sessions; the owner of the endpoint implements it (QuicListener), so that QUIC need not
// know the rules of admission. Every call comes from within receive() or flush(), so it must return soon.
class Gate {
 public:
  virtual ~Gate() = default;
  // False: too many begin at this moment. The packet is dropped; its client repeats it.
  virtual bool may_begin(std::int64_t now_ns) = 0;
  // A peer that has answered at its address. Null refuses it; else the connection holds the ticket until it ends.
  virtual std::shared_ptr<void> admit(const Address& remote, std::int64_t now_ns) = 0;
  // The status of the answer to a request for a session; 200 opens it.
  virtual int on_request(const Address& remote, const http3::Request& request) = 0;
  // See ConnectionHost::on_session.
  virtual std::shared_ptr<SessionSink> on_session(Connection& connection, std::int64_t now_ns) = 0;
};

// All QUIC connections of one UDP port: which packet belongs to which, Retry, version negotiation, stateless resets,
// time-outs. No I/O: packets and times in, packets out. One thread.
class Endpoint final : private ConnectionHost {
 public:
  // `gate` and `counters` must outlive it.
  Endpoint(const EndpointOptions& options, std::shared_ptr<const Credentials> credentials, Gate& gate,
           QuicCounters& counters, Outgoing::Writer writer, std::int64_t now_ns);
  // Tells all sessions of their end; peers hear nothing.
  ~Endpoint() override;

  // New connections show this certificate; existing ones keep theirs.
  void set_credentials(std::shared_ptr<const Credentials> credentials) { credentials_ = std::move(credentials); }
  // A UDP datagram. What it causes to be sent waits for flush().
  void receive(const Path& path, std::uint8_t ecn, std::span<const std::uint8_t> packet, std::int64_t now_ns);
  // Runs the time-outs, and writes what connections have to send. Call it after all that a wake-up brings.
  void flush(std::int64_t now_ns);
  // When flush() is due at the latest; it may find nothing to do.
  [[nodiscard]] std::int64_t due_ns() const;
  // Whether a connection has something for flush().
  [[nodiscard]] bool has_work() const { return !dirty_.empty(); }
  // The server stops: packets of new clients are dropped from now on.
  void refuse_new() { is_closed_ = true; }
  // All connections, and those whose peer has not answered at its address yet.
  [[nodiscard]] std::size_t connection_count() const { return connections_.size(); }
  [[nodiscard]] std::size_t unverified_count() const { return unverified_count_; }

 private:
  // A connection ID as a key. IDs of clients are their choice: an ordered map has no collisions to attack.
  struct Id {
    std::array<std::uint8_t, NGTCP2_MAX_CIDLEN> bytes{};
    std::uint8_t count = 0;
    auto operator<=>(const Id&) const = default;
    static Id of(const std::uint8_t* bytes, std::size_t count);
  };

  // These functions implement ConnectionHost (server/quic/connection.hpp).
  void add_id(const ngtcp2_cid& id, Connection& connection) override;
  void remove_id(const ngtcp2_cid& id) override;
  void make_reset_token(const ngtcp2_cid& id, std::uint8_t* token) override;
  bool on_verified(Connection& connection, std::int64_t now_ns) override;
  std::vector<std::uint8_t> make_address_token(const Address& remote, std::int64_t now_ns) override;
  int on_request(Connection& connection, const http3::Request& request, std::int64_t now_ns) override;
  std::shared_ptr<SessionSink> on_session(Connection& connection, std::int64_t now_ns) override;
  void want_write(Connection& connection) override { dirty_.insert(&connection); }

  // Takes a packet of no known connection.
  void take_stranger(const Path& path, std::uint8_t ecn, std::span<const std::uint8_t> packet,
                     const ngtcp2_version_cid& header, std::int64_t now_ns);
  // none: there is no token, or one that proves nothing and harms nobody. wrong: the token is of a Retry, and forged,
  // too old or used before.
  enum class TokenCheck : std::uint8_t { none, verified, wrong };
  // Checks the token of a first packet. For a Retry token, `opening` gets the destination ID before the Retry.
  TokenCheck check_token(const ngtcp2_pkt_hd& header, Path path, Connection::Opening& opening,
                         std::int64_t now_ns) const;
  // A Retry token lets a client take a place before its handshake, so each token is accepted once: otherwise anyone who
  // has read it in the network could use it for a flood.
  void remember_used(const Id& retry, std::int64_t now_ns);
  // The next four answer a packet without a connection: a Retry, CONNECTION_CLOSE with this error, the versions that
  // this server speaks, and a stateless reset.
  void send_retry(const Path& path, const ngtcp2_pkt_hd& header, std::int64_t now_ns);
  void send_refusal(const Path& path, const ngtcp2_pkt_hd& header, std::uint64_t error);
  void negotiate_version(const Path& path, std::span<const std::uint8_t> packet, const ngtcp2_version_cid& header,
                         std::int64_t now_ns);
  // Answers a packet of no known connection, so that a client of a server that has died learns of it at once.
  void send_reset(const Path& path, std::span<const std::uint8_t> packet, const ngtcp2_version_cid& header,
                  std::int64_t now_ns);
  // Enters the connection's new time-out if it is earlier, or destroys a connection that is over.
  void settle(Connection& connection);

  EndpointOptions options_;
  std::shared_ptr<const Credentials> credentials_;
  Gate* gate_;
  QuicCounters* counters_;
  Outgoing out_;
  // The keys of tokens, random at each start, and of stateless resets, made of EndpointOptions::identity.
  std::array<std::uint8_t, 32> token_secret_{}, reset_secret_{};
  // Limits answers without a connection, since anyone can cause them in anyone's name.
  server::TokenBucket stateless_;
  // All connections, each with the time under which it stands in timers_.
  std::map<const Connection*, std::pair<std::unique_ptr<Connection>, std::int64_t>> connections_;
  std::map<Id, Connection*> by_id_;
  // The connections by the time at which they are due.
  std::set<std::pair<std::int64_t, Connection*>> timers_;
  // The connections that have something to send at the next flush().
  std::set<Connection*> dirty_;
  // The connection IDs of Retry tokens that were used, until the tokens expire: each token is accepted once.
  std::set<Id> used_retries_;
  // The IDs of used_retries_ in the order in which their tokens expire.
  std::deque<std::pair<std::int64_t, Id>> used_until_;
  std::size_t unverified_count_ = 0;
  // refuse_new() was called.
  bool is_closed_ = false;
};

}  // namespace hairnet::quic
