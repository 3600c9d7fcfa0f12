#include "server/session/outbox.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::server {

Outbox::Outbox(std::size_t control_bytes_max, SessionCounters& counters)
    : control_bytes_max_(control_bytes_max), counters_(&counters) {}

void Outbox::push(const wire::Message& message, std::int64_t now_ns) {
  std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, message});
  if (std::holds_alternative<wire::Error>(message)) counters_->errors_sent.add();
  const std::lock_guard lock(mutex_);
  push_packet(std::move(packet));
}

void Outbox::push_packet(std::vector<std::uint8_t> packet) {
  if (closed_ || overflowed_) return;
  if (control_bytes_ + packet.size() > control_bytes_max_) {
    overflowed_ = true;
    return;
  }
  control_bytes_ += packet.size();
  waiting_.push_back({std::move(packet), 0, 0});
}

void Outbox::push_frames(std::vector<FramePacket> packets) {
  if (packets.empty()) return;
  const std::lock_guard lock(mutex_);
  if (closed_ || overflowed_) return;
  ++last_tick_;
  ++ticks_waiting_;
  for (FramePacket& packet : packets) waiting_.push_back({std::move(packet.bytes), last_tick_, packet.frame_count});
}

bool Outbox::drop_if_congested() {
  const std::lock_guard lock(mutex_);
  if (ticks_waiting_ < (is_blocked_ ? kTicksWaitingMax : kTicksUnseenMax)) return false;
  drop_frames();
  return true;
}

void Outbox::drop_frames() {
  std::erase_if(waiting_, [this](const Waiting& waiting) {
    counters_->frames_superseded.add(waiting.frame_count);
    return waiting.tick != 0;
  });
  ticks_waiting_ = 0;
}

void Outbox::push_goodbye(const wire::Goodbye& goodbye, std::int64_t now_ns) {
  std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, goodbye});
  const std::lock_guard lock(mutex_);
  drop_frames();
  if (overflowed_) {
    waiting_.clear();
    control_bytes_ = 0;
    overflowed_ = false;
  }
  if (!closed_) waiting_.push_back({std::move(packet), 0, 0});
  closed_ = true;
}

bool Outbox::take(std::vector<std::uint8_t>& packet, std::int64_t now_ns) {
  {
    const std::lock_guard lock(mutex_);
    is_blocked_ = false;
    if (waiting_.empty()) return false;
    Waiting& first = waiting_.front();
    packet = std::move(first.packet);
    if (first.tick == 0) {
      control_bytes_ -= std::min(control_bytes_, packet.size());
    } else {
      counters_->frames_sent.add(first.frame_count);
      // The packets of one tick are pushed together, so they are adjacent.
      if (waiting_.size() == 1 || waiting_[1].tick != first.tick) --ticks_waiting_;
    }
    waiting_.pop_front();
  }
  wire::set_clock(packet, now_ns);
  return true;
}

void Outbox::mark_blocked() {
  const std::lock_guard lock(mutex_);
  is_blocked_ = true;
}

bool Outbox::overflowed() const {
  const std::lock_guard lock(mutex_);
  return overflowed_;
}

std::size_t Outbox::packet_count() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

std::size_t Outbox::control_bytes_waiting() const {
  const std::lock_guard lock(mutex_);
  return control_bytes_;
}

std::size_t Outbox::ticks_waiting() const {
  const std::lock_guard lock(mutex_);
  return ticks_waiting_;
}

}  // namespace hairnet::server
