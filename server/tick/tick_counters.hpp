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
  LevelGauges(GaugeSet& set, std::string_view family, std::string_view help)
      : gauges_{{{set, family, "level", kLevelNames[0], help},
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
  Gauge tick_period_seconds{*this, "tick_period_seconds", "Period of a tick, in seconds."};
  Gauge commands_waiting{*this, "commands_waiting", "Commands and poses on their way to the tick."};
  Gauge commands_deferred{*this, "commands_deferred", "Commands taken by the last tick, but left to the next one."};
  Gauge announcements_waiting{*this, "announcements_waiting",
                              "Sessions that do not know all members of their room yet."};
  Gauge rooms{*this, "rooms", "Rooms of this server."};
  LevelGauges characters{*this, "characters", "Characters, by their level, asleep or not."};
  Gauge characters_by_state_stepped{*this, "characters_by_state", "state", "stepped",
                                    "Characters, by what the tick does with them."};
  // Characters whose hair is at rest, so that a step costs nothing.
  Gauge characters_by_state_asleep{*this, "characters_by_state", "state", "asleep"};
  // Characters that are not stepped, since no observer sees them.
  Gauge characters_by_state_suspended{*this, "characters_by_state", "state", "suspended"};
  // Characters that wait for their first pose.
  Gauge characters_by_state_waiting{*this, "characters_by_state", "state", "waiting"};
  Gauge characters_touched{*this, "characters_touched", "Characters that hands or props are near, or that are held."};
  Gauge props{*this, "props", "Props of all rooms."};
  LevelGauges step_cost_seconds{*this, "step_cost_seconds",
                                "Measured time of one step of one character, in seconds, by level."};
  Gauge budget_available_seconds{*this, "budget_available_seconds",
                                 "Time that the workers have for characters in a tick, in seconds."};
  Gauge budget_predicted_seconds{*this, "budget_predicted_seconds",
                                 "Time that the characters need in a tick at their current levels, in seconds."};
  Gauge budget_wanted_seconds{*this, "budget_wanted_seconds",
                              "Time that the characters need in a tick at their finest levels, in seconds."};
  Gauge budget_over{*this, "budget_over", "1 while not even the coarsest levels fit into the available time, else 0."};
  Gauge characters_below_wanted{*this, "characters_below_wanted",
                                "Characters that are seen, and coarser than their owners asked for."};
  // The newest tick ended at this time; 0: none has run yet.
  std::atomic<std::int64_t> last_tick_ns{0};
};

// The bounds of buckets lie closer to each other about the periods of 30 to 90 Hz, where a tick becomes an overrun.
struct TickHistograms : HistogramSet {
  Histogram tick_seconds{*this,
                         "tick_seconds",
                         "Duration of ticks, in seconds.",
                         {0.0005, 0.001, 0.002, 0.004, 0.006, 0.008, 0.011, 0.016, 0.022, 0.033, 0.05, 0.1, 0.25, 1}};
  Histogram tick_period_used_ratio{*this,
                                   "tick_period_used_ratio",
                                   "Duration of ticks over their period; above 1 is an overrun.",
                                   {0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1, 1.5, 2, 4, 8}};
  Histogram pose_age_seconds{
      *this,
      "pose_age_seconds",
      "Age of each character's newest pose at the tick, in seconds, without those above a second.",
      {0.005, 0.01, 0.015, 0.02, 0.025, 0.03, 0.04, 0.05, 0.075, 0.1, 0.15, 0.25, 0.5, 1}};
};

struct TickCounters : CounterSet {
  TickGauges gauges;
  TickHistograms histograms;
  // These counters are in the log only: /metrics has the histogram tick_seconds instead.
  CounterSet log_only;
  Counter ticks_run{*this, "ticks_run", "Ticks run."};
  Counter ticks_late{*this, "ticks_late", "Ticks that began late."};
  Counter ticks_skipped{*this, "ticks_skipped", "Ticks skipped, since too many were overdue."};
  Counter ticks_overrun{*this, "ticks_overrun", "Ticks that took longer than their period."};
  Counter tick_ns_total{log_only, "duty_seconds", "duty", "tick", {}, 1e-9};
  Counter tick_ns_max{log_only, "tick_seconds_max", "Longest duration of a tick, in seconds.", 1e-9};
  Counter characters_stepped{*this, "characters_stepped", "Steps of characters."};
  Counter characters_asleep{*this, "characters_asleep", "Steps left out of characters at rest."};
  Counter teleports{*this, "teleports", "Teleports of characters."};
  Counter members_announced{*this, "members_announced", "Members announced to sessions that joined or resumed."};
  Counter winds_changed{*this, "winds_changed", "Winds of rooms set, also a room's first."};
  Counter place_choices{*this, "place_choices", "Choices of an observer's members by distance."};
  Counter lattices_reset{*this, "lattices_reset", "Lattices returned to rest, since they were not finite."};
  // The time of all workers, in ns, for three duties: stepping; encoding frames; choosing and making each observer's
  // packets.
  Counter step_ns_total{
      *this, "duty_seconds", "duty", "step", "Time that workers and the tick spent, in seconds, by duty.", 1e-9};
  Counter encode_ns_total{*this, "duty_seconds", "duty", "encode", {}, 1e-9};
  Counter send_ns_total{*this, "duty_seconds", "duty", "send", {}, 1e-9};
  // The time that the tick thread spends before the step.
  Counter schedule_ns_total{*this, "duty_seconds", "duty", "schedule", {}, 1e-9};
  Counter levels_raised{*this, "levels_raised", "Characters raised to a finer level or a shorter stride."};
  Counter levels_lowered{*this, "levels_lowered", "Characters lowered to a coarser level or a longer stride."};
  Counter levels_entered{*this, "levels_entered", "Changes of a character's level."};
  Counter frames_published{*this, "frames_published", "Frames published to observers."};
  Counter frames_encoded{*this, "frames_encoded", "Codings of frames made; several observers share one."};
  Counter frame_bytes_published{*this, "frame_bytes_published", "Bytes of frames published to observers."};
  Counter observers_congested{*this, "observers_congested",
                              "Times at which frames of several ticks were dropped for an observer."};
  // The state was sent for a level that the character does not have.
  Counter hair_states_dropped_unfit{*this, "hair_states_dropped", "reason", "unfit",
                                    "Hair states of clients that were dropped, by reason."};
  Counter hair_states_dropped_full{*this, "hair_states_dropped", "reason", "full"};
  Counter bodies_refused{*this, "bodies_refused",
                         "Pairs of a shape and a character of its room that it may not touch, once a tick."};
  Counter bodies_left_out{*this, "bodies_left_out", "Shapes near hair that more and nearer ones touched, once a tick."};
  Counter holds_taken{*this, "holds_taken", "Holds of hair that hands took."};
  Counter holds_refused_unknown{*this, "holds_refused", "reason", "unknown", "Holds that were not taken, by reason."};
  Counter holds_refused_not_allowed{*this, "holds_refused", "reason", "not_allowed"};
  // The hand is not there, or no hair is near it.
  Counter holds_refused_out_of_reach{*this, "holds_refused", "reason", "out_of_reach"};
  Counter holds_ended{*this, "holds_ended", "Holds of hair that ended before the hand let go."};
  Counter hand_bytes_published{*this, "hand_bytes_published", "Bytes of others' hands published to observers."};
  Counter bases_announced{*this, "bases_announced", "Bases of grooms announced to sessions."};
  Counter learnt_announced{*this, "learnt_announced", "Networks of learnt hair announced to sessions."};
  Counter evaluations_refused{*this, "evaluations_refused", "Requests to evaluate learnt hair that was not announced."};
  Counter frames_evaluated_by_clients{*this, "frames_evaluated_by_clients",
                                      "Frames published as poses alone, which clients evaluate."};
  Counter frames_dropped_not_finite{*this, "frames_dropped", "reason", "not_finite", "Frames never sent, by reason."};
  Counter ticks_recorded{*this, "ticks_recorded", "Ticks written to the recording."};
  Counter recordings_failed{*this, "recordings_failed", "Recordings that ended because of an error."};
};

}  // namespace hairnet::server
