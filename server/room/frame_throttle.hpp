#pragma once

#include <cstddef>

namespace hairnet::server {

// Fits the frames of one connection to a number of bytes a second. Where the frames need more, their error is doubled
// first, up to three times; then frames are sent at every second tick, then at every fourth. The throttle treats all
// members of the room alike; interest.hpp and Publisher decide which members a session sees, and how finely. Tick
// thread.
class FrameThrottle {
 public:
  // The outbox has dropped frames, because the connection carries less than was sent.
  void on_lost_frames();
  // Call it after each tick with the bytes that were sent. `client_bytes_per_s` is what the client asks for at most (0:
  // it sets no bound), `network_bytes_per_s` what the connection's congestion control lets through (0: unknown).
  void end_tick(std::size_t sent_bytes, double tick_s, double client_bytes_per_s, double network_bytes_per_s);

  // Frames may err by 2^this times the error that the client wants.
  [[nodiscard]] int coarser_octaves() const;
  // At least this many ticks pass from frame to frame.
  [[nodiscard]] int stride() const;

 private:
  // Chooses the rung by the bytes of the window that has just ended.
  void end_window(double client_bytes_per_s, double network_bytes_per_s);

  // The rung of the ladder in frame_throttle.cpp; 0: frames are as wanted.
  int rung_ = 0;
  // Time and bytes since the last choice of a rung.
  double window_s_ = 0, window_bytes_ = 0;
  // Bytes a second of the last whole window.
  double rate_ = 0;
  // An estimate of what a connection that has lost frames carries; 0: there was no loss since the throttle was last at
  // rung 0.
  double carried_bytes_per_s_ = 0;
};

}  // namespace hairnet::server
