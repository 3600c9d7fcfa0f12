#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <vector>

#include "server/room/outlet.hpp"
#include "server/session/session_counters.hpp"

namespace hairnet::server {

// What waits to be sent to one client. Control messages keep their order within a bound of bytes; of frames there is
// one a character, the newest. The tick and I/O threads push, the I/O thread takes.
class Outbox final : public Outlet {
 public:
  Outbox(std::size_t control_bytes_max, std::size_t frame_packet_bytes_max, SessionCounters& counters);

  void push(const wire::Message& message, std::int64_t now_ns) override;
  void push_frames(std::uint64_t tick, std::int64_t sample_time_ns, std::vector<wire::Frame> frames) override;
  // The session's last word: drops waiting frames, and all that is pushed later.
  void push_goodbye(const wire::Goodbye& goodbye, std::int64_t now_ns);

  // The next packet: control first, then frames of one tick up to the packet bound. False when nothing waits.
  bool take(std::vector<std::uint8_t>& packet, std::int64_t now_ns);

  // A control message did not fit: the client misses it, so the session must end.
  [[nodiscard]] bool overflowed() const;

 private:
  struct WaitingFrame {
    std::uint64_t tick = 0;
    std::int64_t sample_time_ns = 0;
    wire::Frame frame;
  };
  void push_packet(std::vector<std::uint8_t> packet);
  wire::FrameBatch take_frames();

  const std::size_t control_bytes_max_, frame_packet_bytes_max_;
  SessionCounters* counters_;
  mutable std::mutex mutex_;
  std::deque<std::vector<std::uint8_t>> control_;
  std::size_t control_bytes_ = 0;
  std::map<std::uint32_t, WaitingFrame> frames_;
  std::uint32_t turn_ = 0;  // the character to send next, so that a slow client gets all its characters in turn
  bool overflowed_ = false, closed_ = false;
};

}  // namespace hairnet::server
