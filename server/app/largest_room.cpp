#include "server/app/largest_room.hpp"

#include <spdlog/spdlog.h>

namespace hairnet::server {
namespace {

// Two forms of hysteresis, so that a load near the limit does not change the answer all the time. A room needs a server
// of its own until it wants less than 0.8 of own_server_share. An overloaded room counts as fitting only after it has
// fitted for 5 s.
constexpr double kFallsBelow = 0.8;
constexpr std::int64_t kFitsAfter_ns = 5'000'000'000;

}  // namespace

void LargestRoom::observe(const RoomLoad& load, std::int64_t now_ns) {
  room_ = load.room;
  // The time of one room is not measured, since the characters of all rooms share batches of the solver. So the room is
  // assumed to want a part of the server's time in proportion to its characters.
  const double of_characters =
      load.characters == 0 ? 0 : static_cast<double>(load.room_characters) / static_cast<double>(load.characters);
  const double of_server = load.available_s > 0 ? load.wanted_s / load.available_s * of_characters : 0;
  needs_own_server_ = of_server > own_server_share_ * (needs_own_server_ ? kFallsBelow : 1);
  // Where many rooms fill the server together, none of them overloads it alone.
  if (load.is_over && needs_own_server_ && of_characters > own_server_share_) {
    over_ns_ = now_ns;
    if (overloaded_ == load.room) return;
    overloaded_ = load.room;
    spdlog::warn("event=room_overloaded room=\"{}\" characters={}", overloaded_, load.room_characters);
  } else if (!overloaded_.empty() && now_ns - over_ns_ >= kFitsAfter_ns) {
    spdlog::warn("event=room_fits room=\"{}\"", overloaded_);
    overloaded_.clear();
  }
}

}  // namespace hairnet::server
