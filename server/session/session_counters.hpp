#pragma once

#include "server/telemetry/counter.hpp"
#include "server/telemetry/gauge.hpp"
#include "server/telemetry/histogram.hpp"

namespace hairnet::server {

struct SessionGauges : GaugeSet {
  Gauge clients{*this, "clients", "Sessions, with detached ones."};
  Gauge clients_detached{*this, "clients_detached", "Sessions whose connections broke, and that may resume."};
  Gauge subjects{*this, "subjects", "Subjects that sessions belong to: of tokens, or addresses."};
  Gauge packets_waiting{*this, "packets_waiting", "Packets in outboxes, until connections send them."};
  Gauge bans{*this, "bans", "Bans, mutes and locks by moderators in force."};
};

struct SessionHistograms : HistogramSet {
  Histogram received_packet_bytes{*this,
                                  "received_packet_bytes",
                                  "Size of packets received, in bytes.",
                                  {64, 256, 1024, 4096, 16'384, 65'536, 262'144}};
  Histogram sent_packet_bytes{
      *this, "sent_packet_bytes", "Size of packets sent, in bytes.", {64, 256, 1024, 4096, 16'384, 65'536, 262'144}};
};

struct SessionCounters : CounterSet {
  SessionGauges gauges;
  SessionHistograms histograms;
  Counter sessions_opened{*this, "sessions_opened", "Sessions opened."};
  Counter sessions_welcomed{*this, "sessions_welcomed", "Sessions that joined a room."};
  Counter sessions_closed{*this, "sessions_closed", "Sessions closed."};
  Counter sessions_refused_full{*this, "sessions_refused", "reason", "full", "Sessions refused, by reason."};
  Counter sessions_refused_token{*this, "sessions_refused", "reason", "token"};
  Counter sessions_refused_room{*this, "sessions_refused", "reason", "room"};
  // The subject of the client's token has too many sessions.
  Counter sessions_refused_subject{*this, "sessions_refused", "reason", "subject"};
  // The client's address has too many sessions.
  Counter sessions_refused_address{*this, "sessions_refused", "reason", "address"};
  // The queue to the tick was full.
  Counter sessions_refused_busy{*this, "sessions_refused", "reason", "busy"};
  // The session was resumed a moment ago (SessionLimits::resume_interval_ns).
  Counter sessions_refused_early{*this, "sessions_refused", "reason", "early"};
  Counter sessions_refused_memory{*this, "sessions_refused", "reason", "memory"};
  // A moderator has banned the client from the room.
  Counter sessions_refused_banned{*this, "sessions_refused", "reason", "banned"};
  // The room is locked.
  Counter sessions_refused_locked{*this, "sessions_refused", "reason", "locked"};
  // The server has no time for more clients in the room, which alone overloads it.
  Counter sessions_refused_overloaded{*this, "sessions_refused", "reason", "overloaded"};
  // No server can take the room now.
  Counter sessions_refused_fleet{*this, "sessions_refused", "reason", "fleet"};
  Counter sessions_redirected{*this, "sessions_redirected",
                              "Sessions sent to the server that holds their room, or will."};
  Counter redirect_loops{*this, "redirect_loops", "Clients that four servers in a row have sent on."};
  Counter sessions_detached{*this, "sessions_detached", "Sessions whose connection broke."};
  Counter sessions_resumed{*this, "sessions_resumed", "Sessions resumed on a new connection."};
  Counter sessions_not_resumed{*this, "sessions_not_resumed",
                               "Resumes of sessions that are unknown or over; new ones were made."};
  Counter sessions_refused_version{*this, "sessions_refused", "reason", "version"};
  Counter sessions_closed_by_server_handshake_timeout{*this, "sessions_closed_by_server", "reason", "handshake_timeout",
                                                      "Sessions that the server closed, by reason."};
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
  Counter kept_left_out{*this, "fleet_kept_left_out",
                        "Bans, mutes, members and sets of props that were too many to move with a room."};
  Counter rooms_kept_refused{*this, "fleet_rooms_kept_refused",
                             "What earlier owners kept of rooms, and was not valid."};
  Counter moderations_remove{*this, "moderations", "action", "remove", "Actions of moderators, by action."};
  Counter moderations_mute{*this, "moderations", "action", "mute"};
  Counter moderations_unmute{*this, "moderations", "action", "unmute"};
  Counter moderations_lock{*this, "moderations", "action", "lock"};
  Counter moderations_unlock{*this, "moderations", "action", "unlock"};
  Counter packets_received{*this, "packets_received", "Packets received."};
  Counter datagrams_dropped{*this, "datagrams_dropped", "Datagrams dropped, since their session was not active."};
  Counter packets_refused_malformed{*this, "packets_refused", "reason", "malformed", "Packets refused, by reason."};
  Counter packets_refused_invalid{*this, "packets_refused", "reason", "invalid"};
  Counter packets_refused_oversize{*this, "packets_refused", "reason", "oversize"};
  Counter messages_refused_unexpected{*this, "messages_refused", "reason", "unexpected",
                                      "Messages refused, by reason."};
  Counter messages_refused_over_rate{*this, "messages_refused", "reason", "over_rate"};
  // The server had no memory for what the message asks.
  Counter messages_refused_memory{*this, "messages_refused", "reason", "memory"};
  // The session asked for too much work in a second.
  Counter messages_refused_work{*this, "messages_refused", "reason", "work"};
  Counter characters_added{*this, "characters_added", "Characters added."};
  Counter characters_removed{*this, "characters_removed",
                             "Characters removed, by their clients or with their sessions."};
  Counter requests_refused_character{*this, "requests_refused", "request", "character",
                                     "Requests refused, by the kind of request."};
  Counter requests_refused_hair_state{*this, "requests_refused", "request", "hair_state"};
  Counter requests_refused_level{*this, "requests_refused", "request", "level"};
  Counter requests_refused_appearance{*this, "requests_refused", "request", "appearance"};
  Counter requests_refused_material{*this, "requests_refused", "request", "material"};
  Counter requests_refused_wind{*this, "requests_refused", "request", "wind"};
  // A change of who may touch a character was refused.
  Counter requests_refused_touch{*this, "requests_refused", "request", "touch"};
  Counter requests_refused_hold{*this, "requests_refused", "request", "hold"};
  Counter requests_refused_props{*this, "requests_refused", "request", "props"};
  Counter requests_refused_moderate{*this, "requests_refused", "request", "moderate"};
  Counter requests_refused_groom{*this, "requests_refused", "request", "groom"};
  Counter requests_refused_chunk{*this, "requests_refused", "request", "chunk"};
  Counter requests_refused_observe{*this, "requests_refused", "request", "observe"};
  Counter requests_refused_download{*this, "requests_refused", "request", "download"};
  Counter download_bytes_sent{*this, "download_bytes_sent", "Bytes of grooms sent to clients."};
  // The client has stopped the download: it does not want the rest.
  Counter downloads_given_up_stopped{*this, "downloads_given_up", "reason", "stopped",
                                     "Downloads given up, by reason."};
  // The client did not read the download for too long.
  Counter downloads_given_up_stalled{*this, "downloads_given_up", "reason", "stalled"};
  Counter downloads_delayed{*this, "downloads_delayed",
                            "Pieces of downloads that waited, as their session had its share of bytes."};
  Counter poses_received{*this, "poses_received", "Poses received, without those sent again."};
  Counter poses_repeated{*this, "poses_repeated", "Poses sent again with later ones, though they had come."};
  Counter poses_dropped_over_rate{*this, "poses_dropped", "reason", "over_rate", "Poses dropped, by reason."};
  Counter poses_dropped_busy{*this, "poses_dropped", "reason", "busy"};
  Counter poses_thinned{*this, "poses_thinned",
                        "Poses left out: the last one of the character was captured less than 4 ms before or after."};
  Counter poses_rejected_character{*this, "poses_rejected", "reason", "character", "Poses rejected, by reason."};
  Counter poses_rejected_time{*this, "poses_rejected", "reason", "time"};
  Counter poses_rejected_not_finite{*this, "poses_rejected", "reason", "not_finite"};
  Counter poses_rejected_not_unit{*this, "poses_rejected", "reason", "not_unit"};
  Counter poses_rejected_too_far{*this, "poses_rejected", "reason", "too_far"};
  Counter hands_received{*this, "hands_received", "Samples of a person's hands received."};
  Counter hands_dropped_over_rate{*this, "hands_dropped", "reason", "over_rate",
                                  "Samples of hands dropped, by reason."};
  Counter hands_dropped_busy{*this, "hands_dropped", "reason", "busy"};
  Counter hands_rejected_time{*this, "hands_rejected", "reason", "time", "Samples of hands rejected, by reason."};
  Counter commands_dropped{*this, "commands_dropped", "Commands dropped, since the queue to the tick was full."};
  Counter frames_sent{*this, "frames_sent", "Frames sent."};
  Counter frames_superseded{*this, "frames_superseded", "Frames replaced by newer ones before they were sent."};
  // A MemberJoined whose member left while it waited, or a MemberChanged before the newest of its member.
  Counter messages_cancelled{*this, "messages_cancelled",
                             "Messages about members that left or changed again before they were sent."};
  Counter packets_sent{*this, "packets_sent", "Packets sent."};
  Counter bytes_sent{*this, "bytes_sent", "Bytes of packets sent."};
  Counter errors_sent{*this, "errors_sent", "Messages of errors sent."};
};

}  // namespace hairnet::server
