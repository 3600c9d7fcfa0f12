#include "client/link/learnt_track.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::link {
namespace {

// The share of the residual that remains after each tick: at 30 Hz, the rate of learnt hair, it is halved every 0.14 s.
constexpr float kResidualKept = 0.85f;
// A residual below this is dropped: nobody sees a smaller step of the hair.
constexpr float kNothing_m = 1e-5f;

float at(const std::vector<float>& numbers, std::size_t k) {
  return k < numbers.size() ? numbers[k] : 0;
}

// Multiplies all numbers by the share. A list in which nothing visible is left becomes empty, which means zero.
void fade(std::vector<float>& numbers, float share) {
  for (float& x : numbers) x *= share;
  if (std::ranges::all_of(numbers, [](float x) { return std::abs(x) < kNothing_m; })) numbers.clear();
}

}  // namespace

std::optional<LearntMotion> LearntTrack::begin(std::shared_ptr<const LearntHair> hair, const LearntFrame& frame) {
  HAIRNET_ASSERT(frame.to);
  // A gap of more than kLearntGapMax_ticks (8) ticks: the network's state cannot be continued across it.
  const bool is_gap = !frame.from || frame.ticks > kLearntGapMax_ticks;
  is_new_ = false;
  // After the learnt level ends, one more step tells how the learnt hair would have continued.
  const bool is_needed = frame.is_learnt || (was_evaluated_ && !is_gap && !frame.discontinuous);
  if (!hair || !is_needed) {
    hair_ = nullptr;
    has_begun_ = was_evaluated_ = false;
    residual_.clear();
    if (is_gap || frame.discontinuous) surprise_.clear();
    return std::nullopt;
  }
  // The network's state depends on every tick, so it cannot pass over a gap, nor go to another network.
  if (is_gap || hair != hair_) has_begun_ = false;
  followed_ticks_ = has_begun_ ? followed_ticks_ + frame.ticks : 0;
  hair_ = std::move(hair);
  evaluated_.resize(hair_->mode_count);
  // The World does not step learnt hair across a discontinuity either.
  if (has_begun_ && frame.discontinuous) {
    state_.poses.forget();
    return std::nullopt;
  }
  is_new_ = !std::exchange(has_begun_, true);
  if (is_new_) state_ = {};
  // Across a gap or a jump the network sees a head that does not move.
  const bool is_held = is_gap || frame.discontinuous;
  return LearntMotion{.state = &state_,
                      .from = is_held ? frame.to : frame.from,
                      .to = frame.to,
                      .ticks = is_held ? 0 : static_cast<int>(frame.ticks),
                      .begins = is_new_,
                      .coefficients = evaluated_};
}

void LearntTrack::finish(const LearntFrame& frame, std::span<const float> before, std::span<float> coefficients) {
  const std::size_t count = coefficients.size();
  const bool is_continued = frame.from && frame.ticks <= kLearntGapMax_ticks && !frame.discontinuous;
  // The bound only keeps the number of ticks exact as a float: after 1000 ticks nothing of a residual is left.
  const float share = std::pow(kResidualKept, static_cast<float>(std::min<std::uint64_t>(frame.ticks, 1000)));
  fade(residual_, share);
  fade(surprise_, share);
  residual_.resize(hair_ ? count : 0);
  if (frame.evaluated) {
    HAIRNET_ASSERT(hair_);
    surprise_.clear();
    for (std::size_t k = 0; k < count; ++k) {
      // A network that begins here goes on from what was shown.
      if (is_new_) residual_[k] = !frame.discontinuous && before.size() == count ? before[k] - at(evaluated_, k) : 0;
      coefficients[k] = at(evaluated_, k) + residual_[k];
    }
  } else {
    if (!is_continued) surprise_.clear();
    // The server's coefficients may differ from what was shown. The difference is shown on top, and fades.
    if (was_evaluated_ && is_continued && !is_new_) {
      surprise_.resize(count);
      for (std::size_t k = 0; k < count; ++k) surprise_[k] = at(evaluated_, k) + residual_[k] - coefficients[k];
    }
    for (std::size_t k = 0; k < count; ++k) coefficients[k] += at(surprise_, k);
    for (std::size_t k = 0; k < residual_.size(); ++k) residual_[k] = coefficients[k] - at(evaluated_, k);
  }
  was_evaluated_ = frame.evaluated;
}

}  // namespace hairnet::link
