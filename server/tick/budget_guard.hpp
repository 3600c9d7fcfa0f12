#pragma once

#include <cstdint>

namespace hairnet::server {

struct TickGuardDef {
  double tick_s = 1.0 / 30;
  double tick_share = 0.7;  // of the tick that its work may take (`--tick-budget`)
  int workers = 1;          // that share the work
};

// How many worker-seconds a tick's work may be predicted to take, from how long ticks really took. Predictions miss
// what nobody measures (other programs, caches, the scheduler): their ratio to the truth is what is learnt here. Two
// ticks of four beyond the share cut it at once, by as much as they were beyond; it comes back by a tenth a second
// while ticks stay well within the share.
class TickGuard {
 public:
  explicit TickGuard(const TickGuardDef& def);

  void take(double tick_duration_s);  // from the tick's begin to its end, s
  [[nodiscard]] double available_s() const;
  [[nodiscard]] std::uint64_t overruns() const { return overruns_; }  // ticks longer than a tick may last

 private:
  TickGuardDef def_;
  double trust_ = 1;
  std::uint8_t recent_ = 0;  // a bit a tick, newest lowest: beyond the share
  std::uint64_t overruns_ = 0;
};

}  // namespace hairnet::server
