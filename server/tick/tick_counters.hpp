#pragma once

#include <atomic>
#include <cstdint>

#include "core/levels/level.hpp"
#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"
#include "server/telemetry/histogram.hpp"

namespace hairnet::server {

// Values of the last tick; some are updated once a second only.
struct TickGauges : GaugeSet {
  Gauge tick_period_seconds{*this, "tick_period_seconds"};  // period of a tick
  Gauge commands_waiting{*this, "commands_waiting"};        // commands and poses on their way to the tick
  Gauge rooms{*this, "rooms"};
  Gauge characters_at_high{*this, "characters_at_high"};  // by the level of the lattice, asleep or not
  Gauge characters_at_medium{*this, "characters_at_medium"};
  Gauge characters_at_low{*this, "characters_at_low"};
  Gauge characters_at_ether{*this, "characters_at_ether"};
  Gauge characters_at_rigid{*this, "characters_at_rigid"};
  Gauge characters_in_state_stepped{*this, "characters_in_state_stepped"};
  Gauge characters_in_state_asleep{*this, "characters_in_state_asleep"};  // at rest
  Gauge characters_in_state_suspended{*this,
                                      "characters_in_state_suspended"};     // not stepped, since no observer sees them
  Gauge characters_in_state_waiting{*this, "characters_in_state_waiting"};  // for their first pose
  Gauge step_cost_seconds_at_high{*this, "step_cost_seconds_at_high"};      // of one character's step, measured
  Gauge step_cost_seconds_at_medium{*this, "step_cost_seconds_at_medium"};
  Gauge step_cost_seconds_at_low{*this, "step_cost_seconds_at_low"};
  Gauge step_cost_seconds_at_ether{*this, "step_cost_seconds_at_ether"};
  Gauge step_cost_seconds_at_rigid{*this, "step_cost_seconds_at_rigid"};
  Gauge budget_available_seconds{*this, "budget_available_seconds"};  // worker-seconds a tick, measured on real ticks
  // worker-seconds a tick that the current levels take
  Gauge budget_predicted_seconds{*this, "budget_predicted_seconds"};
  // worker-seconds a tick that the finest levels would take
  Gauge budget_wanted_seconds{*this, "budget_wanted_seconds"};
  Gauge budget_over{*this, "budget_over"};                          // 1: not even rung 0 of all characters fits
  Gauge characters_below_wanted{*this, "characters_below_wanted"};  // seen, and coarser than their owners asked for
  void set_step_cost(LevelIndex level, double seconds) {
    Gauge* const of[] = {&step_cost_seconds_at_high, &step_cost_seconds_at_medium, &step_cost_seconds_at_low,
                         &step_cost_seconds_at_ether, &step_cost_seconds_at_rigid};
    of[static_cast<std::size_t>(level)]->set(seconds);
  }
  std::atomic<std::int64_t> last_tick_ns{0};  // when the newest tick ended; 0: none yet
};

struct TickHistograms : HistogramSet {
  Histogram tick_seconds{*this,
                         "tick_seconds",
                         {0.0005, 0.001, 0.002, 0.004, 0.006, 0.008, 0.011, 0.016, 0.022, 0.033, 0.05, 0.1, 0.25, 1}};
  // Duration over the tick's period; above 1 is an overrun.
  Histogram tick_period_used_ratio{
      *this, "tick_period_used_ratio", {0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1.5, 2, 4, 8}};
  // From the newest pose's capture to the tick, for each character that gets poses: none older than a second counts.
  Histogram pose_age_seconds{
      *this, "pose_age_seconds", {0.005, 0.01, 0.015, 0.02, 0.025, 0.03, 0.04, 0.05, 0.075, 0.1, 0.15, 0.25, 0.5, 1}};
};

struct TickCounters : CounterSet {
  TickGauges gauges;
  TickHistograms histograms;
  Counter ticks_run{*this, "ticks_run"};
  Counter ticks_late{*this, "ticks_late"};
  Counter ticks_skipped{*this, "ticks_skipped"};
  Counter ticks_overrun{*this, "ticks_overrun"};  // took longer than their period
  Counter tick_ns_total{*this, "tick_ns_total"};
  Counter tick_ns_max{*this, "tick_ns_max"};
  Counter characters_stepped{*this, "characters_stepped"};
  Counter characters_asleep{*this, "characters_asleep"};  // not stepped: at rest
  Counter teleports{*this, "teleports"};
  Counter lattices_reset{*this, "lattices_reset"};
  // Worker time in ns: stepping; encoding frames; choosing and making each observer's packets.
  Counter step_ns_total{*this, "step_ns_total"};
  Counter encode_ns_total{*this, "encode_ns_total"};
  Counter send_ns_total{*this, "send_ns_total"};
  Counter schedule_ns_total{*this, "schedule_ns_total"};  // of the tick thread, before the step
  Counter levels_raised{*this, "levels_raised"};          // or strides shortened
  Counter levels_lowered{*this, "levels_lowered"};
  Counter levels_entered{*this, "levels_entered"};
  Counter frames_published{*this, "frames_published"};
  Counter frames_encoded{*this, "frames_encoded"};  // codings made; several observers share one
  Counter frame_bytes_published{*this, "frame_bytes_published"};
  Counter observers_congested{*this, "observers_congested"};  // frames of several ticks were dropped for one
  // sent for a level that the character does not have
  Counter hair_states_dropped_unfit{*this, "hair_states_dropped_unfit"};
  Counter hair_states_dropped_full{*this, "hair_states_dropped_full"};
  Counter level_records_sent{*this, "level_records_sent"};
  Counter frames_dropped{*this, "frames_dropped"};  // not finite: never sent
  Counter ticks_recorded{*this, "ticks_recorded"};
  Counter recordings_failed{*this, "recordings_failed"};
};

struct GroomGauges : GaugeSet {
  Gauge grooms{*this, "grooms"};
  Gauge groom_upload_bytes{*this, "groom_upload_bytes"};  // of unfinished uploads, as announced
  Gauge groom_level_bytes{*this, "groom_level_bytes"};    // of all levels in memory
  Gauge grooms_waiting{*this, "grooms_waiting"};          // uploaded, and queued or being built
};

struct GroomCounters : CounterSet {
  GroomGauges gauges;
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
  Counter grooms_refused_strands{*this, "grooms_refused_strands"};        // too many in all grooms of a session
  Counter grooms_refused_rate{*this, "grooms_refused_rate"};              // too many bytes announced to upload
  Counter grooms_refused_build_time{*this, "grooms_refused_build_time"};  // the build of one groom took too long
  Counter grooms_refused_absent{*this, "grooms_refused_absent"};          // used, but no session could upload it
  Counter groom_bytes_received{*this, "groom_bytes_received"};
};

// Groom files on disk. A rejected file is removed and uploaded again.
struct GroomCacheCounters : CounterSet {
  Counter groom_cache_hits{*this, "groom_cache_hits"};
  Counter groom_cache_misses{*this, "groom_cache_misses"};
  Counter groom_cache_rejected_unreadable{*this, "groom_cache_rejected_unreadable"};
  Counter groom_cache_rejected_damaged{*this, "groom_cache_rejected_damaged"};
  Counter groom_cache_written{*this, "groom_cache_written"};
  Counter groom_cache_writes_failed{*this, "groom_cache_writes_failed"};
  Counter groom_cache_evicted{*this, "groom_cache_evicted"};
};

// Level files on disk. A rejected file is built again.
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
