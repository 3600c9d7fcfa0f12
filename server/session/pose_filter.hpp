#pragma once

#include "schema/wire/messages.hpp"
#include "server/exchange/groom_service.hpp"
#include "server/session/peer_clock.hpp"
#include "server/session/session_counters.hpp"
#include "server/session/session_directory.hpp"

namespace hairnet::server {

// Decides which poses and hands of a session go on to the tick, and counts the others. It converts the client's capture
// times to the server's clock, since the tick knows no client's clock. A PoseFilter exists for one packet. I/O thread.
struct PoseFilter {
  SessionIdentity& identity;
  const PeerClock& clock;
  SessionCounters& counters;

  // A batch also repeats earlier poses, since the datagram that had them may have got lost. Puts those of them that
  // have not come before in front of the batch's own poses. The others are dropped, and do not count against the
  // client's rate.
  void add_missing(wire::PoseBatch& batch);
  // Returns why the pose is refused; otherwise converts its capture time to the server's clock, and takes note of its
  // sequence.
  [[nodiscard]] Refused check(wire::PoseSample& sample);
  // Does the same for hands, but leaves their sequence to the tick.
  [[nodiscard]] Refused check(wire::HandsSample& sample);
  // True when the pose, which has passed check(), is left out because it was captured too close to the character's last
  // one. The next pose then has its teleport.
  [[nodiscard]] bool is_too_close(wire::PoseSample& sample);
};

}  // namespace hairnet::server
