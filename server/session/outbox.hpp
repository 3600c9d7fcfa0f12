#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <vector>

#include "server/exchange/observer_sink.hpp"
#include "server/session/session_counters.hpp"

namespace hairnet::server {

// The send queue of one session: messages, bounded in bytes, and the frames of a few ticks, in order. Frames are
// predicted from earlier frames, so a full queue drops all of them together. The tick and I/O threads push; the I/O
// thread takes.
class Outbox final : public ObserverSink {
 public:
  static constexpr std::size_t kTicksWaitingMax = 3;  // while the connection is blocked
  // The bound while the I/O thread has not tried to send. A late server runs several ticks without a pause, which does
  // not mean that the client is slow.
  static constexpr std::size_t kTicksUnseenMax = 8;

  Outbox(std::size_t control_bytes_max, SessionCounters& counters);

  // Asserts that the message fits a packet: the server sends none that does not.
  void push(const wire::Message& message, std::int64_t now_ns) override;
  void push_frames(std::vector<FramePacket> packets) override;
  bool drop_if_congested() override;
  // Queues the goodbye as the last packet: drops the frames that wait, and everything pushed later.
  void push_goodbye(const wire::Goodbye& goodbye, std::int64_t now_ns);

  // The next packet, its clock set to `now_ns`. False when nothing waits.
  bool take(std::vector<std::uint8_t>& packet, std::int64_t now_ns);
  // Call it when the connection is not writable. The next take() resets it.
  void mark_blocked();

  // A message did not fit: the client misses it, so the session must end.
  [[nodiscard]] bool overflowed() const;
  [[nodiscard]] std::size_t packet_count() const;
  [[nodiscard]] std::size_t control_bytes_waiting() const;
  [[nodiscard]] std::size_t ticks_waiting() const;

 private:
  struct Waiting {
    std::vector<std::uint8_t> packet;
    std::uint64_t tick = 0;  // counts pushes of frames; 0: a message
    std::size_t frame_count = 0;
  };
  void push_packet(std::vector<std::uint8_t> packet);
  void drop_frames();
  // The mutex is held.
  void check_invariants() const;

  const std::size_t control_bytes_max_;
  SessionCounters* counters_;
  mutable std::mutex mutex_;
  std::deque<Waiting> waiting_;
  std::size_t control_bytes_ = 0;
  std::uint64_t last_tick_ = 0;
  std::size_t ticks_waiting_ = 0;
  bool overflowed_ = false, closed_ = false, is_blocked_ = false;
};

}  // namespace hairnet::server
