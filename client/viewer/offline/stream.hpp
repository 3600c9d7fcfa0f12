#pragma once

#include <string>
#include <vector>

#include "client/viewer/characters/load_characters.hpp"
#include "client/viewer/characters/options.hpp"
#include "client/viewer/sources/live_room.hpp"
#include "client/viewer/sources/moment.hpp"
#include "client/viewer/sources/stream_statistics.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

struct StreamResult {
  std::vector<std::vector<Moment>> moments;  // [time][character]
  std::vector<SeenCharacter> others;
  StreamStatistics statistics;
  std::string members;     // of other clients, at the end: one line each
  bool connected = false;  // to a server; without, the statistics count nothing
  Result<void> ended;      // the error that ended the stream early, if any
  bool stopped = false;    // by a signal, before its end: moments may be missing
};

// Streams the characters in real time until the end that `options` sets or until a stop signal. Writes the trace, and
// copies the shown state at each of `moment_times_s` (ascending). After a failure it still returns what was received
// before.
StreamResult stream(const ViewOptions& options, const std::vector<CharacterSetup>& characters,
                    const std::vector<double>& moment_times_s);

}  // namespace hairnet::viewer
