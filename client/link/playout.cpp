#include "client/link/playout.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/assert.hpp"
#include "core/smoothstep.hpp"

namespace hairnet::link {
namespace {

constexpr std::size_t kFramesMax = 256;   // stored while no caller samples
constexpr std::size_t kArrivalsMax = 60;  // two seconds at 30 Hz
constexpr std::int64_t kIntervalDefault_ns = 33'333'333;
constexpr std::int64_t kFreeze_ns = 100'000'000;
constexpr std::int64_t kEaseToRest_ns = 500'000'000;
// The delay changes by at most this share of the elapsed time: motion becomes slower or faster, but too little to
// notice.
constexpr double kSlewMax = 0.1;

float at(const std::vector<float>& coefficients, std::size_t k) {
  return k < coefficients.size() ? coefficients[k] : 0;
}

}  // namespace

// The buffered frames are in order of time, no two at the same.
void Playout::check_invariants() const {
  HAIRNET_ASSERT(frames_.size() <= kFramesMax);
  HAIRNET_ASSERT(arrivals_.size() <= kArrivalsMax);
  HAIRNET_ASSERT(frames_.empty() || !arrivals_.empty());
  for (std::size_t i = 1; i < frames_.size(); ++i) HAIRNET_VALIDATE(frames_[i - 1].time_ns < frames_[i].time_ns);
}

void Playout::push(const Frame& frame, std::int64_t sample_time_ns, std::int64_t arrival_time_ns) {
  HAIRNET_ASSERT(frame.coefficients.size() <= (frame.basis ? frame.basis->code.mode_count() : 0));
  record_arrival(sample_time_ns, arrival_time_ns);
  const auto after = std::find_if(frames_.begin(), frames_.end(),
                                  [&](const BufferedFrame& buffered) { return buffered.time_ns >= sample_time_ns; });
  const bool duplicate = after != frames_.end() && after->time_ns == sample_time_ns;
  if (duplicate || (started_ && sample_time_ns <= shown_.time_ns)) {
    ++dropped_count_;
    return;
  }
  // After a gap, interpolate to the new frame from the shown state, not from the frame before the gap.
  if (started_ && !frames_.empty() && frames_.back().time_ns < shown_.time_ns) {
    frames_.clear();
    frames_.push_back(shown_);
    before_.reset();
  }
  BufferedFrame buffered{sample_time_ns,
                         frame.discontinuous,
                         frame.asleep,
                         frame.pose,
                         frame.level,
                         frame.coefficients,
                         std::llround(1e9 * double{frame.step_s}),
                         frame.basis};
  const auto place = std::find_if(frames_.begin(), frames_.end(),
                                  [&](const BufferedFrame& other) { return other.time_ns > sample_time_ns; });
  frames_.insert(place, std::move(buffered));
  if (frames_.size() > kFramesMax) {
    frames_.pop_front();
    ++dropped_count_;
  }
  check_invariants();
}

void Playout::freeze() {
  if (frames_.empty()) return;
  BufferedFrame& last = frames_.back();
  // the shown state may already be easing
  if (started_ && shown_.time_ns >= last.time_ns) last.coefficients = shown_.coefficients;
  last.asleep = true;
}

void Playout::record_arrival(std::int64_t sample_time_ns, std::int64_t arrival_time_ns) {
  arrivals_.push_back({sample_time_ns, arrival_time_ns - sample_time_ns});
  if (arrivals_.size() > kArrivalsMax) arrivals_.pop_front();
}

std::int64_t Playout::target_delay_ns() const {
  HAIRNET_ASSERT(!arrivals_.empty());
  HAIRNET_ASSERT(!frames_.empty());
  std::int64_t least = arrivals_.front().lateness_ns, most = least;
  std::vector<std::int64_t> intervals;
  for (std::size_t i = 0; i < arrivals_.size(); ++i) {
    least = std::min(least, arrivals_[i].lateness_ns);
    most = std::max(most, arrivals_[i].lateness_ns);
    if (i > 0 && arrivals_[i].time_ns > arrivals_[i - 1].time_ns)
      intervals.push_back(arrivals_[i].time_ns - arrivals_[i - 1].time_ns);
  }
  std::int64_t interval = kIntervalDefault_ns;
  if (!intervals.empty()) {
    const auto most_of = intervals.begin() + static_cast<std::ptrdiff_t>(9 * (intervals.size() - 1) / 10);
    std::nth_element(intervals.begin(), most_of, intervals.end());
    interval = *most_of;
  }
  interval = std::max(interval, frames_.back().step_ns);
  return least + interval + std::max(interval / 2, most - least);
}

// Advances the play time, shown_.time_ns, to `render_time_ns`.
void Playout::advance(std::int64_t render_time_ns) {
  const std::int64_t target = target_delay_ns();
  if (!started_) {
    started_ = true;
    render_time_ns_ = render_time_ns;
    delay_ns_ = target;
    shown_.time_ns = render_time_ns - delay_ns_;
    return;
  }
  const std::int64_t elapsed = std::max<std::int64_t>(0, render_time_ns - render_time_ns_);
  render_time_ns_ += elapsed;
  const bool starved = frames_.back().time_ns < shown_.time_ns;
  const auto slew = static_cast<std::int64_t>(kSlewMax * static_cast<double>(elapsed));
  // There is no newer frame to show. Stop the play time here, so that late frames are in time again.
  if (starved && target > delay_ns_)
    delay_ns_ = target;
  else
    delay_ns_ += std::clamp(target - delay_ns_, -slew, slew);
  shown_.time_ns = std::max(shown_.time_ns, render_time_ns_ - delay_ns_);
}

Playout::Sample Playout::sample(std::int64_t render_time_ns) {
  if (frames_.empty()) return {};
  advance(render_time_ns);
  const std::int64_t now = shown_.time_ns;
  while (frames_.size() > 1 && frames_[1].time_ns <= now) {
    before_ = std::move(frames_.front());
    frames_.pop_front();
  }
  if (now <= frames_[0].time_ns || frames_.size() == 1)
    show_last(frames_[0]);
  else
    show_between(frames_[0], frames_[1]);
  check_invariants();
  displacement_.resize(shown_.basis ? shown_.basis->hair.basis.node_count : 0);
  if (!shown_.basis) return {true, shown_.pose, shown_.level, {}, now, nullptr};
  hairnet::displacements_of(shown_.basis->hair.basis, shown_.coefficients, displacement_);
  return {true, shown_.pose, shown_.level, displacement_, now, {shown_.basis, &shown_.basis->hair.geometry}};
}

bool Playout::are_joined(const BufferedFrame& from, const BufferedFrame& to) {
  return !to.discontinuous && (from.basis == to.basis || !from.basis || !to.basis);
}

// With h_0 and h the durations before and after `from`, and d_0 and d the slopes of the straight lines, the parabola is
//
//   c(s) = c_from + s (c_to - c_from) + s (s - 1) h^2 (d - d_0) / (h_0 + h).
void Playout::show_between(const BufferedFrame& from, const BufferedFrame& to) {
  HAIRNET_ASSERT(from.time_ns < to.time_ns);
  HAIRNET_ASSERT(shown_.time_ns > from.time_ns && shown_.time_ns < to.time_ns);
  if (!are_joined(from, to)) {
    shown_.pose = from.pose;
    shown_.level = from.level;
    shown_.coefficients = from.coefficients;
    shown_.basis = from.basis;
    return;
  }
  const auto h_ns = static_cast<double>(to.time_ns - from.time_ns);
  const double s = static_cast<double>(shown_.time_ns - from.time_ns) / h_ns;
  shown_.pose = interpolate(from.pose, to.pose, s);
  shown_.level = to.level;
  shown_.basis = to.basis ? to.basis : from.basis;
  const bool has_before = before_ && before_->time_ns < from.time_ns && are_joined(*before_, from);
  const double h0_ns = has_before ? static_cast<double>(from.time_ns - before_->time_ns) : h_ns;
  const auto ahead = static_cast<float>(s), ratio = static_cast<float>(h_ns / h0_ns);
  const auto bend = static_cast<float>(s * (s - 1) * h_ns / (h0_ns + h_ns));
  std::vector<float>& shown = shown_.coefficients;
  shown.resize(std::max(from.coefficients.size(), to.coefficients.size()));
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const float start = at(from.coefficients, k), step = at(to.coefficients, k) - start;
    shown[k] = start + ahead * step;
    if (has_before) shown[k] += bend * (step - ratio * (start - at(before_->coefficients, k)));
  }
}

void Playout::show_last(const BufferedFrame& last) {
  const std::int64_t waited = shown_.time_ns - last.time_ns - std::max(kFreeze_ns, 2 * last.step_ns);
  const double eased = smoothstep(0.0, double{kEaseToRest_ns}, static_cast<double>(waited));
  const float left = last.asleep ? 1 : static_cast<float>(1 - eased);
  shown_.pose = last.pose;
  shown_.level = last.level;
  shown_.coefficients = last.coefficients;
  shown_.basis = last.basis;
  for (float& c : shown_.coefficients) c *= left;
}

}  // namespace hairnet::link
