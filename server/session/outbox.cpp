#include "server/session/outbox.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {

Outbox::Outbox(std::size_t control_bytes_max, SessionCounters& counters, std::size_t datagram_bytes_max)
    : control_bytes_max_(control_bytes_max), datagram_bytes_max_(datagram_bytes_max), counters_(&counters) {
  HAIRNET_ASSERT(control_bytes_max > 0);
}

void Outbox::check_invariants() const {
  HAIRNET_ASSERT(control_bytes_ <= control_bytes_max_);
  // Every waiting tick has at least one packet, and every map entry names one packet of its own.
  HAIRNET_ASSERT(ticks_waiting_ <= waiting_.size());
  HAIRNET_ASSERT(joined_.size() + replaceable_.size() <= waiting_.size());
#ifdef HAIRNET_VALIDATE_ON
  std::size_t message_bytes = 0, ticks = 0;
  std::uint64_t tick = 0;
  for (const Waiting& waiting : waiting_) {
    HAIRNET_ASSERT(waiting.tick != 0 || waiting.frame_count == 0);
    if (waiting.tick == 0) {
      message_bytes += waiting.packet.size();
    } else {
      HAIRNET_ASSERT(waiting.tick >= tick);
      ticks += waiting.tick > tick ? 1 : 0;
      tick = waiting.tick;
    }
  }
  // The goodbye is not counted: it must fit, whatever waits.
  HAIRNET_ASSERT(closed_ ? control_bytes_ <= message_bytes : control_bytes_ == message_bytes);
  HAIRNET_ASSERT(ticks == ticks_waiting_);
  HAIRNET_ASSERT(tick <= last_tick_);
#endif
}

// The message is encoded before the lock is taken, so the other thread never waits for an encoding.
void Outbox::push(const wire::Message& message, std::int64_t now_ns) {
  push_encoded(message, wire::encode_packet({now_ns, message}), now_ns);
}

void Outbox::push_encoded(const wire::Message& message, std::vector<std::uint8_t> packet, std::int64_t now_ns) {
  HAIRNET_ASSERT(!packet.empty());
  // An older client does not know the message. The numbers of messages count from 1, those of the variant from 0.
  if (message.index() >= message_max_) return;
  if (std::holds_alternative<wire::Error>(message)) counters_->errors_sent.add();
  const std::lock_guard lock(mutex_);
  const auto* left = std::get_if<wire::MemberLeft>(&message);
  // The member's announcement is cancelled before closed_ and overflowed_ are asked: joined_ must forget it in any
  // case.
  if (left && cancel_joined(left->member)) return;
  if (closed_ || overflowed_) return;
  const Replaceable replaceable = replaceable_of(message);
  cancel_replaced(replaceable);
  // A message that is dropped would leave the client with a wrong picture of the room for good, so the session ends
  // instead.
  if (control_bytes_ + packet.size() > control_bytes_max_) {
    overflowed_ = true;
    return;
  }
  Waiting& last = waiting_.emplace_back();
  // A long queue takes time even for a client that reads well. The message is overdue only after the bytes before it
  // had their time.
  last.expected_ns =
      now_ns + static_cast<std::int64_t>(1e9 * static_cast<double>(control_bytes_) / kReadLeast_bytes_per_s);
  control_bytes_ += packet.size();
  last.packet = std::move(packet);
  if (const auto* joined = std::get_if<wire::MemberJoined>(&message)) {
    last.joined_member = joined->member;
    last.joined_in_tick = last_tick_;
    joined_[joined->member] = std::prev(waiting_.end());
  }
  last.replaceable = replaceable;
  if (replaceable.member != 0) replaceable_[replaceable] = std::prev(waiting_.end());
  check_invariants();
}

bool Outbox::cancel_joined(std::uint32_t member) {
  const auto found = joined_.find(member);
  if (found == joined_.end()) return false;
  const Queue::iterator joined = found->second;
  joined_.erase(found);
  // On a connection that takes packets the pair of messages leaves soon, and removing one would save nothing.
  if (!is_blocked_ || closed_) return false;
  // The frames of ticks after the announcement may contain frames of the member. The packets are encoded, so all frames
  // that wait are dropped.
  if (ticks_waiting_ > 0 && last_tick_ > joined->joined_in_tick) {
    drop_frames();
    frames_lost_ = true;
  }
  // The client never learns of this member, so the other messages about the member must go, too.
  cancel_replaced(replaceable_of(wire::MemberChanged{.member = member}));
  cancel_replaced(replaceable_of(wire::MemberTouch{.member = member}));
  erase_message(joined);
  return true;
}

Outbox::Replaceable Outbox::replaceable_of(const wire::Message& message) {
  if (const auto* changed = std::get_if<wire::MemberChanged>(&message)) return {message.index(), changed->member};
  if (const auto* touch = std::get_if<wire::MemberTouch>(&message)) return {message.index(), touch->member};
  return {};
}

void Outbox::cancel_replaced(const Replaceable& newer) {
  const auto found = replaceable_.find(newer);
  if (found == replaceable_.end()) return;
  const Queue::iterator replaced = found->second;
  replaceable_.erase(found);
  erase_message(replaced);
}

void Outbox::erase_message(Queue::iterator message) {
  HAIRNET_ASSERT(control_bytes_ >= message->packet.size());
  control_bytes_ -= message->packet.size();
  waiting_.erase(message);
  counters_->messages_cancelled.add();
  check_invariants();
}

