#pragma once

#include "server/telemetry/counter.hpp"

namespace hairnet::server {

struct RoomCounters : CounterSet {
  Counter rooms_opened{*this, "rooms_opened"};
  Counter rooms_closed{*this, "rooms_closed"};
  Counter poses_accepted{*this, "poses_accepted"};
  Counter poses_rejected_stale{*this, "poses_rejected_stale"};  // captured more than 1 s ago
  Counter poses_rejected_out_of_order{
      *this, "poses_rejected_out_of_order"};  // not newer than one already there, by sequence or capture time
  Counter poses_rejected_future{*this, "poses_rejected_future"};    // captured more than 1 s from now
  Counter poses_rejected_unknown{*this, "poses_rejected_unknown"};  // the character was removed while the pose waited
  Counter poses_stale{*this, "poses_stale"};                        // samples beyond the longest extrapolation
  Counter poses_extrapolated{*this, "poses_extrapolated"};          // samples beyond the newest pose
};

}  // namespace hairnet::server
