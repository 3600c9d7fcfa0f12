#pragma once

#include <cstdint>

namespace hairnet::server {

struct TickGuardDef {
  double tick_s = 1.0 / 30;
  double tick_share = 0.7;  // of the tick that its work may take (`--tick-budget`)
  int workers = 1;          // that share the work
};

// How many worker-seconds a tick's work on characters may be predicted to take, from how long ticks really took. What a
// tick takes beside that work, as measured, comes off its share. Predictions miss what nobody measures (other programs,
// caches): their ratio to the truth is a trust that is learnt here. Two ticks of four beyond the share cut it at once,
// by as much as they were beyond; it comes back the faster the further ticks stay within the share.
//
// Noise makes some ticks overrun even when the mean is on target. Each overrun widens a safety margin a little. The
// margin narrows so slowly that a few overruns in ten thousand ticks keep it constant. It applies only where more work
// is wanted than fits; when all of it fits, there is no margin.
class TickGuard {
 public:
  explicit TickGuard(const TickGuardDef& def);

  // From the tick's begin to its end, and of all workers what was spent on characters (steps, encoding, sending); s.
  // `wanted_s`: what everyone as finely as asked for would take, as predicted.
  void observe(double tick_duration_s, double work_s, double wanted_s);
  [[nodiscard]] double available_s() const;

 private:
  void choose_share(double wanted_s);
  [[nodiscard]] double full_s() const { return def_.tick_share * def_.tick_s * def_.workers; }

  TickGuardDef def_;
  double trust_ = 1;
  double margin_factor_ = 1;  // of the share, but for the margin where it is needed
  double share_;              // of a tick, that is aimed at
  int calm_ticks_ = 0;        // since the margin was last widened, counted as far as it matters
  double overhead_s_ = 0;     // worker-seconds of a tick that are not work on characters, smoothed
  std::uint8_t recent_ = 0;   // a bit a tick, newest lowest: beyond the share
};

}  // namespace hairnet::server
