#include "client/link/requested_wind.hpp"

#include <utility>

namespace hairnet::link {

void RequestedWind::set(const wire::SetWind& wind) {
  wind_ = wind;
  is_unconfirmed_ = true;
}

const wire::SetWind* RequestedWind::on_welcome(bool may_set) {
  is_first_due_ = true;
  may_set_ = may_set;
  return is_unconfirmed_ && wind_ && may_set ? &*wind_ : nullptr;
}

const wire::SetWind* RequestedWind::on_announced(const wire::RoomWind& announced, std::uint64_t own_session) {
  const bool is_first = std::exchange(is_first_due_, false);
  // This announcement was sent before our wind reached the server, which is on its way.
  if (is_first && is_unconfirmed_) return nullptr;
  is_unconfirmed_ = false;
  const bool is_ours = announced.session == own_session;
  // Another client has set the wind since, and the last one wins: sending ours again would undo it.
  if (announced.session != 0 && !is_ours) wind_.reset();
  if (is_ours && !wind_) wind_ = wire::SetWind{announced.wind};
  return is_first && wind_ && may_set_ ? &*wind_ : nullptr;
}

}  // namespace hairnet::link
