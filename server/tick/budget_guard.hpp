#pragma once

#include <cstdint>

namespace hairnet::server {

struct TickGuardDef {
  double tick_s = 1.0 / 30;
  // The share of a tick that its work may take (`--tick-budget`).
  double tick_share = 0.7;
  // The number of threads that share the work.
  int workers = 1;
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

  // Observes one tick, with all times in s. `tick_duration_s` is the time from its begin to its end. `work_s` is what
  // all workers together spent on characters (steps, encoding, sending). `wanted_s` is the predicted time if every
  // character had the level for which its owner asked.
  void observe(double tick_duration_s, double work_s, double wanted_s);
  // The worker-seconds that the next tick's predicted work on characters may take; always above zero.
  [[nodiscard]] double available_s() const;

 private:
  void check_invariants() const;
  // Sets share_ for the next ticks.
  void choose_share(double wanted_s);
  // The worker-seconds of a tick's share without trust, overhead and margin.
  [[nodiscard]] double full_s() const { return def_.tick_share * def_.tick_s * def_.workers; }

  TickGuardDef def_;
  // The learnt ratio of predicted to measured time, at most 1, by which available_s() multiplies the time.
  double trust_ = 1;
  // One minus the safety margin: the factor on tick_share when the margin applies in full.
  double margin_factor_ = 1;
  // The share of a tick that its work may take now: tick_share, less the margin as far as it applies.
  double share_;
  // The ticks since the margin was last widened, up to kMarginTicks + 1 (budget_guard.cpp).
  int calm_ticks_ = 0;
  // The worker-seconds of a tick that are not work on characters, smoothed.
  double overhead_s_ = 0;
  // One bit for each of the last 8 ticks, the newest in the lowest bit; 1: the tick exceeded the share.
  std::uint8_t recent_ = 0;
};

}  // namespace hairnet::server
