#pragma once

#include "server/room/counter.hpp"

namespace hairnet::server {

struct TickCounters : CounterSet {
  Counter ticks_run{*this, "ticks_run"};
  Counter ticks_late{*this, "ticks_late"};
  Counter ticks_skipped{*this, "ticks_skipped"};
  Counter tick_ns_total{*this, "tick_ns_total"};
  Counter tick_ns_max{*this, "tick_ns_max"};
  Counter characters_stepped{*this, "characters_stepped"};
  Counter characters_asleep{*this, "characters_asleep"};  // not stepped: at rest
  Counter teleports{*this, "teleports"};
  Counter lattices_reset{*this, "lattices_reset"};
  Counter levels_entered{*this, "levels_entered"};
  Counter frames_published{*this, "frames_published"};
  Counter level_records_sent{*this, "level_records_sent"};
  Counter frames_dropped{*this, "frames_dropped"};  // not finite: never sent
  Counter ticks_recorded{*this, "ticks_recorded"};
  Counter recordings_failed{*this, "recordings_failed"};
};

struct GroomCounters : CounterSet {
  Counter grooms_offered{*this, "grooms_offered"};
  Counter grooms_shared{*this, "grooms_shared"};  // offers that needed no upload
  Counter grooms_uploaded{*this, "grooms_uploaded"};
  Counter grooms_ready{*this, "grooms_ready"};
  Counter grooms_evicted{*this, "grooms_evicted"};
  Counter grooms_refused_size{*this, "grooms_refused_size"};
  Counter grooms_refused_limit{*this, "grooms_refused_limit"};
  Counter grooms_refused_hash{*this, "grooms_refused_hash"};
  Counter grooms_refused_invalid{*this, "grooms_refused_invalid"};
  Counter grooms_refused_queue_full{*this, "grooms_refused_queue_full"};
  Counter grooms_refused_stalled{*this, "grooms_refused_stalled"};
  Counter groom_bytes_received{*this, "groom_bytes_received"};
};

// Of files of levels; those rejected are built anew.
struct LevelCacheCounters : CounterSet {
  Counter level_cache_hits{*this, "level_cache_hits"};
  Counter level_cache_misses{*this, "level_cache_misses"};
  Counter level_cache_rejected_unreadable{*this, "level_cache_rejected_unreadable"};
  Counter level_cache_rejected_format{*this, "level_cache_rejected_format"};
  Counter level_cache_rejected_version{*this, "level_cache_rejected_version"};
  Counter level_cache_rejected_groom{*this, "level_cache_rejected_groom"};
  Counter level_cache_rejected_damaged{*this, "level_cache_rejected_damaged"};
  Counter level_cache_rejected_unsound{*this, "level_cache_rejected_unsound"};
  Counter level_cache_written{*this, "level_cache_written"};
  Counter level_cache_writes_failed{*this, "level_cache_writes_failed"};
  Counter level_cache_evicted{*this, "level_cache_evicted"};
};

}  // namespace hairnet::server
