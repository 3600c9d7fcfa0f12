#include "client/link/event_queue.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace hairnet::link {
namespace {

std::size_t bytes_of(const wire::FrameBatch& batch) {
  std::size_t bytes = sizeof(Event);
  for (const wire::Frame& frame : batch.frames)
    bytes += sizeof frame + frame.displacements.size() * sizeof(frame.displacements[0]);
  return bytes;
}

std::size_t bytes_of(const Event& event) {
  const auto* record = std::get_if<wire::LevelRecord>(&event);
  if (!record) return sizeof(Event) + wire::kTextBytesMax;
  const LevelGeometry& g = record->geometry;
  return sizeof(Event) + 4 * (g.active_nodes.size() + g.trimmed_nodes.size() + g.trimmed_begin.size() +
                              g.trimmed_from.size() + g.trimmed_weights.size());
}

// A jump that the reader never sees still parts the frames around it.
void pass_on_discontinuities(const wire::FrameBatch& dropped, wire::FrameBatch& next) {
  for (const wire::Frame& frame : dropped.frames) {
    if (!frame.discontinuous) continue;
    for (wire::Frame& later : next.frames) later.discontinuous |= later.character == frame.character;
  }
}

}  // namespace

bool EventQueue::push(Event event) {
  if (ended_) return true;
  if (const auto* batch = std::get_if<wire::FrameBatch>(&event)) {
    frame_bytes_ += bytes_of(*batch);
    events_.push_back(std::move(event));
    while (frame_bytes_ > kFrameBytesMax) drop_oldest_frames();
    return true;
  }
  const std::size_t bytes = bytes_of(event);
  if (other_bytes_ + bytes > kOtherBytesMax) return false;
  other_bytes_ += bytes;
  events_.push_back(std::move(event));
  return true;
}

void EventQueue::push_last(Disconnected event) {
  if (ended_) return;
  ended_ = true;
  events_.emplace_back(std::move(event));
}

void EventQueue::drop_oldest_frames() {
  const auto holds_frames = [](const Event& e) { return std::holds_alternative<wire::FrameBatch>(e); };
  const auto oldest = std::find_if(events_.begin(), events_.end(), holds_frames);
  const wire::FrameBatch dropped = std::get<wire::FrameBatch>(std::move(*oldest));
  const auto next = std::find_if(events_.erase(oldest), events_.end(), holds_frames);
  if (next != events_.end()) pass_on_discontinuities(dropped, std::get<wire::FrameBatch>(*next));
  frame_bytes_ -= bytes_of(dropped);
  frames_dropped_ += dropped.frames.size();
}

std::vector<Event> EventQueue::take_all() {
  frame_bytes_ = other_bytes_ = 0;
  std::vector<Event> taken{std::make_move_iterator(events_.begin()), std::make_move_iterator(events_.end())};
  events_.clear();
  return taken;
}

}  // namespace hairnet::link
