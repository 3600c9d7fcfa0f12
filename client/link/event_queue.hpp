#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "client/link/events.hpp"

namespace hairnet::link {

// Events that the caller has not taken yet, in order. The queue is bounded: it drops the oldest frames and
// hands of others first, and counts the frames. One thread.
class EventQueue {
 public:
  // Bounds frames and hands together.
  static constexpr std::size_t kFrameBytesMax = std::size_t{32} << 20;
  static constexpr std::size_t kOtherBytesMax = std::size_t{256} << 20;

  // Returns false, and drops the event, when the events other than frames and hands exceed kOtherBytesMax.
  [[nodiscard]] bool push(Event event);
  // Adds the last event. The queue always accepts it, and ignores every later event.
  void push_last(Disconnected event);
  std::vector<Event> take_all();
  [[nodiscard]] std::uint64_t frames_dropped() const { return frames_dropped_; }

 private:
  void drop_oldest_frames();
  void check_invariants() const;

  std::deque<Event> events_;
  // The bytes in `events_` of frames and hands, and of all other events.
  std::size_t frame_bytes_ = 0, other_bytes_ = 0;
  std::uint64_t frames_dropped_ = 0;
  // Whether the last event was added.
  bool ended_ = false;
};

}  // namespace hairnet::link
