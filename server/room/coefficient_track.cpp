#include "server/room/coefficient_track.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "core/smoothstep.hpp"

namespace hairnet::server {
namespace {

// A jump at a change of level fades out within this time.
constexpr double kFade_s = 0.4;
// After a longer gap between two calls nothing fades: the hair was not shown meanwhile.
constexpr std::uint64_t kGapMax_ticks = 8;

}  // namespace

std::span<const float> CoefficientTrack::at(std::uint64_t tick, double tick_s, const HairMotion& motion,
                                            std::size_t mode_count, bool discontinuous) {
  const bool is_new_basis = std::exchange(mode_count_, mode_count) != mode_count;
  HAIRNET_ASSERT(is_new_basis || tick >= last_.tick);
  // The result is made in a buffer that is kept, so that most ticks allocate nothing.
  std::vector<float>& next = next_;
  const std::span<const float> own = motion.coefficients.first(std::min(motion.coefficients.size(), mode_count));
  next.assign(own.begin(), own.end());
  // Coefficients without a map are those of a network. With neither coefficients nor a map, the hair is at rest on the
  // rigid level.
  const bool is_learnt = !motion.map && !own.empty();
  // After a gap or a teleport the former coefficients say nothing about the present ones.
  const bool is_continued = !is_new_basis && !discontinuous && tick - last_.tick <= kGapMax_ticks;
  if (!is_continued) {
    fading_.clear();
    has_before_ = false;
  } else if (motion.map != map_ || is_learnt != was_learnt_) {
    begin_fade(tick, next);
  }
  map_ = motion.map;
  was_learnt_ = is_learnt;
  const double age = static_cast<double>(tick - faded_from_) * tick_s / kFade_s;
  if (age >= 1) fading_.clear();
  // Smoothstep has no speed at both ends, so the speed of the hair does not jump where the fade begins or ends.
  const auto left = static_cast<float>(1 - smoothstep(std::min(age, 1.0)));
  next.resize(std::max(next.size(), fading_.size()));
  for (std::size_t k = 0; k < fading_.size(); ++k) next[k] += left * fading_[k];
  // A second call at the same tick must not count as a step of the motion.
  if (is_continued && tick > last_.tick) {
    std::swap(before_, last_);
    has_before_ = true;
  }
  last_.tick = tick;
  std::swap(last_.coefficients, next);
  return last_.coefficients;
}

// The difference is taken from where the shown hair would be now if it had gone on at its last speed. Taken from its
// last place instead, hair in motion would stand still for a moment.
void CoefficientTrack::begin_fade(std::uint64_t tick, std::span<const float> next) {
  float onwards = 0;
  if (has_before_) {
    HAIRNET_ASSERT(last_.tick > before_.tick);
    onwards = static_cast<float>(tick - last_.tick) / static_cast<float>(last_.tick - before_.tick);
  }
  const auto at = [](std::span<const float> coefficients, std::size_t k) {
    return k < coefficients.size() ? coefficients[k] : 0;
  };
  const std::span<const float> last = last_.coefficients, before = before_.coefficients;
  fading_.resize(std::max({last.size(), next.size(), has_before_ ? before.size() : 0}));
  for (std::size_t k = 0; k < fading_.size(); ++k) {
    // `speed` is a change per interval of the last two samples; `onwards` counts such intervals.
    const float speed = onwards > 0 ? at(last, k) - at(before, k) : 0;
    fading_[k] = at(last, k) + onwards * speed - at(next, k);
  }
  faded_from_ = tick;
}

}  // namespace hairnet::server
