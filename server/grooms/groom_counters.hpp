#pragma once

#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"

namespace hairnet::server {

struct GroomGauges : GaugeSet {
  Gauge grooms{*this, "grooms", "Grooms known, from their offer on."};
  Gauge groom_upload_bytes{*this, "groom_upload_bytes", "Bytes of grooms received and not built yet."};
  Gauge groom_level_bytes{*this, "groom_level_bytes", "Bytes of all levels in memory."};
  Gauge grooms_waiting{*this, "grooms_waiting", "Grooms uploaded and not yet ready: queued or being built."};
};

struct GroomCounters : CounterSet {
  GroomGauges gauges;
  Counter grooms_offered{*this, "grooms_offered", "Offers of grooms by clients."};
  Counter grooms_shared{*this, "grooms_shared", "Offers of grooms that needed no upload."};
  Counter grooms_uploaded{*this, "grooms_uploaded", "Uploads of grooms that are complete."};
  Counter grooms_ready{*this, "grooms_ready", "Grooms whose levels became ready."};
  Counter grooms_evicted{*this, "grooms_evicted", "Grooms removed from memory, since it was needed."};
  Counter grooms_learnt{*this, "grooms_learnt", "Grooms whose hair was learnt."};
  Counter grooms_learnt_accepted{*this, "grooms_learnt_accepted", "Grooms whose files had learnt hair that is good."};
  Counter grooms_learnt_file_refused{*this, "grooms_learnt_file_refused",
                                     "Grooms whose files had learnt hair that is not good."};
  Counter grooms_learnt_refused{*this, "grooms_learnt_refused",
                                "Grooms whose learnt hair errs more than the low level."};
  Counter grooms_learnt_refused_in_wind{*this, "grooms_learnt_refused_in_wind",
                                        "Grooms whose learnt hair errs too much in wind, and in still air does not."};
  Counter grooms_refused_size{*this, "grooms_refused", "reason", "size", "Grooms refused, by reason."};
  Counter grooms_refused_limit{*this, "grooms_refused", "reason", "limit"};
  Counter grooms_refused_hash{*this, "grooms_refused", "reason", "hash"};
  Counter grooms_refused_invalid{*this, "grooms_refused", "reason", "invalid"};
  Counter builds_interrupted{*this, "builds_interrupted", "Builds that gave way to another client's, and begin again."};
  Counter grooms_refused_queue_full{*this, "grooms_refused", "reason", "queue_full"};
  Counter grooms_refused_stalled{*this, "grooms_refused", "reason", "stalled"};
  // All grooms of a session have too many strands together.
  Counter grooms_refused_strands{*this, "grooms_refused", "reason", "strands"};
  // The session has too many bytes to upload.
  Counter grooms_refused_rate{*this, "grooms_refused", "reason", "rate"};
  // The build takes longer than that of one groom may.
  Counter grooms_refused_build_time{*this, "grooms_refused", "reason", "build_time"};
  Counter grooms_refused_build_memory{*this, "grooms_refused", "reason", "build_memory"};
  Counter grooms_refused_build_crash{*this, "grooms_refused", "reason", "build_crash"};
  // The server failed at each try.
  Counter grooms_refused_server{*this, "grooms_refused", "reason", "server"};
  Counter builds_failed{*this, "builds_failed",
                        "Builds that failed by an error of the server, tried again or given up."};
  // Sessions use the groom, but none of them that is connected could upload it.
  Counter grooms_refused_absent{*this, "grooms_refused", "reason", "absent"};
  Counter groom_bytes_received{*this, "groom_bytes_received", "Bytes of grooms received."};
};

struct GroomCacheCounters : CounterSet {
  Counter groom_cache_hits{*this, "groom_cache_hits", "Grooms found in the cache of groom files."};
  Counter groom_cache_misses{*this, "groom_cache_misses", "Grooms not found in the cache of groom files."};
  Counter groom_cache_rejected_unreadable{*this, "groom_cache_rejected", "reason", "unreadable",
                                          "Files of the cache of grooms that were rejected and removed, by reason."};
  Counter groom_cache_rejected_damaged{*this, "groom_cache_rejected", "reason", "damaged"};
  Counter groom_cache_written{*this, "groom_cache_written", "Files written to the cache of grooms."};
  Counter groom_cache_writes_failed{*this, "groom_cache_writes_failed",
                                    "Files that could not be written to the cache of grooms."};
  Counter groom_cache_evicted{*this, "groom_cache_evicted", "Files removed from the cache of grooms to make room."};
};

struct LevelCacheCounters : CounterSet {
  Counter level_cache_hits{*this, "level_cache_hits", "Grooms whose levels were in the cache."};
  Counter level_cache_misses{*this, "level_cache_misses", "Grooms whose levels were not in the cache."};
  Counter level_cache_rejected_unreadable{
      *this, "level_cache_rejected", "reason", "unreadable",
      "Files of the cache of levels that were rejected and are built again, by reason."};
  Counter level_cache_rejected_format{*this, "level_cache_rejected", "reason", "format"};
  Counter level_cache_rejected_version{*this, "level_cache_rejected", "reason", "version"};
  Counter level_cache_rejected_groom{*this, "level_cache_rejected", "reason", "groom"};
  Counter level_cache_rejected_damaged{*this, "level_cache_rejected", "reason", "damaged"};
  Counter level_cache_rejected_invalid{*this, "level_cache_rejected", "reason", "invalid"};
  Counter level_cache_written{*this, "level_cache_written", "Files written to the cache of levels."};
  Counter level_cache_writes_failed{*this, "level_cache_writes_failed",
                                    "Files that could not be written to the cache of levels."};
  Counter level_cache_evicted{*this, "level_cache_evicted", "Files removed from the cache of levels to make room."};
};

}  // namespace hairnet::server
