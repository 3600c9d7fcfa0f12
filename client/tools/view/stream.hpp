#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "client/link/link.hpp"
#include "client/tools/view/cast.hpp"
#include "client/tools/view/moment.hpp"
#include "client/tools/view/options.hpp"
#include "client/tools/view/stream_statistics.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Another's character, as it was seen; a moment at which it was not there yet, or its hair unknown, has none.
struct SeenCharacter {
  std::shared_ptr<const Groom> groom;
  std::vector<std::optional<Moment>> moments;  // [time]
};

struct StreamResult {
  std::vector<std::vector<Moment>> moments;  // [time][character of the cast]
  std::vector<SeenCharacter> others;
  StreamStatistics statistics;
  Result<void> ended;  // what cut the stream short, if anything
};

// Streams the cast in real time until `options` says it ends, writes the trace, and copies out what is shown at each of
// `moment_times_s` (ascending). What was received before a failure is still returned.
StreamResult stream(const ViewOptions& options, const std::vector<Actor>& cast,
                    const std::vector<double>& moment_times_s);

}  // namespace hairnet::viewer
