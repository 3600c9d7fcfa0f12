#pragma once

#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"
#include "server/telemetry/histogram.hpp"

namespace hairnet::server {

struct SessionGauges : GaugeSet {
  Gauge clients{*this, "clients"};                    // all, including detached ones
  Gauge clients_detached{*this, "clients_detached"};  // their connections broke, and they may resume
  Gauge subjects{*this, "subjects"};                  // that clients belong to: of tokens, or addresses
  Gauge packets_waiting{*this, "packets_waiting"};    // in outboxes, until connections send them
  Gauge bans{*this, "bans"};                          // bans, mutes and locks by moderators
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
  Counter sessions_refused_full{*this, "sessions_refused", "reason", "full"};
  Counter sessions_refused_token{*this, "sessions_refused", "reason", "token"};
  Counter sessions_refused_room{*this, "sessions_refused", "reason", "room"};
  Counter sessions_refused_subject{*this, "sessions_refused", "reason", "subject"};  // its token's has too many
  Counter sessions_refused_address{*this, "sessions_refused", "reason", "address"};  // its address has too many
  Counter sessions_refused_busy{*this, "sessions_refused", "reason", "busy"};        // the queue to the tick was full
  Counter sessions_refused_early{*this, "sessions_refused", "reason", "early"};      // a session was resumed too often
  Counter sessions_refused_memory{*this, "sessions_refused", "reason", "memory"};
  Counter sessions_refused_banned{*this, "sessions_refused", "reason", "banned"};      // from the room
  Counter sessions_refused_locked{*this, "sessions_refused", "reason", "locked"};      // the room is locked
  Counter sessions_refused_outgrown{*this, "sessions_refused", "reason", "outgrown"};  // the server is full of the room
  Counter sessions_refused_fleet{*this, "sessions_refused", "reason", "fleet"};  // no server can take the room now
  Counter sessions_redirected{*this, "sessions_redirected"};  // to the server that holds the room, or will
  Counter redirect_loops{*this, "redirect_loops"};            // clients that four servers in a row have sent on
  Counter sessions_detached{*this, "sessions_detached"};
  Counter sessions_resumed{*this, "sessions_resumed"};
  // resume was requested, but the session was unknown or over; a new one was made
  Counter sessions_not_resumed{*this, "sessions_not_resumed"};
  Counter sessions_refused_version{*this, "sessions_refused", "reason", "version"};
  Counter sessions_closed_by_server_handshake_timeout{*this, "sessions_closed_by_server", "reason",
                                                      "handshake_timeout"};
  Counter sessions_closed_by_server_idle{*this, "sessions_closed_by_server", "reason", "idle"};
  Counter sessions_closed_by_server_slow{*this, "sessions_closed_by_server", "reason", "slow"};
  Counter sessions_closed_by_server_over_rate{*this, "sessions_closed_by_server", "reason", "over_rate"};
  Counter sessions_closed_by_server_taken_over{*this, "sessions_closed_by_server", "reason", "taken_over"};
  Counter sessions_closed_by_server_grace_over{*this, "sessions_closed_by_server", "reason", "grace_over"};
  Counter sessions_closed_by_server_protocol_error{*this, "sessions_closed_by_server", "reason", "protocol_error"};
  Counter sessions_closed_by_server_token_expired{*this, "sessions_closed_by_server", "reason", "token_expired"};
  Counter sessions_closed_by_server_token_revoked{*this, "sessions_closed_by_server", "reason", "token_revoked"};
  Counter sessions_closed_by_server_memory{*this, "sessions_closed_by_server", "reason", "memory"};
  Counter sessions_closed_by_server_removed{*this, "sessions_closed_by_server", "reason", "removed"};
  Counter kept_left_out{*this, "fleet_kept_left_out"};            // bans, mutes, members: too many to move with a room
  Counter rooms_kept_refused{*this, "fleet_rooms_kept_refused"};  // what an earlier owner has kept was not valid
  Counter moderations_remove{*this, "moderations", "action", "remove"};
  Counter moderations_mute{*this, "moderations", "action", "mute"};
  Counter moderations_unmute{*this, "moderations", "action", "unmute"};
  Counter moderations_lock{*this, "moderations", "action", "lock"};
  Counter moderations_unlock{*this, "moderations", "action", "unlock"};
  Counter packets_received{*this, "packets_received"};
  Counter datagrams_dropped{*this, "datagrams_dropped"};  // their session was not active (yet)
  Counter packets_refused_malformed{*this, "packets_refused", "reason", "malformed"};
  Counter packets_refused_invalid{*this, "packets_refused", "reason", "invalid"};
  Counter packets_refused_oversize{*this, "packets_refused", "reason", "oversize"};
  Counter messages_refused_unexpected{*this, "messages_refused", "reason", "unexpected"};
  Counter messages_refused_over_rate{*this, "messages_refused", "reason", "over_rate"};
  Counter messages_refused_memory{*this, "messages_refused", "reason", "memory"};  // no memory for what it asks
  Counter messages_refused_work{*this, "messages_refused", "reason", "work"};      // too much work a second
  Counter characters_added{*this, "characters_added"};
  Counter characters_removed{*this, "characters_removed"};  // by their clients, or when their sessions ended
  Counter requests_refused_character{*this, "requests_refused", "request", "character"};
  Counter requests_refused_hair_state{*this, "requests_refused", "request", "hair_state"};
  Counter requests_refused_level{*this, "requests_refused", "request", "level"};
  Counter requests_refused_appearance{*this, "requests_refused", "request", "appearance"};
  Counter requests_refused_material{*this, "requests_refused", "request", "material"};
  Counter requests_refused_wind{*this, "requests_refused", "request", "wind"};
  Counter requests_refused_moderate{*this, "requests_refused", "request", "moderate"};
  Counter requests_refused_groom{*this, "requests_refused", "request", "groom"};
  Counter requests_refused_chunk{*this, "requests_refused", "request", "chunk"};
  Counter requests_refused_observe{*this, "requests_refused", "request", "observe"};
  Counter requests_refused_download{*this, "requests_refused", "request", "download"};
  Counter download_bytes_sent{*this, "download_bytes_sent"};
  Counter downloads_given_up_stopped{*this, "downloads_given_up", "reason", "stopped"};  // by the client
  Counter downloads_given_up_stalled{*this, "downloads_given_up", "reason", "stalled"};  // it did not read them
  Counter downloads_delayed{*this, "downloads_delayed"};  // a piece waited, as the session had its share of bytes
  Counter poses_received{*this, "poses_received"};
  // Sent again with later ones, though they had come. Not among those received.
  Counter poses_repeated{*this, "poses_repeated"};
  Counter poses_dropped_over_rate{*this, "poses_dropped", "reason", "over_rate"};
  Counter poses_dropped_busy{*this, "poses_dropped", "reason", "busy"};
  // The character's last pose was captured less than 4 ms before or after.
  Counter poses_thinned{*this, "poses_thinned"};
  Counter poses_rejected_character{*this, "poses_rejected", "reason", "character"};
  Counter poses_rejected_time{*this, "poses_rejected", "reason", "time"};
  Counter poses_rejected_not_finite{*this, "poses_rejected", "reason", "not_finite"};
  Counter poses_rejected_not_unit{*this, "poses_rejected", "reason", "not_unit"};
  Counter poses_rejected_too_far{*this, "poses_rejected", "reason", "too_far"};
  Counter commands_dropped{*this, "commands_dropped"};
  Counter frames_sent{*this, "frames_sent"};
  Counter frames_superseded{*this, "frames_superseded"};
  // A MemberJoined whose member left while it waited, or a MemberChanged before the newest of its member.
  Counter messages_cancelled{*this, "messages_cancelled"};
  Counter packets_sent{*this, "packets_sent"};
  Counter bytes_sent{*this, "bytes_sent"};
  Counter errors_sent{*this, "errors_sent"};
};

}  // namespace hairnet::server
