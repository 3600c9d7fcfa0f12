#include "server/transport/admission.hpp"

#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// The sweep over all addresses runs this often at most, unless the table is crowded.
constexpr std::int64_t kForgetInterval_ns = 1'000'000'000;

std::size_t index_of(Admission::Place place) {
  return static_cast<std::size_t>(place);
}

}  // namespace

// A moved-from shared_ptr is null, so the other ticket counts nothing any more.
Admission::Ticket::Ticket(Ticket&& other) noexcept
    : admission_(std::move(other.admission_)), address_(other.address_), place_(other.place_) {}

Admission::Ticket& Admission::Ticket::operator=(Ticket&& other) noexcept {
  if (this == &other) return *this;
  if (admission_) admission_->leave(address_, place_);
  admission_ = std::move(other.admission_);
  address_ = other.address_;
  place_ = other.place_;
  return *this;
}

Admission::Ticket::~Ticket() {
  if (admission_) admission_->leave(address_, place_);
}

bool Admission::Ticket::move_to(Place place) {
  if (!admission_ || place == place_) return true;
  // Sessions have no bound here: SessionLimits decide about them when their Hello has come.
  const std::size_t count = admission_->places_[index_of(place)];
  if (place == Place::http && count >= admission_->limits_.http_max) return false;
  if (place == Place::leaving && count >= kLeavingMax) return false;
  HAIRNET_ASSERT(admission_->places_[index_of(place_)] > 0);
  --admission_->places_[index_of(place_)];
  ++admission_->places_[index_of(place)];
  place_ = place;
  return true;
}

Admission::Verdict Admission::Ticket::set_address(std::uint64_t address, std::int64_t now_ns) {
  HAIRNET_ASSERT(admission_ && !address_);
  const Verdict verdict = admission_->enter_address(address, now_ns);
  if (verdict == Verdict::admitted) address_ = address;
  return verdict;
}

Admission::Admission(const AdmissionLimits& limits)
    : limits_(limits), rate_(limits.connections_per_s, limits.connections_burst, 0) {
  HAIRNET_ASSERT(limits.connections_burst >= 1 && limits.connections_per_address_burst >= 1);
}

Admission::Verdict Admission::enter(std::optional<std::uint64_t> address, std::int64_t now_ns, Ticket& ticket) {
  if (limits_.connections_max != 0 && count_ >= limits_.connections_max) return Verdict::full;
  // The bounds of all come before the rate of one address, so a refused connection takes no token of its address.
  if (places_[index_of(Place::arrival)] >= limits_.arrivals_max) return Verdict::arrivals_full;
  const Verdict verdict = address ? enter_address(*address, now_ns) : Verdict::admitted;
  if (verdict != Verdict::admitted) return verdict;
  Ticket entered;
  entered.admission_ = shared_from_this();
  entered.address_ = address;
  ++count_;
  // The total rate is charged later, in may_accept(): this connection is already here, and refusing it would save
  // nothing.
  ++unpaid_count_;
  ++places_[index_of(Place::arrival)];
  HAIRNET_ASSERT(count_ == places_[0] + places_[1] + places_[2] + places_[3]);
  ticket = std::move(entered);
  return Verdict::admitted;
}

Admission::Verdict Admission::enter_address(std::uint64_t address, std::int64_t now_ns) {
  forget_idle(now_ns);
  // A first connection starts with a full bucket. try_emplace() copies it only where the address is new.
  const TokenBucket full(limits_.connections_per_address_per_s, limits_.connections_per_address_burst, now_ns);
  Address& entry = addresses_.try_emplace(address, Address{0, full}).first->second;
  const std::size_t count_max = limits_.connections_per_address_max;
  if (count_max != 0 && entry.count >= count_max) return Verdict::address_full;
  if (!entry.arrivals.take(1, now_ns)) return Verdict::address_rate;
  ++entry.count;
  return Verdict::admitted;
}

bool Admission::may_accept(std::int64_t now_ns) {
  // Connections that came together are paid one by one; the listener pauses until the last one is paid.
  while (unpaid_count_ > 0 && rate_.take(1, now_ns)) --unpaid_count_;
  return unpaid_count_ == 0;
}

// Forgets the addresses without connections whose bucket is full again: a new entry would be the same.
void Admission::forget_idle(std::int64_t now_ns) {
  // An attacker with many addresses (each IPv6 /64 counts as one) must not fill the memory. A crowded table also drops
  // the idle addresses whose bucket is not full; they then begin with a full one.
  const bool is_crowded = addresses_.size() >= kIdleAddressesMax + count_;
  // A sweep costs time with the number of addresses, so it does not run at each connection.
  if (now_ns < forget_next_ns_ && !is_crowded) return;
  forget_next_ns_ = now_ns + kForgetInterval_ns;
  std::erase_if(addresses_, [&](const auto& entry) {
    const Address& address = entry.second;
    return address.count == 0 &&
           (is_crowded || TokenBucket(address.arrivals).take(limits_.connections_per_address_burst, now_ns));
  });
}

void Admission::leave(std::optional<std::uint64_t> address, Place place) {
  HAIRNET_ASSERT(count_ > 0);
  HAIRNET_ASSERT(places_[index_of(place)] > 0);
  --count_;
  --places_[index_of(place)];
  if (!address) return;
  const auto found = addresses_.find(*address);
  HAIRNET_ASSERT(found != addresses_.end());
  HAIRNET_ASSERT(found->second.count > 0);
  --found->second.count;
}

}  // namespace hairnet::server
