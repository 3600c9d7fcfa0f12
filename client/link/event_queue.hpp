#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "client/link/events.hpp"

namespace hairnet::link {

// What arrived and was not yet taken, in order. One thread. Bounded: the oldest frames give way and are counted.
class EventQueue {
 public:
  static constexpr std::size_t kFrameBytesMax = std::size_t{32} << 20;
  static constexpr std::size_t kOtherBytesMax = std::size_t{256} << 20;

  // False when all that is not frames has outgrown its bound; the event is then lost.
  [[nodiscard]] bool push(Event event);
  // The last event; always taken, and nothing after it.
  void push_last(Disconnected event);
  std::vector<Event> take_all();
  [[nodiscard]] std::uint64_t frames_dropped() const { return frames_dropped_; }

 private:
  void drop_oldest_frames();

  std::deque<Event> events_;
  std::size_t frame_bytes_ = 0, other_bytes_ = 0;
  std::uint64_t frames_dropped_ = 0;
  bool ended_ = false;
};

}  // namespace hairnet::link
