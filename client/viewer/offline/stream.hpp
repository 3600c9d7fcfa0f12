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

// The result of a stream, or of a local run in its place.
struct StreamResult {
  // The own characters at each moment, in the order of the times; shorter than the list of times when the stream ended
  // early.
  std::vector<std::vector<Moment>> moments;
  std::vector<SeenCharacter> others;
  StreamStatistics statistics;
  // The other clients' characters at the end, one line each (LiveRoom::members_summary).
  std::string members;
  // The stream is connected to a server; without one, the statistics count nothing.
  bool connected = false;
  // The error that ended the stream early, if any.
  Result<void> ended;
  // A signal stopped it before its end: moments may be missing.
  bool stopped = false;
};

// Streams the characters in real time until the end that `options` sets or until a stop signal. Writes the trace, and
// copies the shown state at each of `moment_times_s` (ascending), at or shortly after its time. After a failure it
// still returns what was received before. It blocks for that long.
StreamResult stream(const ViewOptions& options, const std::vector<CharacterSetup>& characters,
                    const std::vector<double>& moment_times_s);

}  // namespace hairnet::viewer
