#pragma once

#include <cstddef>

namespace hairnet::server {

// Fits the frames of one connection to a number of bytes a second. Where they need more, hair becomes coarser first;
// then frames are sent at every second tick, then at every fourth. It treats all members alike: what a session sees of
// whom is decided elsewhere (interest, Publisher). Tick thread.
class FrameThrottle {
 public:
  // The connection lost frames: it carries less than what was sent.
  void on_lost_frames();
  // After each tick: what was sent, and how much a second the client asks for at most (0: any number) and its network
  // carries (0: unknown).
  void end_tick(std::size_t sent_bytes, double tick_s, double client_bytes_per_s, double network_bytes_per_s);

  // Frames may err by 2^this times the error that the client wants.
  [[nodiscard]] int coarser_octaves() const;
  // At least this many ticks pass from frame to frame.
  [[nodiscard]] int stride() const;

 private:
  void end_window(double client_bytes_per_s, double network_bytes_per_s);

  // The rung of the ladder in frame_throttle.cpp; 0: frames are as wanted.
  int rung_ = 0;
  // Time and bytes since the last choice of a rung.
  double window_s_ = 0, window_bytes_ = 0;
  // Bytes a second of the last whole window.
  double rate_ = 0;
  // What a connection that lost frames carries, about; 0: it lost none lately.
  double carried_bytes_per_s_ = 0;
};

}  // namespace hairnet::server
