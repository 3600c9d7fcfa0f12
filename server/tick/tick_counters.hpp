#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string_view>

#include "core/levels/level.hpp"
#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"
#include "server/telemetry/histogram.hpp"

namespace hairnet::server {

// A gauge for each level.
class LevelGauges {
 public:
  LevelGauges(GaugeSet& set, std::string_view family)
      : gauges_{{{set, family, "level", kLevelNames[0]},
                 {set, family, "level", kLevelNames[1]},
                 {set, family, "level", kLevelNames[2]},
                 {set, family, "level", kLevelNames[3]},
                 {set, family, "level", kLevelNames[4]},
                 {set, family, "level", kLevelNames[5]}}} {}
  Gauge& operator[](LevelIndex level) { return gauges_[static_cast<std::size_t>(level)]; }

 private:
  std::array<Gauge, kLevelCount> gauges_;
};

// Values of the last tick; some are updated once a second only.
struct TickGauges : GaugeSet {
  Gauge tick_period_seconds{*this, "tick_period_seconds"};  // period of a tick
  Gauge commands_waiting{*this, "commands_waiting"};        // commands and poses on their way to the tick
  Gauge commands_deferred{*this, "commands_deferred"};      // taken, but left to the next tick
  Gauge announcements_waiting{*this,
                              "announcements_waiting"};  // sessions that do not know all members of their room yet
  Gauge rooms{*this, "rooms"};
  LevelGauges characters{*this, "characters"};  // by level, asleep or not
  Gauge characters_by_state_stepped{*this, "characters_by_state", "state", "stepped"};
  Gauge characters_by_state_asleep{*this, "characters_by_state", "state", "asleep"};  // at rest
  // They are not stepped, since no observer sees them.
  Gauge characters_by_state_suspended{*this, "characters_by_state", "state", "suspended"};
  Gauge characters_by_state_waiting{*this, "characters_by_state", "state", "waiting"};  // for their first pose
  LevelGauges step_cost_seconds{*this, "step_cost_seconds"};          // of one character's step, measured
  Gauge budget_available_seconds{*this, "budget_available_seconds"};  // worker-seconds a tick, measured on real ticks
  Gauge budget_predicted_seconds{*this, "budget_predicted_seconds"};  // of them, for the current levels
  Gauge budget_wanted_seconds{*this, "budget_wanted_seconds"};        // of them, for the finest levels
  Gauge budget_over{*this, "budget_over"};                            // 1: not even rung 0 of all characters fits
  Gauge characters_below_wanted{*this, "characters_below_wanted"};    // seen, and coarser than their owners asked for
  std::atomic<std::int64_t> last_tick_ns{0};                          // when the newest tick ended; 0: none yet
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
  CounterSet log_only;  // not in /metrics, which has the tick_seconds histogram
  Counter ticks_run{*this, "ticks_run"};
  Counter ticks_late{*this, "ticks_late"};
  Counter ticks_skipped{*this, "ticks_skipped"};
  Counter ticks_overrun{*this, "ticks_overrun"};  // took longer than their period
  Counter tick_ns_total{log_only, "duty_seconds", "duty", "tick", 1e-9};
  Counter tick_ns_max{log_only, "tick_seconds_max", {}, {}, 1e-9};
  Counter characters_stepped{*this, "characters_stepped"};
  Counter characters_asleep{*this, "characters_asleep"};  // not stepped: at rest
  Counter teleports{*this, "teleports"};
  Counter members_announced{*this, "members_announced"};  // to sessions that joined or resumed
  Counter winds_changed{*this, "winds_changed"};          // also a room's first
  Counter place_choices{*this, "place_choices"};          // of an observer's members by distance
  Counter lattices_reset{*this, "lattices_reset"};
  // Worker time in ns: stepping; encoding frames; choosing and making each observer's packets.
  Counter step_ns_total{*this, "duty_seconds", "duty", "step", 1e-9};
  Counter encode_ns_total{*this, "duty_seconds", "duty", "encode", 1e-9};
  Counter send_ns_total{*this, "duty_seconds", "duty", "send", 1e-9};
  Counter schedule_ns_total{*this, "duty_seconds", "duty", "schedule", 1e-9};  // of the tick thread, before the step
  Counter levels_raised{*this, "levels_raised"};                               // or strides shortened
  Counter levels_lowered{*this, "levels_lowered"};
  Counter levels_entered{*this, "levels_entered"};
  Counter frames_published{*this, "frames_published"};
  Counter frames_encoded{*this, "frames_encoded"};  // codings made; several observers share one
  Counter frame_bytes_published{*this, "frame_bytes_published"};
  Counter observers_congested{*this, "observers_congested"};  // frames of several ticks were dropped for one
  // sent for a level that the character does not have
  Counter hair_states_dropped_unfit{*this, "hair_states_dropped", "reason", "unfit"};
  Counter hair_states_dropped_full{*this, "hair_states_dropped", "reason", "full"};
  Counter bases_announced{*this, "bases_announced"};
  Counter learnt_announced{*this, "learnt_announced"};
  Counter evaluations_refused{*this, "evaluations_refused"};                  // of learnt hair that was not announced
  Counter frames_evaluated_by_clients{*this, "frames_evaluated_by_clients"};  // published as poses alone
  Counter frames_dropped_not_finite{*this, "frames_dropped", "reason", "not_finite"};  // never sent
  Counter ticks_recorded{*this, "ticks_recorded"};
  Counter recordings_failed{*this, "recordings_failed"};
};

}  // namespace hairnet::server
