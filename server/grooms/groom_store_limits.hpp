#pragma once

#include <cstddef>
#include <cstdint>

#include "core/groom/groom.hpp"

namespace hairnet::server {

// When the hair of a groom is learnt.
enum class Learning : std::uint8_t {
  never,
  // Waits until time is short: characters have been below the level that their owners asked for, for a while.
  when_short,
  always,
};

// The limits of grooms. `app/config` fills them from the settings; the values here are the defaults.
struct GroomStoreLimits {
  // Bounds one groom.
  std::size_t groom_bytes_max = std::size_t{64} << 20;
  // Bounds what is received for all unfinished uploads and waiting builds.
  std::size_t upload_bytes_max = std::size_t{256} << 20;
  // Bounds all levels, and the files of their grooms.
  std::size_t level_bytes_max = std::size_t{4} << 30;
  std::size_t groom_count_max = 1024;
  std::size_t grooms_per_session_max = 64;
  // Bounds all grooms that a session uses together.
  std::size_t strands_per_session_max = 1'000'000;
  // The mean rate and the burst of a session's uploads, in the sizes that it announces.
  double upload_bytes_per_s = 16.0 * (1 << 20);
  double upload_burst_bytes = 256.0 * (1 << 20);
  // The number of grooms that may wait for the builder with their files in memory.
  std::size_t build_queue_max = 64;
  // The uploads of a session must bring this much together, over each upload_timeout_ns. A session that holds a place
  // and sends next to nothing would block others.
  double upload_bytes_per_s_min = 8.0 * (1 << 10);
  std::int64_t upload_timeout_ns = 30'000'000'000;
  // After this time a session that waits for another's upload of the same groom is asked for its own.
  std::int64_t upload_patience_ns = 5'000'000'000;
  // A long time, since the builder has low priority on a machine that may be busy.
  std::int64_t build_ns_max = 600'000'000'000;
  std::size_t build_memory_bytes_max = std::size_t{2} << 30;
  // After this time a build gives way to one of a session whose builds have taken less. It begins again later, with
  // twice the time.
  std::int64_t build_turn_ns = 5'000'000'000;
  // A build that fails by an error of the server begins again after this time, the next after twice this time, and so
  // on.
  std::int64_t build_again_ns = 1'000'000'000;
  int build_count_max = 4;
  Learning learning = Learning::when_short;
  GroomLimits groom;
};

}  // namespace hairnet::server
