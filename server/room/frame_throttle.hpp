#pragma once

#include <cstddef>

namespace hairnet::server {

// Fits the frames of one connection to a number of bytes a second. Where they need more, hair becomes coarser first;
// then frames are sent at every second tick, then at every fourth. Tick thread.
class FrameThrottle {
 public:
  // The connection lost frames: it carries less than what was sent.
  void on_lost_frames();
  // After each tick: what was sent, and how much a second the client asks for at most (0: any number) and its network
  // carries (0: unknown).
  void end_tick(std::size_t sent_bytes, double tick_s, double client_bytes_per_s, double network_bytes_per_s);

  [[nodiscard]] int coarser_octaves() const;  // 2^this times the error that is wanted
  [[nodiscard]] int stride() const;           // ticks from frame to frame, at least

 private:
  void end_window(double client_bytes_per_s, double network_bytes_per_s);

  int rung_ = 0;                            // 0: as wanted
  double window_s_ = 0, window_bytes_ = 0;  // since the last choice of a rung
  double rate_ = 0;                         // bytes a second of the last whole window
  double carried_bytes_per_s_ = 0;          // what a connection that lost frames carries, about; 0: it lost none
};

}  // namespace hairnet::server
