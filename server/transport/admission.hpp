#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>

namespace hairnet::server {

struct AdmissionLimits {
  std::size_t connections_max = 0;              // 0: no bound
  std::size_t connections_per_address_max = 0;  // an IPv4 address, or an IPv6 network of 64 bits; 0: no bound
  std::size_t arrivals_max = 256;               // connections whose protocol is not known yet
  std::size_t http_max = 512;                   // connections that request pages
};

// Limits the number of connections, in all and by address, before they become sessions. I/O thread.
class Admission : public std::enable_shared_from_this<Admission> {
 public:
  enum class Verdict : std::uint8_t { admitted, full, address_full, arrivals_full };
  enum class Place : std::uint8_t { arrival, http, session };

  // Counts one connection for as long as the ticket lives.
  class Ticket {
   public:
    Ticket() = default;
    Ticket(Ticket&& other) noexcept;
    Ticket& operator=(Ticket&& other) noexcept;
    ~Ticket();
    // Counts the connection in `place` from now on. Returns false, and changes nothing, when there are too many of that
    // kind.
    bool move_to(Place place);

   private:
    friend class Admission;
    std::shared_ptr<Admission> admission_;
    std::uint64_t address_ = 0;
    Place place_ = Place::arrival;
  };

  explicit Admission(const AdmissionLimits& limits) : limits_(limits) {}
  // `address`: connections with the same number share one limit.
  Verdict enter(std::uint64_t address, Ticket& ticket);
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  void leave(std::uint64_t address, Place place);

  AdmissionLimits limits_;
  std::size_t count_ = 0;
  std::size_t places_[3] = {};
  std::unordered_map<std::uint64_t, std::size_t> addresses_;
};

}  // namespace hairnet::server
