#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>

#include "server/threading/token_bucket.hpp"

namespace hairnet::server {

// An address is an IPv4 address, or an IPv6 network of 64 bits.
struct AdmissionLimits {
  // Bounds all connections together; zero: there is no bound.
  std::size_t connections_max = 0;
  // Bounds the connections of one address; zero: there is no bound. People behind one NAT share an address.
  std::size_t connections_per_address_max = 64;
  // Bounds the connections whose protocol is not known yet. They cost memory and handshakes before anybody knows who
  // they are.
  std::size_t arrivals_max = 256;
  // Bounds the connections that request pages, so that downloads of pages leave room for sessions.
  std::size_t http_max = 512;
  // New connections of all addresses: their mean rate, and how many may come at once.
  double connections_per_s = 500;
  double connections_burst = 1000;
  // New connections of one address: their mean rate, and how many may come at once.
  double connections_per_address_per_s = 20;
  double connections_per_address_burst = 200;
};

// Limits the number of connections and the rate of new ones, in all and by address, before they become sessions. I/O
// thread.
class Admission : public std::enable_shared_from_this<Admission> {
 public:
  // Why a connection is refused: too many in all, too many of its address, too many new ones of its address in a short
  // time, or too many whose protocol is not known.
  enum class Verdict : std::uint8_t { admitted, full, address_full, address_rate, arrivals_full };
  // A connection is in one place at a time, and moves forward: from an arrival to HTTP or a session, and from there
  // perhaps to leaving. Each place except `session` has a bound of its own.
  enum class Place : std::uint8_t { arrival, http, session, leaving };

  // At most this many connections that never joined wait for their peer to read the last bytes.
  static constexpr std::size_t kLeavingMax = 64;
  // At most this many addresses without a connection are remembered, so that a reconnect does not refill their bucket.
  static constexpr std::size_t kIdleAddressesMax = 65'536;

  // Counts one connection for as long as the ticket lives. The destructor ends the count, so no path through a
  // connection's code can forget to.
  class Ticket {
   public:
    Ticket() = default;
    Ticket(Ticket&& other) noexcept;
    Ticket& operator=(Ticket&& other) noexcept;
    ~Ticket();
    // Counts the connection in `place` from now on. Returns false, and changes nothing, when there are too many of that
    // kind.
    bool move_to(Place place);
    // Whether the limits of one address apply.
    [[nodiscard]] bool has_address() const { return address_.has_value(); }
    // Counts a connection without an address as one of `address` from now on, unless the verdict is a refusal.
    Verdict set_address(std::uint64_t address, std::int64_t now_ns);

   private:
    friend class Admission;
    // Null: the ticket counts nothing. The pointer keeps Admission alive after its listener has gone.
    std::shared_ptr<Admission> admission_;
    std::optional<std::uint64_t> address_;
    Place place_ = Place::arrival;
  };

  explicit Admission(const AdmissionLimits& limits);
  // `address`: connections with the same number share the limits of one address. None: those limits do not apply.
  Verdict enter(std::optional<std::uint64_t> address, std::int64_t now_ns, Ticket& ticket);
  // False when more connections were admitted than the total rate allows: accept no more for now. Refused connections
  // do not count, so one address cannot use up the rate of all.
  bool may_accept(std::int64_t now_ns);
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::size_t address_count() const { return addresses_.size(); }

 private:
  // One address, also for a while after its last connection has ended: its bucket must not fill at once by a reconnect.
  struct Address {
    std::size_t count = 0;
    TokenBucket arrivals;
  };

  // Counts one more connection of the address, unless the verdict is a refusal.
  Verdict enter_address(std::uint64_t address, std::int64_t now_ns);
  // Forgets addresses without a connection whose bucket is full again. A crowded table drops all addresses without a
  // connection.
  void forget_idle(std::int64_t now_ns);
  // A ticket ends: its connection does not count any more.
  void leave(std::optional<std::uint64_t> address, Place place);

  AdmissionLimits limits_;
  std::size_t count_ = 0;
  // The number of connections in each Place; their sum is count_.
  std::size_t places_[4] = {};
  std::unordered_map<std::uint64_t, Address> addresses_;
  // forget_idle() is due at this time.
  std::int64_t forget_next_ns_ = 0;
  // The bucket of new connections of all addresses.
  TokenBucket rate_;
  // Connections that were admitted and not yet taken from rate_; may_accept() takes them.
  std::size_t unpaid_count_ = 0;
};

}  // namespace hairnet::server
