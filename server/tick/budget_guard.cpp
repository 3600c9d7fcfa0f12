#include "server/tick/budget_guard.hpp"

#include <algorithm>
#include <bit>
#include <cassert>

namespace hairnet::server {
namespace {

constexpr double kTrustLeast = 0.02;
constexpr double kCutMost = 0.5;     // in one tick: a single very late one says little of how much is too much
constexpr double kCalm = 0.85;       // of the share: below, trust comes back
constexpr double kReturnPerS = 0.1;  // of itself

}  // namespace

TickGuard::TickGuard(const TickGuardDef& def) : def_(def) {
  assert(def.tick_s > 0 && def.tick_share > 0 && def.tick_share <= 1 && def.workers > 0);
}

void TickGuard::take(double tick_duration_s) {
  const double used = tick_duration_s / (def_.tick_share * def_.tick_s);
  if (!(used >= 0)) return;
  if (tick_duration_s > def_.tick_s) ++overruns_;
  const bool is_beyond = used > 1;
  recent_ = static_cast<std::uint8_t>(recent_ << 1 | (is_beyond ? 1 : 0));
  if (is_beyond) {
    if (std::popcount(static_cast<unsigned>(recent_ & 0xfu)) < 2) return;
    trust_ = std::max(kTrustLeast, trust_ * std::max(kCutMost, 1 / used));
    recent_ = 0;
  } else if (used < kCalm) {
    trust_ = std::min(1.0, trust_ * (1 + kReturnPerS * def_.tick_s));
  }
}

double TickGuard::available_s() const {
  return trust_ * def_.tick_share * def_.tick_s * def_.workers;
}

}  // namespace hairnet::server
