#pragma once

#include "server/telemetry/counter.hpp"

namespace hairnet::server {

struct RoomCounters : CounterSet {
  Counter rooms_opened{*this, "rooms_opened", "Rooms opened."};
  Counter rooms_closed{*this, "rooms_closed", "Rooms closed."};
  Counter poses_accepted{*this, "poses_accepted", "Poses that entered the inboxes of their characters."};
  // The pose was captured more than PoseInbox::kAgeMax_ns ago.
  Counter poses_rejected_stale{*this, "poses_rejected", "reason", "stale"};
  // The pose is not newer than one already there, by sequence or capture time.
  Counter poses_rejected_out_of_order{*this, "poses_rejected", "reason", "out_of_order"};
  // The pose claims to be captured more than PoseInbox::kLeadMax_ns from now.
  Counter poses_rejected_future{*this, "poses_rejected", "reason", "future"};
  // The character was removed while the pose waited.
  Counter poses_rejected_unknown{*this, "poses_rejected", "reason", "unknown"};
  Counter hands_accepted{*this, "hands_accepted", "Samples of hands that entered the inboxes of their sessions."};
  // The reasons are those of poses. Unknown: the session had ended while the hands waited.
  Counter hands_rejected_stale{*this, "hands_rejected", "reason", "stale"};
  Counter hands_rejected_out_of_order{*this, "hands_rejected", "reason", "out_of_order"};
  Counter hands_rejected_future{*this, "hands_rejected", "reason", "future"};
  Counter hands_rejected_unknown{*this, "hands_rejected", "reason", "unknown"};
  Counter poses_stale{*this, "poses_stale", "Samples of poses beyond the longest extrapolation."};
  Counter poses_extrapolated{*this, "poses_extrapolated", "Samples of poses beyond the newest pose."};
};

}  // namespace hairnet::server
