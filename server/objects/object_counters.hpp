#pragma once

#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"

namespace hairnet::server {

// Set by a server with an object store only.
struct ObjectGauges : GaugeSet {
  Gauge object_store_up{*this, "object_store_up",
                        "1 while the last call of the object store was answered as it should be, else 0."};
  Gauge puts_waiting{*this, "object_puts_waiting", "Files that wait to be put into the object store."};
};

struct ObjectCounters : CounterSet {
  ObjectGauges gauges;
  Counter read_groom{*this, "objects_read", "kind", "groom", "Files read from the object store, by kind."};
  Counter read_levels{*this, "objects_read", "kind", "levels"};
  Counter absent_groom{*this, "objects_absent", "kind", "groom", "Files that the object store did not have, by kind."};
  Counter absent_levels{*this, "objects_absent", "kind", "levels"};
  Counter stored_groom{*this, "objects_stored", "kind", "groom", "Files put into the object store, by kind."};
  Counter stored_levels{*this, "objects_stored", "kind", "levels"};
  Counter kept_groom{*this, "objects_kept", "kind", "groom",
                     "Files to put that the object store had already, by kind."};
  Counter kept_levels{*this, "objects_kept", "kind", "levels"};
  // The bytes are no groom of the hash in the name.
  Counter rejected_hash{*this, "objects_rejected", "reason", "hash",
                        "Files of the object store that are not valid, by reason."};
  // The levels are not valid, or of another build.
  Counter rejected_levels{*this, "objects_rejected", "reason", "levels"};
  Counter rejected_size{*this, "objects_rejected", "reason", "size"};
  Counter bytes_read{*this, "object_bytes_read", "Bytes read from the object store."};
  Counter bytes_stored{*this, "object_bytes_stored", "Bytes put into the object store."};
  // Too many files wait to be put.
  Counter puts_dropped_full{*this, "object_puts_dropped", "reason", "full",
                            "Files that were not put into the object store, by reason."};
  // The folder has lost the file since it was queued.
  Counter puts_dropped_absent{*this, "object_puts_dropped", "reason", "absent"};
  Counter puts_dropped_refused{*this, "object_puts_dropped", "reason", "refused"};
  Counter finds_skipped{*this, "object_finds_skipped",
                        "Grooms whose upload was asked for at once, since too many wait for the object store."};
  Counter requests{*this, "object_requests", "Requests to the object store."};
  Counter requests_skipped{*this, "object_requests_skipped",
                           "Requests left out, since the object store is left alone after a failure."};
  Counter requests_failed_unreachable{*this, "object_requests_failed", "reason", "unreachable",
                                      "Requests to the object store that failed, by reason."};
  Counter requests_failed_timeout{*this, "object_requests_failed", "reason", "timeout"};
  // The connection ended before the answer.
  Counter requests_failed_broken{*this, "object_requests_failed", "reason", "broken"};
  Counter requests_failed_malformed{*this, "object_requests_failed", "reason", "malformed"};
  // The status was 5xx or 429.
  Counter requests_failed_error{*this, "object_requests_failed", "reason", "error"};
  // The status was 401 or 403.
  Counter requests_failed_denied{*this, "object_requests_failed", "reason", "denied"};
  // The status was 3xx.
  Counter requests_failed_redirected{*this, "object_requests_failed", "reason", "redirected"};
  // The answer was any other one.
  Counter requests_failed_refused{*this, "object_requests_failed", "reason", "refused"};
};

}  // namespace hairnet::server
