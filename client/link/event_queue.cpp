#include "client/link/event_queue.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::link {
namespace {

// The memory that an event refers to outside of itself. Events without a function of their own have little more than a
// text.
std::size_t content_bytes(const FrameBatch& batch) {
  std::size_t bytes = 0;
  for (const Frame& frame : batch.frames) bytes += sizeof frame + frame.coefficients.size() * sizeof(float);
  return bytes;
}
std::size_t content_bytes(const GroomFetched& fetched) {
  return wire::kTextBytesMax + (fetched.bytes ? fetched.bytes->size() : 0);
}
std::size_t content_bytes(const wire::RoomProps& props) {
  return props.props.size() * sizeof(wire::Prop) + props.removed.size();
}
std::size_t content_bytes(const wire::RoomHands& hands) {
  std::size_t bytes = hands.people.size() * sizeof(wire::RoomHands::Person);
  for (const wire::RoomHands::Person& person : hands.people) {
    for (const Hand& hand : person.hands) bytes += sizeof hand + hand.shapes.size() * sizeof(HandShape);
  }
  return bytes;
}
std::size_t content_bytes(const auto&) {
  return wire::kTextBytesMax;
}

// An estimate that is proportional to the memory is enough to bound it.
std::size_t bytes_of(const Event& event) {
  return sizeof event + std::visit([](const auto& e) { return content_bytes(e); }, event);
}

// Whether the event may be dropped, because later ticks bring newer frames or hands.
bool is_of_one_tick(const Event& event) {
  return std::holds_alternative<FrameBatch>(event) || std::holds_alternative<wire::RoomHands>(event);
}

// The dropped frame of `member` was discontinuous. Marks the next queued frame of that member as discontinuous, so that
// the caller does not interpolate across the gap.
void carry_discontinuity(std::uint32_t member, std::deque<Event>::iterator from, std::deque<Event>::iterator end) {
  for (; from != end; ++from) {
    auto* batch = std::get_if<FrameBatch>(&*from);
    if (!batch) continue;
    const auto next = std::find_if(batch->frames.begin(), batch->frames.end(),
                                   [&](const Frame& frame) { return frame.member == member; });
    if (next == batch->frames.end()) continue;
    next->discontinuous = true;
    return;
  }
}

}  // namespace

void EventQueue::check_invariants() const {
  HAIRNET_ASSERT(frame_bytes_ <= kFrameBytesMax);
  HAIRNET_ASSERT(other_bytes_ <= kOtherBytesMax);
#ifdef HAIRNET_VALIDATE_ON
  std::size_t frame_bytes = 0, other_bytes = 0;
  for (const Event& event : events_) {
    const bool is_last = ended_ && &event == &events_.back();
    if (is_of_one_tick(event)) {
      frame_bytes += bytes_of(event);
    } else if (!is_last) {
      other_bytes += bytes_of(event);
    }
  }
  HAIRNET_ASSERT(frame_bytes == frame_bytes_);
  HAIRNET_ASSERT(other_bytes == other_bytes_);
#endif
}

bool EventQueue::push(Event event) {
  if (ended_) return true;
  const std::size_t bytes = bytes_of(event);
  if (is_of_one_tick(event)) {
    frame_bytes_ += bytes;
    events_.push_back(std::move(event));
    // The new event counts before old ones are dropped, so that the bound holds for any size.
    while (frame_bytes_ > kFrameBytesMax) drop_oldest_frames();
    return true;
  }
  // Other events cannot be dropped: without a MemberJoined the room would stay wrong. The link ends instead.
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
  const auto oldest = std::find_if(events_.begin(), events_.end(), is_of_one_tick);
  // There is one, because its bytes were counted.
  HAIRNET_ASSERT(oldest != events_.end());
  const Event dropped = std::move(*oldest);
  const auto after = events_.erase(oldest);
  HAIRNET_ASSERT(frame_bytes_ >= bytes_of(dropped));
  frame_bytes_ -= bytes_of(dropped);
  const auto* batch = std::get_if<FrameBatch>(&dropped);
  // Hands have no discontinuities to pass on, and are not counted.
  if (!batch) return;
  for (const Frame& frame : batch->frames) {
    if (frame.discontinuous) carry_discontinuity(frame.member, after, events_.end());
  }
  frames_dropped_ += batch->frames.size();
}

std::vector<Event> EventQueue::take_all() {
  check_invariants();
  frame_bytes_ = other_bytes_ = 0;
  std::vector<Event> taken{std::make_move_iterator(events_.begin()), std::make_move_iterator(events_.end())};
  events_.clear();
  return taken;
}

}  // namespace hairnet::link
