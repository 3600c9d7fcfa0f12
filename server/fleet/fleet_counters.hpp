#pragma once

#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"

namespace hairnet::server {

// Set by a server with a fleet only.
struct FleetGauges : GaugeSet {
  Gauge etcd_up{*this, "etcd_up"};                    // 1 while an endpoint answers
  Gauge lease_valid{*this, "fleet_lease_valid"};      // 1 while the fence is open: rooms may run
  Gauge servers{*this, "fleet_servers"};              // that this server knows, with itself
  Gauge rooms{*this, "fleet_rooms"};                  // of all servers
  Gauge rooms_owned{*this, "fleet_rooms_owned"};      // by this server
  Gauge has_big_room{*this, "fleet_has_big_room"};    // 1: one that needs this server alone
  Gauge room_outgrown{*this, "fleet_room_outgrown"};  // 1: not even this server is enough for its largest room
};

struct FleetCounters : CounterSet {
  FleetGauges gauges;
  Counter claims{*this, "fleet_claims"};            // that were won, also again after a lost lease
  Counter claims_lost{*this, "fleet_claims_lost"};  // another server was first
  Counter claims_refused_name{*this, "fleet_claims_refused", "reason", "name"};
  Counter claims_refused_full{*this, "fleet_claims_refused", "reason", "full"};
  Counter claims_refused_draining{*this, "fleet_claims_refused", "reason", "draining"};
  Counter claims_refused_unreachable{*this, "fleet_claims_refused", "reason", "unreachable"};  // gave up
  Counter rooms_lost{*this, "fleet_rooms_lost"};                                               // that this server owned
  Counter rooms_released{*this, "fleet_rooms_released"};
  Counter rooms_handed_over{*this, "fleet_rooms_handed_over"};  // of these, for a server with more free time
  Counter rooms_kept{*this, "fleet_rooms_kept"};                // written: what moves with a room
  Counter leases_granted{*this, "fleet_leases_granted"};
  Counter leases_lost{*this, "fleet_leases_lost"};          // gone at etcd
  Counter leases_paused{*this, "fleet_leases_paused"};      // the fence closed
  Counter outages_bridged{*this, "fleet_outages_bridged"};  // the fence was moved without etcd (without_etcd = go_on)
  Counter requests{*this, "etcd_requests"};
  Counter requests_failed_unreachable{*this, "etcd_requests_failed", "reason", "unreachable"};
  Counter requests_failed_timeout{*this, "etcd_requests_failed", "reason", "timeout"};
  Counter requests_failed_broken{*this, "etcd_requests_failed", "reason", "broken"};    // the connection ended
  Counter requests_failed_refused{*this, "etcd_requests_failed", "reason", "refused"};  // etcd answered with an error
  Counter requests_failed_malformed{*this, "etcd_requests_failed", "reason", "malformed"};
  Counter requests_failed_oversize{*this, "etcd_requests_failed", "reason", "oversize"};
  Counter room_answers_held{*this, "fleet_room_answers", "state", "held"};  // of /room
  Counter room_answers_placed{*this, "fleet_room_answers", "state", "placed"};
  Counter room_answers_draining{*this, "fleet_room_answers", "state", "draining"};
  Counter room_answers_deciding{*this, "fleet_room_answers", "state", "deciding"};
  Counter room_answers_full{*this, "fleet_room_answers", "state", "full"};
  Counter room_answers_unknown{*this, "fleet_room_answers", "state", "unknown"};
  Counter room_answers_refused_name{*this, "fleet_room_answers_refused", "reason", "name"};
  Counter room_answers_refused_token{*this, "fleet_room_answers_refused", "reason", "token"};
  Counter lists{*this, "fleet_lists"};      // of all servers and rooms, at the start and after a compaction
  Counter watches{*this, "fleet_watches"};  // begun
  Counter entries_refused_malformed{*this, "fleet_entries_refused", "reason", "malformed"};
  Counter entries_refused_oversize{*this, "fleet_entries_refused", "reason", "oversize"};
  Counter entries_refused_full{*this, "fleet_entries_refused", "reason", "full"};
};

}  // namespace hairnet::server
