#include "server/tick/budget_guard.hpp"

#include <algorithm>
#include <bit>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// The trust never falls below this value, so some time is always available: with none, no character would be stepped,
// and nothing could be measured any more.
constexpr double kTrustMin = 0.02;
// One tick cuts the trust to no less than half: a single very late tick says little about the right amount.
constexpr double kCutMax = 0.5;
// The trust recovers after ticks that take less than this part of their share.
constexpr double kCalm = 0.85;
// The trust grows by this factor a second, times the distance of a tick below kCalm: after ticks that take half of
// their share, by 2.5 * 0.35 = 88 % a second.
constexpr double kReturnPerS = 2.5;
// The safety margin is at most a fifth.
constexpr double kMarginFactorMin = 0.8;
// An overrun multiplies margin_factor_ by 1 - kMarginStep.
constexpr double kMarginStep = 0.08;
// Each other tick multiplies margin_factor_ by 1 + kMarginReturn: one overrun in 0.08 / 4e-5 = 2000 ticks keeps the
// margin constant.
constexpr double kMarginReturn = 4e-5;
// More than this many ticks lie between two steps of the margin: the cause of one late tick often makes the next few
// late, too.
constexpr int kMarginTicks = 30;
// The weight of one tick in overhead_s_.
constexpr double kOverheadGain = 0.1;
// One sample of the overhead counts as at most twice the mean, or this share of all workers' tick where that is more:
// without the share, a mean of 0 would stay 0.
constexpr double kOverheadMin = 0.05;

}  // namespace

TickGuard::TickGuard(const TickGuardDef& def) : def_(def), share_(def.tick_share) {
  HAIRNET_ASSERT(def.tick_s > 0);
  HAIRNET_ASSERT(def.tick_share > 0 && def.tick_share <= 1);
  HAIRNET_ASSERT(def.workers > 0);
}

// The comparisons are written so that NaN fails them.
void TickGuard::check_invariants() const {
  HAIRNET_ASSERT(trust_ >= kTrustMin && trust_ <= 1);
  HAIRNET_ASSERT(margin_factor_ >= kMarginFactorMin && margin_factor_ <= 1);
  HAIRNET_ASSERT(share_ > 0 && share_ <= def_.tick_share);
  HAIRNET_ASSERT(overhead_s_ >= 0);
}

void TickGuard::observe(double tick_duration_s, double work_s, double wanted_s) {
  // The time is compared with the current target, which the margin may have lowered.
  const double used = tick_duration_s / (share_ * def_.tick_s);
  // The condition is written so that NaN returns, too.
  if (!(used >= 0) || !(work_s >= 0)) return;
  // A sample is bounded, because one late tick in ten must not pull up the mean of the other nine.
  const double max_s = std::max(2 * overhead_s_, kOverheadMin * def_.tick_s * def_.workers);
  const double overhead_s = std::clamp(tick_duration_s * def_.workers - work_s, 0.0, max_s);
  overhead_s_ += kOverheadGain * (overhead_s - overhead_s_);
  calm_ticks_ = std::min(calm_ticks_ + 1, kMarginTicks + 1);
  if (tick_duration_s <= def_.tick_s) {
    margin_factor_ = std::min(1.0, margin_factor_ * (1 + kMarginReturn));
  } else if (calm_ticks_ > kMarginTicks) {
    margin_factor_ = std::max(kMarginFactorMin, margin_factor_ * (1 - kMarginStep));
    calm_ticks_ = 0;
  }
  choose_share(wanted_s);
  check_invariants();
  const bool is_beyond = used > 1;
  recent_ = static_cast<std::uint8_t>(recent_ << 1 | (is_beyond ? 1 : 0));
  if (is_beyond) {
    // One tick beyond the share may be another program's doing; two of four are not.
    if (std::popcount(static_cast<unsigned>(recent_ & 0xfu)) < 2) return;
    trust_ = std::max(kTrustMin, trust_ * std::max(kCutMax, 1 / used));
    // The next cut needs two new ticks, which have run with the lower trust.
    recent_ = 0;
  } else if (used < kCalm) {
    trust_ = std::min(1.0, trust_ * (1 + kReturnPerS * (kCalm - used) * def_.tick_s));
  }
  check_invariants();
}

double TickGuard::available_s() const {
  const double all_s = share_ * def_.tick_s * def_.workers;
  const double available_s = std::max(kTrustMin * all_s, trust_ * (all_s - overhead_s_));
  HAIRNET_ASSERT(available_s > 0 && available_s <= full_s());
  return available_s;
}

// The safety margin applies only as far as the wanted work exceeds the work that fits without a margin (there_s). Below
// it the factor is 1; above it the factor falls by as much as the wanted work exceeds it, down to margin_factor_.
void TickGuard::choose_share(double wanted_s) {
  const double there_s = std::max(kTrustMin * full_s(), trust_ * (full_s() - overhead_s_));
  share_ = def_.tick_share * std::clamp(2 - wanted_s / there_s, margin_factor_, 1.0);
}

}  // namespace hairnet::server
