#include "server/app/largest_room.hpp"

#include <spdlog/spdlog.h>

namespace hairnet::server {
namespace {

// A load near the limit must not change the answer all the time: a room keeps its need of a server of its own until it
// wants less than this part of the share, and an overloaded room fits again only after some time.
constexpr double kFallsBelow = 0.8;
constexpr std::int64_t kFitsAfter_ns = 5'000'000'000;

}  // namespace

void LargestRoom::observe(const RoomLoad& load, std::int64_t now_ns) {
  room_ = load.room;
  // Nobody measures the time of one room: characters of all rooms share batches of the solver.
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
