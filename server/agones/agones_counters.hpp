#pragma once

#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"

namespace hairnet::server {

// Set by a server under Agones only.
struct AgonesGauges : GaugeSet {
  Gauge up{*this, "agones_up", "1 while the sidecar of Agones answers, else 0."};
  Gauge allocated{*this, "agones_allocated", "1 while Agones takes this server for one in use, else 0."};
};

struct AgonesCounters : CounterSet {
  AgonesGauges gauges;
  Counter requests{*this, "agones_requests", "Requests to the sidecar of Agones."};
  Counter requests_failed_unreachable{*this, "agones_requests_failed", "reason", "unreachable",
                                      "Requests to the sidecar of Agones that failed, by reason."};
  Counter requests_failed_timeout{*this, "agones_requests_failed", "reason", "timeout"};
  // The connection ended before the answer.
  Counter requests_failed_broken{*this, "agones_requests_failed", "reason", "broken"};
  // The sidecar answered with an error.
  Counter requests_failed_refused{*this, "agones_requests_failed", "reason", "refused"};
  Counter requests_failed_malformed{*this, "agones_requests_failed", "reason", "malformed"};
  Counter requests_failed_oversize{*this, "agones_requests_failed", "reason", "oversize"};
};

}  // namespace hairnet::server
