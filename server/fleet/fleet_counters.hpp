#pragma once

#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"

namespace hairnet::server {

// Set by a server with a fleet only.
struct FleetGauges : GaugeSet {
  Gauge etcd_up{*this, "etcd_up", "1 while an endpoint of etcd answers, else 0."};
  Gauge lease_valid{*this, "fleet_lease_valid", "1 while the lease lets rooms run, else 0."};
  Gauge servers{*this, "fleet_servers", "Servers of the fleet that this server knows, with itself."};
  Gauge rooms{*this, "fleet_rooms", "Rooms of all servers of the fleet."};
  Gauge rooms_owned{*this, "fleet_rooms_owned", "Rooms of the fleet that this server owns."};
  Gauge has_big_room{*this, "fleet_has_big_room", "1 while this server has a room that needs a server alone, else 0."};
  Gauge room_overloaded{*this, "fleet_room_overloaded",
                        "1 while not even this server is enough for its largest room, else 0."};
};

struct FleetCounters : CounterSet {
  FleetGauges gauges;
  Counter claims{*this, "fleet_claims", "Claims of rooms that this server won, also again after a lost lease."};
  Counter claims_lost{*this, "fleet_claims_lost", "Claims of rooms that another server won."};
  Counter claims_refused_name{*this, "fleet_claims_refused", "reason", "name",
                              "Claims of rooms that this server did not make or gave up, by reason."};
  Counter claims_refused_full{*this, "fleet_claims_refused", "reason", "full"};
  Counter claims_refused_draining{*this, "fleet_claims_refused", "reason", "draining"};
  // The claim was given up, because etcd did not answer.
  Counter claims_refused_unreachable{*this, "fleet_claims_refused", "reason", "unreachable"};
  Counter rooms_lost{*this, "fleet_rooms_lost", "Rooms that this server owned and lost."};
  Counter rooms_released{*this, "fleet_rooms_released", "Rooms that this server gave up."};
  Counter rooms_handed_over{*this, "fleet_rooms_handed_over", "Rooms given up for a server with more free time."};
  Counter rooms_kept{*this, "fleet_rooms_kept", "Writes of what moves with a room."};
  Counter leases_granted{*this, "fleet_leases_granted", "Leases that etcd granted."};
  Counter leases_lost{*this, "fleet_leases_lost", "Leases that were gone at etcd."};
  Counter leases_paused{*this, "fleet_leases_paused", "Times at which the lease ran out here, so that rooms paused."};
  Counter outages_bridged{*this, "fleet_outages_bridged",
                          "Extensions of the lease without etcd (fleet.without_etcd = go_on)."};
  Counter requests{*this, "etcd_requests", "Requests to etcd."};
  Counter requests_failed_unreachable{*this, "etcd_requests_failed", "reason", "unreachable",
                                      "Requests to etcd that failed, by reason."};
  Counter requests_failed_timeout{*this, "etcd_requests_failed", "reason", "timeout"};
  // The connection ended before the answer.
  Counter requests_failed_broken{*this, "etcd_requests_failed", "reason", "broken"};
  // etcd answered with an error.
  Counter requests_failed_refused{*this, "etcd_requests_failed", "reason", "refused"};
  Counter requests_failed_malformed{*this, "etcd_requests_failed", "reason", "malformed"};
  Counter requests_failed_oversize{*this, "etcd_requests_failed", "reason", "oversize"};
  Counter room_answers_held{*this, "fleet_room_answers", "state", "held",
                            "Answers of /room, by the state of the room."};
  Counter room_answers_placed{*this, "fleet_room_answers", "state", "placed"};
  Counter room_answers_draining{*this, "fleet_room_answers", "state", "draining"};
  Counter room_answers_deciding{*this, "fleet_room_answers", "state", "deciding"};
  Counter room_answers_full{*this, "fleet_room_answers", "state", "full"};
  Counter room_answers_unknown{*this, "fleet_room_answers", "state", "unknown"};
  Counter room_answers_refused_name{*this, "fleet_room_answers_refused", "reason", "name",
                                    "Requests of /room that were refused, by reason."};
  Counter room_answers_refused_token{*this, "fleet_room_answers_refused", "reason", "token"};
  Counter lists{*this, "fleet_lists", "Lists of all servers and rooms, at the start and after a compaction of etcd."};
  Counter watches{*this, "fleet_watches", "Watches of etcd that were begun."};
  Counter entries_refused_malformed{*this, "fleet_entries_refused", "reason", "malformed",
                                    "Entries of etcd that this server did not take, by reason."};
  Counter entries_refused_oversize{*this, "fleet_entries_refused", "reason", "oversize"};
  Counter entries_refused_full{*this, "fleet_entries_refused", "reason", "full"};
};

}  // namespace hairnet::server
