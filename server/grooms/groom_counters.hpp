#pragma once

#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"

namespace hairnet::server {

struct GroomGauges : GaugeSet {
  Gauge grooms{*this, "grooms"};
  Gauge groom_upload_bytes{*this, "groom_upload_bytes"};  // received, and not built yet
  Gauge groom_level_bytes{*this, "groom_level_bytes"};    // of all levels in memory
  Gauge grooms_waiting{*this, "grooms_waiting"};          // uploaded, and not yet ready: queued or being built
};

struct GroomCounters : CounterSet {
  GroomGauges gauges;
  Counter grooms_offered{*this, "grooms_offered"};
  Counter grooms_shared{*this, "grooms_shared"};  // offers that needed no upload
  Counter grooms_uploaded{*this, "grooms_uploaded"};
  Counter grooms_ready{*this, "grooms_ready"};
  Counter grooms_evicted{*this, "grooms_evicted"};
  Counter grooms_learnt{*this, "grooms_learnt"};
  Counter grooms_learnt_adopted{*this, "grooms_learnt_adopted"};  // of them, whose files had learnt hair that is good
  Counter grooms_learnt_file_refused{*this, "grooms_learnt_file_refused"};  // whose files had some that is not
  Counter grooms_learnt_refused{*this, "grooms_learnt_refused"};            // the network errs more than the low level
  Counter grooms_learnt_refused_in_wind{*this, "grooms_learnt_refused_in_wind"};  // and in still air it does not
  Counter grooms_refused_size{*this, "grooms_refused", "reason", "size"};
  Counter grooms_refused_limit{*this, "grooms_refused", "reason", "limit"};
  Counter grooms_refused_hash{*this, "grooms_refused", "reason", "hash"};
  Counter grooms_refused_invalid{*this, "grooms_refused", "reason", "invalid"};
  Counter builds_interrupted{*this, "builds_interrupted"};  // they gave way, and begin again
  Counter grooms_refused_queue_full{*this, "grooms_refused", "reason", "queue_full"};
  Counter grooms_refused_stalled{*this, "grooms_refused", "reason", "stalled"};
  Counter grooms_refused_strands{*this, "grooms_refused", "reason", "strands"};  // too many in all grooms of a session
  Counter grooms_refused_rate{*this, "grooms_refused", "reason", "rate"};        // of bytes to upload
  Counter grooms_refused_build_time{*this, "grooms_refused", "reason", "build_time"};  // beyond that of one groom
  Counter grooms_refused_build_memory{*this, "grooms_refused", "reason", "build_memory"};
  Counter grooms_refused_build_crash{*this, "grooms_refused", "reason", "build_crash"};
  Counter grooms_refused_absent{*this, "grooms_refused", "reason", "absent"};  // used, but nobody there could upload it
  Counter groom_bytes_received{*this, "groom_bytes_received"};
};

// Of groom files; those rejected are removed and uploaded again.
struct GroomCacheCounters : CounterSet {
  Counter groom_cache_hits{*this, "groom_cache_hits"};
  Counter groom_cache_misses{*this, "groom_cache_misses"};
  Counter groom_cache_rejected_unreadable{*this, "groom_cache_rejected", "reason", "unreadable"};
  Counter groom_cache_rejected_damaged{*this, "groom_cache_rejected", "reason", "damaged"};
  Counter groom_cache_written{*this, "groom_cache_written"};
  Counter groom_cache_writes_failed{*this, "groom_cache_writes_failed"};
  Counter groom_cache_evicted{*this, "groom_cache_evicted"};
};

// Level files on disk. A rejected file is built again.
struct LevelCacheCounters : CounterSet {
  Counter level_cache_hits{*this, "level_cache_hits"};
  Counter level_cache_misses{*this, "level_cache_misses"};
  Counter level_cache_rejected_unreadable{*this, "level_cache_rejected", "reason", "unreadable"};
  Counter level_cache_rejected_format{*this, "level_cache_rejected", "reason", "format"};
  Counter level_cache_rejected_version{*this, "level_cache_rejected", "reason", "version"};
  Counter level_cache_rejected_groom{*this, "level_cache_rejected", "reason", "groom"};
  Counter level_cache_rejected_damaged{*this, "level_cache_rejected", "reason", "damaged"};
  Counter level_cache_rejected_unsound{*this, "level_cache_rejected", "reason", "unsound"};
  Counter level_cache_written{*this, "level_cache_written"};
  Counter level_cache_writes_failed{*this, "level_cache_writes_failed"};
  Counter level_cache_evicted{*this, "level_cache_evicted"};
};

}  // namespace hairnet::server
