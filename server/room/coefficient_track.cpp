#include "server/room/coefficient_track.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "core/smoothstep.hpp"

namespace hairnet::server {
namespace {

constexpr double kFade_s = 0.4;
// Without samples for longer, hair that is seen again has nothing to fade from.
constexpr std::uint64_t kGapMax_ticks = 8;

}  // namespace

std::span<const float> CoefficientTrack::at(std::uint64_t tick, double tick_s, const HairMotion& motion,
                                            std::size_t mode_count, bool discontinuous) {
  const bool is_first = last_.coefficients.size() != mode_count;
  HAIRNET_ASSERT(is_first || tick >= last_.tick);
  std::vector<float>& next = next_;
  next.assign(mode_count, 0);
  const bool is_learnt = !motion.map && !motion.coefficients.empty();
  std::ranges::copy(motion.coefficients.first(std::min(motion.coefficients.size(), mode_count)), next.begin());
  if (is_first || discontinuous || tick - last_.tick > kGapMax_ticks) {
    fading_.clear();
    before_.coefficients.clear();
  } else if (motion.map != map_ || is_learnt != was_learnt_) {
    begin_fade(tick, next);
  }
  map_ = motion.map;
  was_learnt_ = is_learnt;
  const double age = static_cast<double>(tick - faded_from_) * tick_s / kFade_s;
  if (age >= 1) fading_.clear();
  const auto left = static_cast<float>(1 - smoothstep(std::min(age, 1.0)));
  for (std::size_t k = 0; k < fading_.size(); ++k) next[k] += left * fading_[k];
  if (!is_first && tick > last_.tick) std::swap(before_, last_);
  last_.tick = tick;
  std::swap(last_.coefficients, next);
  return last_.coefficients;
}

// What was shown would have gone on as it went.
void CoefficientTrack::begin_fade(std::uint64_t tick, std::span<const float> next) {
  float onwards = 0;
  if (before_.coefficients.size() == next.size()) {
    HAIRNET_ASSERT(last_.tick > before_.tick);
    onwards = static_cast<float>(tick - last_.tick) / static_cast<float>(last_.tick - before_.tick);
  }
  fading_.resize(next.size());
  for (std::size_t k = 0; k < next.size(); ++k) {
    const float speed = onwards > 0 ? last_.coefficients[k] - before_.coefficients[k] : 0;
    fading_[k] = last_.coefficients[k] + onwards * speed - next[k];
  }
  faded_from_ = tick;
}

}  // namespace hairnet::server
