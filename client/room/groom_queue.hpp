#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "schema/wire/messages.hpp"

namespace hairnet::room {

// The grooms to fetch, one after the other: the first one is whole soon, where all at once would be whole at the end.
// The first request waits until heights were set twice, since by then an application has placed its camera; where none
// are set it waits 0.6 s and for four calls. No I/O; one thread.
class GroomQueue {
 public:
  void add(const wire::GroomHash& groom) {
    if (groom != current_) waiting_.insert(groom);
  }
  // No member needs the groom any more. A fetch that has begun continues.
  void remove(const wire::GroomHash& groom) { waiting_.erase(groom); }
  // The groom has arrived, or cannot come.
  void finish(const wire::GroomHash& groom);
  // The heights of all grooms that are seen now, as a share of the screen; heads outside of the view count little.
  void set_heights(std::span<const std::pair<wire::GroomHash, float>> heights);
  // The groom to ask for now: `first`, or unless `only_first` the largest on the screen; none while another is on its
  // way.
  std::optional<wire::GroomHash> next(std::int64_t now_ns, const std::optional<wire::GroomHash>& first = {},
                                      bool only_first = false);

 private:
  [[nodiscard]] std::optional<wire::GroomHash> largest(std::int64_t waited_ns) const;

  std::set<wire::GroomHash> waiting_;
  // The height of the largest head with each groom, as a share of the screen.
  std::map<wire::GroomHash, float> heights_;
  // The groom that is being downloaded; none: the next one may begin.
  std::optional<wire::GroomHash> current_;
  // reports_ counts the calls of set_heights() that had any heights, and calls_ those of next() while grooms wait. Both
  // stop at the numbers that next() waits for.
  int reports_ = 0, calls_ = 0;
  // The time when the first groom began to wait.
  std::optional<std::int64_t> begun_ns_;
};

}  // namespace hairnet::room
