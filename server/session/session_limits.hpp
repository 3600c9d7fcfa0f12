#pragma once

#include <cstddef>
#include <cstdint>

namespace hairnet::server {

// Which clients may change what belongs to a whole room. A value includes those before it.
enum class AllowedClients : std::uint8_t { off, moderators, participants, everyone };

struct SessionLimits {
  // Sessions that have joined, including detached ones. As many connections again may wait for their Welcome, so that a
  // client can resume its session when the server is full.
  std::size_t session_count_max = 256;
  // Bounds the characters of all sessions.
  std::size_t character_count_max = 4096;
  std::size_t characters_per_session_max = 1024;
  // Bounds unsent messages in a session; a level record is up to 100 KB.
  std::size_t control_bytes_max = std::size_t{32} << 20;
  std::size_t frame_packet_bytes_max = std::size_t{256} << 10;
  std::size_t room_count_max = 4096;
  std::size_t sessions_per_room_max = 256;
  std::size_t characters_per_room_max = 65'536;
  // The next three bound a subject that a token names, or an address; exempt addresses have no such limit.
  std::size_t sessions_per_subject_max = 16;
  // Is larger, since many users may share an address.
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
  // Is a little more than 1024 characters at 72 Hz.
  double poses_per_s = 80'000;
  double poses_burst = 80'000;
  std::int64_t handshake_timeout_ns = 5'000'000'000;
  std::int64_t idle_timeout_ns = 60'000'000'000;
  // A session outlives its connection by this time; zero: not at all.
  std::int64_t resume_grace_ns = 10'000'000'000;
  // Passes at least from one resume of a session to the next.
  std::int64_t resume_interval_ns = 1'000'000'000;
  // A full connection may make no progress for this long, or a message may wait: see Outbox::is_overdue.
  std::int64_t slow_consumer_ns = 10'000'000'000;
  // A download's stream may have no room for this long.
  std::int64_t download_stalled_ns = 30'000'000'000;
  std::int64_t drain_timeout_ns = 2'000'000'000;
};

}  // namespace hairnet::server
