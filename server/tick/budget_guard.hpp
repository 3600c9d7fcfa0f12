#pragma once

#include <cstdint>

namespace hairnet::server {

struct TickGuardDef {
  double tick_s = 1.0 / 30;
  double tick_share = 0.7;  // of the tick that its work may take (`--tick-budget`)
  int workers = 1;          // that share the work
};

// Decides how many worker-seconds a tick's predicted work on characters may take, from the measured time of ticks. The
// measured overhead of a tick beside that work is subtracted from its share. Predictions miss the effects of other
// programs and caches; the trust is the learnt ratio of predicted to measured time. Two of four ticks beyond the share
// reduce the trust at once, by as much as they exceeded it; it recovers the faster the further ticks stay below the
// share.
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
