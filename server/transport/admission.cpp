#include "server/transport/admission.hpp"

#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

std::size_t index_of(Admission::Place place) {
  return static_cast<std::size_t>(place);
}

}  // namespace

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
  if (place == Place::http && admission_->places_[index_of(place)] >= admission_->limits_.http_max) return false;
  HAIRNET_ASSERT(admission_->places_[index_of(place_)] > 0);
  --admission_->places_[index_of(place_)];
  ++admission_->places_[index_of(place)];
  place_ = place;
  return true;
}

Admission::Verdict Admission::enter(std::uint64_t address, Ticket& ticket) {
  if (limits_.connections_max != 0 && count_ >= limits_.connections_max) return Verdict::full;
  if (places_[index_of(Place::arrival)] >= limits_.arrivals_max) return Verdict::arrivals_full;
  const std::size_t of_address_max = limits_.connections_per_address_max;
  if (const auto found = addresses_.find(address);
      of_address_max != 0 && found != addresses_.end() && found->second >= of_address_max)
    return Verdict::address_full;
  Ticket entered;
  entered.admission_ = shared_from_this();
  entered.address_ = address;
  ++addresses_[address];
  ++count_;
  ++places_[index_of(Place::arrival)];
  HAIRNET_ASSERT(count_ == places_[0] + places_[1] + places_[2]);
  ticket = std::move(entered);
  return Verdict::admitted;
}

void Admission::leave(std::uint64_t address, Place place) {
  HAIRNET_ASSERT(count_ > 0);
  HAIRNET_ASSERT(places_[index_of(place)] > 0);
  --count_;
  --places_[index_of(place)];
  const auto found = addresses_.find(address);
  HAIRNET_ASSERT(found != addresses_.end());
  if (--found->second == 0) addresses_.erase(found);
}

}  // namespace hairnet::server
