#include "server/room/frame_throttle.hpp"

#include <algorithm>
#include <array>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// One step of the ladder, finest first: frames may have 2^coarser_octaves times the wanted error, and are sent at every
// `stride`th tick.
struct Rung {
  int coarser_octaves, stride;
  // The rung takes about this share of the bytes that the rung before takes.
  double share;
};
// The error grows to 8 times at most: then a frame has hardly more than the pose, and only fewer frames save bytes.
constexpr std::array<Rung, 6> kRungs{{{0, 1, 1}, {1, 1, 0.7}, {2, 1, 0.7}, {3, 1, 0.7}, {3, 2, 0.5}, {3, 4, 0.5}}};
constexpr int kCoarsest = kRungs.size() - 1;
// A finer rung is taken only if it would need less than this part of the bytes that are allowed. Without the reserve
// the throttle would go back at the next window.
constexpr double kReserve = 0.9;
// After a loss the connection is assumed to carry this share of what was sent.
constexpr double kLostShare = 0.7;
// Frames may take this share of what the network carries: messages, files and the headers of packets need the rest.
constexpr double kNetworkShare = 0.8;
// A rung is chosen once in this time. A shorter window has too few frames to tell a rate; a longer one reacts late.
constexpr double kWindow_s = 0.4;
// Nobody knows how much a connection carries that has lost frames. So its estimate grows by 5 % in each window of 0.4
// s, which doubles it within 6 s.
constexpr double kGrowth = 1.05;

}  // namespace

void FrameThrottle::on_lost_frames() {
  // The window under way may have begun with a burst, or the last one may be old: the larger rate keeps one loss from
  // pushing the estimate too low.
  carried_bytes_per_s_ = kLostShare * std::max(rate_, window_s_ > 0 ? window_bytes_ / window_s_ : 0.0);
  rung_ = std::min(rung_ + 1, kCoarsest);
  window_s_ = window_bytes_ = 0;
}

void FrameThrottle::end_tick(std::size_t sent_bytes, double tick_s, double client_bytes_per_s,
                             double network_bytes_per_s) {
  HAIRNET_ASSERT(tick_s > 0);
  HAIRNET_ASSERT(client_bytes_per_s >= 0);
  HAIRNET_ASSERT(network_bytes_per_s >= 0);
  window_s_ += tick_s;
  window_bytes_ += static_cast<double>(sent_bytes);
  if (window_s_ >= kWindow_s) end_window(client_bytes_per_s, network_bytes_per_s);
}

void FrameThrottle::end_window(double client_bytes_per_s, double network_bytes_per_s) {
  rate_ = window_bytes_ / window_s_;
  window_s_ = window_bytes_ = 0;
  carried_bytes_per_s_ *= kGrowth;
  // The smallest known bound counts. For each bound, and for the result, 0 means unknown.
  double most = 0;
  for (const double bound : {client_bytes_per_s, carried_bytes_per_s_, kNetworkShare * network_bytes_per_s}) {
    if (bound > 0) most = most > 0 ? std::min(most, bound) : bound;
  }
  if (most > 0 && rate_ > most) {
    rung_ = std::min(rung_ + 1, kCoarsest);
  } else if (most == 0 || rate_ < kReserve * kRungs[static_cast<std::size_t>(rung_)].share * most) {
    // The next finer rung takes 1 / share times the bytes of this one. It is taken only if that fits with a reserve, or
    // the rung would change in each window.
    rung_ = std::max(rung_ - 1, 0);
    // At the finest rung nothing is held back, so the estimate has no more use; a new loss makes a new one.
    if (rung_ == 0) carried_bytes_per_s_ = 0;
  }
}

int FrameThrottle::coarser_octaves() const {
  return kRungs[static_cast<std::size_t>(rung_)].coarser_octaves;
}

int FrameThrottle::stride() const {
  return kRungs[static_cast<std::size_t>(rung_)].stride;
}

}  // namespace hairnet::server
