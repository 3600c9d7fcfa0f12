#pragma once

#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"
#include "server/telemetry/histogram.hpp"

namespace hairnet::server {

struct SessionGauges : GaugeSet {
  Gauge clients{*this, "clients"};                    // all, including detached ones
  Gauge clients_detached{*this, "clients_detached"};  // their connections broke, and they may resume
  Gauge packets_waiting{*this, "packets_waiting"};    // in outboxes, until connections send them
};

struct SessionHistograms : HistogramSet {
  Histogram received_packet_bytes{*this, "received_packet_bytes", {64, 256, 1024, 4096, 16'384, 65'536, 262'144}};
  Histogram sent_packet_bytes{*this, "sent_packet_bytes", {64, 256, 1024, 4096, 16'384, 65'536, 262'144}};
};

struct SessionCounters : CounterSet {
  SessionGauges gauges;
  SessionHistograms histograms;
  Counter sessions_opened{*this, "sessions_opened"};
  Counter sessions_welcomed{*this, "sessions_welcomed"};
  Counter sessions_closed{*this, "sessions_closed"};
  Counter sessions_refused_full{*this, "sessions_refused_full"};
  Counter sessions_refused_token{*this, "sessions_refused_token"};
  Counter sessions_refused_room{*this, "sessions_refused_room"};
  Counter sessions_detached{*this, "sessions_detached"};
  Counter sessions_resumed{*this, "sessions_resumed"};
  // resume was requested, but the session was unknown or over; a new one was made
  Counter sessions_not_resumed{*this, "sessions_not_resumed"};
  Counter sessions_refused_version{*this, "sessions_refused_version"};
  Counter sessions_closed_handshake_timeout{*this, "sessions_closed_handshake_timeout"};
  Counter sessions_closed_idle{*this, "sessions_closed_idle"};
  Counter sessions_closed_slow{*this, "sessions_closed_slow"};
  Counter sessions_closed_over_rate{*this, "sessions_closed_over_rate"};
  Counter sessions_closed_taken_over{*this, "sessions_closed_taken_over"};
  Counter sessions_closed_grace_over{*this, "sessions_closed_grace_over"};
  Counter sessions_closed_protocol_error{*this, "sessions_closed_protocol_error"};
  Counter packets_received{*this, "packets_received"};
  Counter packets_malformed{*this, "packets_malformed"};
  Counter packets_invalid{*this, "packets_invalid"};
  Counter packets_oversize{*this, "packets_oversize"};
  Counter messages_unexpected{*this, "messages_unexpected"};
  Counter messages_over_rate{*this, "messages_over_rate"};
  Counter characters_added{*this, "characters_added"};
  Counter characters_removed{*this, "characters_removed"};  // by their clients, or when their sessions ended
  Counter characters_refused{*this, "characters_refused"};
  Counter hair_states_refused{*this, "hair_states_refused"};
  Counter levels_refused{*this, "levels_refused"};
  Counter materials_refused{*this, "materials_refused"};
  Counter winds_refused{*this, "winds_refused"};
  Counter grooms_refused{*this, "grooms_refused"};
  Counter chunks_refused{*this, "chunks_refused"};
  Counter observes_refused{*this, "observes_refused"};
  Counter downloads_refused{*this, "downloads_refused"};
  Counter download_bytes_sent{*this, "download_bytes_sent"};
  Counter keyframes_requested{*this, "keyframes_requested"};
  Counter poses_received{*this, "poses_received"};
  Counter poses_over_rate{*this, "poses_over_rate"};
  Counter poses_dropped_busy{*this, "poses_dropped_busy"};
  Counter poses_rejected_character{*this, "poses_rejected_character"};
  Counter poses_rejected_time{*this, "poses_rejected_time"};
  Counter poses_rejected_not_finite{*this, "poses_rejected_not_finite"};
  Counter poses_rejected_not_unit{*this, "poses_rejected_not_unit"};
  Counter poses_rejected_too_far{*this, "poses_rejected_too_far"};
  Counter commands_dropped{*this, "commands_dropped"};
  Counter frames_sent{*this, "frames_sent"};
  Counter frames_superseded{*this, "frames_superseded"};
  Counter packets_sent{*this, "packets_sent"};
  Counter bytes_sent{*this, "bytes_sent"};
  Counter errors_sent{*this, "errors_sent"};
};

}  // namespace hairnet::server
