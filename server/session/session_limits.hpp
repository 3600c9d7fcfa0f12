#pragma once

#include <cstddef>
#include <cstdint>

namespace hairnet::server {

// Which clients may change what belongs to a whole room. A value includes those before it.
enum class AllowedClients : std::uint8_t { off, moderators, participants, everyone };

// The limits of sessions. `app/config` fills them from the settings; the values here are the defaults.
struct SessionLimits {
  // Sessions that have joined, including detached ones. As many connections again may wait for their Welcome, so that a
  // client can resume its session when the server is full.
  std::size_t session_count_max = 256;
  // Bounds the characters of all sessions.
  std::size_t character_count_max = 4096;
  std::size_t characters_per_session_max = 1024;
  // Bounds unsent messages in a session; a level record is up to 100 KB.
  std::size_t control_bytes_max = std::size_t{32} << 20;
  // Bounds a packet of frames; the frames of a tick may need several.
  std::size_t frame_packet_bytes_max = std::size_t{256} << 10;
  std::size_t room_count_max = 4096;
  std::size_t sessions_per_room_max = 256;
  std::size_t characters_per_room_max = 65'536;
  // The next three bound a subject that a token names, or an address; exempt addresses have no such limit.
  std::size_t sessions_per_subject_max = 16;
  // Larger than sessions_per_subject_max, since many users may share an address.
  std::size_t sessions_per_address_max = 128;
  std::size_t characters_per_subject_max = 2048;
  // Bounds grooms that were requested and not yet sent.
  std::size_t downloads_per_session_max = 64;
  // Bounds what a session gets of grooms in a second, and at once.
  double download_bytes_per_s = 32 << 20;
  AllowedClients wind_from_clients = AllowedClients::participants;
  AllowedClients props_from_clients = AllowedClients::moderators;
  // Bounds bans, mutes and locks by moderators, of all rooms.
  std::size_t bans_max = 4096;
  // Counts plain messages: message_price.hpp has what other messages count. Requested groom bytes do not count.
  double messages_per_s = 1000;
  // A client that joins adds 1024 characters at once.
  double messages_burst = 8000;
  // A little more than 1024 characters at 72 Hz, so that one client can carry characters_per_session_max of them.
  double poses_per_s = 80'000;
  double poses_burst = 80'000;
  // A connection without a valid Hello ends after this time; a Hello that waits for the fleet's directory may take as
  // long.
  std::int64_t handshake_timeout_ns = 5'000'000'000;
  // Bounds the silence of a client that has not promised signs of life. One that has is lost after
  // channel::kSilence_ns.
  std::int64_t idle_timeout_ns = 60'000'000'000;
  // A session outlives its connection by this time; zero: not at all.
  std::int64_t resume_grace_ns = 10'000'000'000;
  // At least this time passes from one resume of a session to the next: each resume announces the whole room again.
  std::int64_t resume_interval_ns = 1'000'000'000;
  // A full connection may make no progress for this long, or a message may wait: see Outbox::is_overdue.
  std::int64_t slow_consumer_ns = 10'000'000'000;
  // A download's stream may have no room for this long.
  std::int64_t download_stalled_ns = 30'000'000'000;
  // A session that says goodbye has this long to send what waits; then the connection closes.
  std::int64_t drain_timeout_ns = 2'000'000'000;
};

}  // namespace hairnet::server