void Outbox::push_frames(std::vector<FramePacket> packets) {
  if (packets.empty()) return;
  const std::lock_guard lock(mutex_);
  if (closed_ || overflowed_) return;
  ++last_tick_;
  ++ticks_waiting_;
  for (const FramePacket& packet : packets) {
    HAIRNET_ASSERT(!packet.bytes.empty());
    HAIRNET_ASSERT(!packet.may_be_lost || packet.bytes.size() <= datagram_bytes_max_);
  }
  for (FramePacket& packet : packets) {
    Waiting& last = waiting_.emplace_back();
    last.packet = std::move(packet.bytes);
    last.tick = last_tick_;
    last.frame_count = packet.frame_count;
    last.may_be_lost = packet.may_be_lost;
  }
  check_invariants();
}

bool Outbox::drop_if_congested() {
  const std::lock_guard lock(mutex_);
  // frames_lost_ is exchanged even when the queue is full, so that each loss is reported once.
  const bool is_full = ticks_waiting_ >= (is_blocked_ ? kTicksWaitingMax : kTicksUnseenMax);
  if (!std::exchange(frames_lost_, false) && !is_full) return false;
  drop_frames();
  return true;
}

// The I/O thread calls this, while the tick may push: the flag carries the loss to the tick's thread.
void Outbox::withdraw_frames() {
  const std::lock_guard lock(mutex_);
  frames_lost_ |= ticks_waiting_ > 0;
  drop_frames();
}

// The predicate also counts, so it visits every packet; messages have a frame count of 0.
void Outbox::drop_frames() {
  std::erase_if(waiting_, [this](const Waiting& waiting) {
    counters_->frames_superseded.add(waiting.frame_count);
    return waiting.tick != 0;
  });
  ticks_waiting_ = 0;
  check_invariants();
}

void Outbox::push_goodbye(const wire::Goodbye& goodbye, std::int64_t now_ns) {
  std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, goodbye});
  const std::lock_guard lock(mutex_);
  drop_frames();
  // After an overflow the whole queue is dropped: the client has lost a message, and its session ends with the goodbye
  // alone.
  if (overflowed_) {
    waiting_.clear();
    joined_.clear();
    replaceable_.clear();
    control_bytes_ = 0;
    overflowed_ = false;
  }
  if (!closed_) waiting_.emplace_back().packet = std::move(packet);
  closed_ = true;
  check_invariants();
}

bool Outbox::take(std::vector<std::uint8_t>& packet, bool& may_be_lost, std::int64_t now_ns) {
  {
    const std::lock_guard lock(mutex_);
    // The caller takes only while the connection is writable.
    is_blocked_ = false;
    if (waiting_.empty()) return false;
    may_be_lost = waiting_.front().may_be_lost;
    packet = take_out(waiting_.begin());
  }
  // The packet gets the time of sending, not that of encoding: the client estimates the server's clock and the delay of
  // the network from it, and the wait in this queue is no part of that delay.
  wire::set_clock(packet, now_ns);
  return true;
}

bool Outbox::take_unreliable(std::vector<std::uint8_t>& packet, std::int64_t now_ns) {
  {
    const std::lock_guard lock(mutex_);
    const auto first = std::ranges::find(waiting_, true, &Waiting::may_be_lost);
    if (first == waiting_.end()) return false;
    packet = take_out(first);
  }
  wire::set_clock(packet, now_ns);
  return true;
}

std::vector<std::uint8_t> Outbox::take_out(Queue::iterator taken) {
  std::vector<std::uint8_t> packet = std::move(taken->packet);
  if (taken->tick == 0) {
    // The minimum is for the goodbye, which was not counted.
    control_bytes_ -= std::min(control_bytes_, packet.size());
  } else {
    counters_->frames_sent.add(taken->frame_count);
    // The packets of one tick are pushed together, so they are adjacent.
    const auto is_of_tick = [&](Queue::iterator other) { return other->tick == taken->tick; };
    const bool is_last = !(taken != waiting_.begin() && is_of_tick(std::prev(taken))) &&
                         !(std::next(taken) != waiting_.end() && is_of_tick(std::next(taken)));
    HAIRNET_ASSERT(ticks_waiting_ > 0);
    // take_unreliable() takes packets out of the middle, so the tick ends with whichever packet of it leaves last.
    if (is_last) --ticks_waiting_;
  }
  const auto joined = joined_.find(taken->joined_member);
  // A later announcement of the same member number may wait behind this one; then the map names that one.
  if (joined != joined_.end() && joined->second == taken) joined_.erase(joined);
  replaceable_.erase(taken->replaceable);
  waiting_.erase(taken);
  check_invariants();
  return packet;
}

void Outbox::mark_blocked() {
  const std::lock_guard lock(mutex_);
  is_blocked_ = true;
}

bool Outbox::overflowed() const {
  const std::lock_guard lock(mutex_);
  return overflowed_;
}

bool Outbox::is_overdue(std::int64_t now_ns, std::int64_t wait_ns) const {
  const std::lock_guard lock(mutex_);
  // Frames do not count: they are dropped when they are old, and their wait says nothing about the client's messages.
  const auto message = std::ranges::find(waiting_, std::uint64_t{0}, &Waiting::tick);
  return message != waiting_.end() && now_ns - message->expected_ns > wait_ns;
}

std::size_t Outbox::packet_count() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

std::size_t Outbox::control_bytes_waiting() const {
  const std::lock_guard lock(mutex_);
  return control_bytes_;
}

std::size_t Outbox::bytes_waiting() const {
  const std::lock_guard lock(mutex_);
  std::size_t bytes = 0;
  for (const Waiting& waiting : waiting_) bytes += waiting.packet.size();
  return bytes;
}

std::size_t Outbox::ticks_waiting() const {
  const std::lock_guard lock(mutex_);
  return ticks_waiting_;
}

}  // namespace hairnet::server
