#include "server/session/outbox.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::server {
Outbox::Outbox(std::size_t control_bytes_max, std::size_t frame_packet_bytes_max, SessionCounters& counters)
    : control_bytes_max_(control_bytes_max), frame_packet_bytes_max_(frame_packet_bytes_max), counters_(&counters) {}

void Outbox::push(const wire::Message& message, std::int64_t now_ns) {
  std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, message});
  if (std::holds_alternative<wire::Error>(message)) counters_->errors_sent.add();
  const std::lock_guard lock(mutex_);
  if (const auto* removed = std::get_if<wire::CharacterRemoved>(&message)) frames_.erase(removed->character);
  push_packet(std::move(packet));
}

void Outbox::push_packet(std::vector<std::uint8_t> packet) {
  if (closed_ || overflowed_) return;
  if (control_bytes_ + packet.size() > control_bytes_max_) {
    overflowed_ = true;
    return;
  }
  control_bytes_ += packet.size();
  control_.push_back(std::move(packet));
}

void Outbox::push_frames(std::uint64_t tick, std::int64_t sample_time_ns, std::vector<wire::Frame> frames) {
  const std::lock_guard lock(mutex_);
  if (closed_ || overflowed_) return;
  for (wire::Frame& frame : frames) {
    const auto [waiting, is_new] = frames_.try_emplace(frame.character);
    if (!is_new) {
      counters_->frames_superseded.add();
      // What the client never saw to be discontinuous still is, seen from the frame it did get.
      frame.discontinuous |= waiting->second.frame.discontinuous;
    }
    waiting->second = {tick, sample_time_ns, std::move(frame)};
  }
}

void Outbox::push_goodbye(const wire::Goodbye& goodbye, std::int64_t now_ns) {
  std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, goodbye});
  const std::lock_guard lock(mutex_);
  frames_.clear();
  if (overflowed_) {
    control_.clear();
    control_bytes_ = 0;
    overflowed_ = false;
  }
  if (!closed_) control_.push_back(std::move(packet));
  closed_ = true;
}

bool Outbox::take(std::vector<std::uint8_t>& packet, std::int64_t now_ns) {
  wire::FrameBatch batch;
  {
    const std::lock_guard lock(mutex_);
    if (!control_.empty()) {
      packet = std::move(control_.front());
      control_.pop_front();
      control_bytes_ -= std::min(control_bytes_, packet.size());
      return true;
    }
    if (frames_.empty()) return false;
    batch = take_frames();
  }
  counters_->frames_sent.add(batch.frames.size());
  packet = wire::encode_packet({now_ns, std::move(batch)});
  return true;
}

wire::FrameBatch Outbox::take_frames() {
  auto next = frames_.lower_bound(turn_);
  if (next == frames_.end()) next = frames_.begin();
  wire::FrameBatch batch{next->second.tick, next->second.sample_time_ns, {}};
  std::size_t bytes = 0;
  while (!frames_.empty()) {
    bytes += wire::frame_bytes(next->second.frame);
    if (!batch.frames.empty() && (bytes > frame_packet_bytes_max_ || next->second.tick != batch.tick)) break;
    turn_ = next->first + 1;
    batch.frames.push_back(std::move(next->second.frame));
    next = frames_.erase(next);
    if (next == frames_.end()) next = frames_.begin();
  }
  return batch;
}

bool Outbox::overflowed() const {
  const std::lock_guard lock(mutex_);
  return overflowed_;
}

}  // namespace hairnet::server
