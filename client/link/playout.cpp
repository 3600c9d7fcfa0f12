#include "client/link/playout.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/assert.hpp"
#include "core/smoothstep.hpp"

namespace hairnet::link {
namespace {

// The most buffered frames, some eight seconds at 30 Hz: they bound the memory while no caller samples.
constexpr std::size_t kFramesMax = 256;
// The delay is computed from this many arrivals, two seconds at 30 Hz: it remembers a burst of late frames for that
// long.
constexpr std::size_t kArrivalsMax = 60;
// The interval between frames until two have arrived: that of 30 Hz.
constexpr std::int64_t kIntervalDefault_ns = 33'333'333;
// Hair waits this long for the next frame, or for two steps of its character if that is longer. It then reaches its
// rest shape within kEaseToRest_ns.
constexpr std::int64_t kFreeze_ns = 100'000'000;
constexpr std::int64_t kEaseToRest_ns = 500'000'000;
// The delay changes by at most this share of the elapsed time. Motion then runs up to 10 % slower or faster, too little
// to notice.
constexpr double kSlewMax = 0.1;
// Two frames that lie further apart in time say nothing about a speed: hair swings back and forth between them.
constexpr std::int64_t kSmooth_ns_max = 300'000'000;
// After the last frame hair moves at most as far as its last speed would carry it in this time, one interval at 30 Hz.
constexpr double kGoOn_ns = 33e6;
// A late frame changes the curve. The change is faded in over the gap between that frame and the one before it, within
// these limits, whose reasons stand in correct().
constexpr std::int64_t kCorrect_ns_min = 40'000'000, kCorrect_ns_max = 100'000'000;

// Returns the new curve's transform plus a share `left` of the difference between the transform that was shown and the
// new curve's, both as they were when the curve changed.
RigidTransform corrected(const RigidTransform& curve, const RigidTransform& was_shown, const RigidTransform& was_curve,
                         double left) {
  const Quat turn = was_shown.rotation * was_curve.rotation.conjugate();
  return {(Quat::Identity().slerp(left, turn) * curve.rotation).normalized(),
          curve.position + left * (was_shown.position - was_curve.position)};
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
  // Index of the frame that is played.
  const std::size_t played = started_ && !frames_.empty() ? index_at(time_ns_) : 0;
  const auto place = std::find_if(frames_.begin(), frames_.end(),
                                  [&](const BufferedFrame& other) { return other.time_ns >= sample_time_ns; });
  const auto index = static_cast<std::size_t>(place - frames_.begin());
  const std::int64_t gap_ns = index > 0 ? sample_time_ns - frames_[index - 1].time_ns : 0;
  if (place != frames_.end() && place->time_ns == sample_time_ns) {
    if (!frame.repeated) {
      ++dropped_count_;
      return;
    }
    place->state.coefficients = frame.coefficients;
    place->state.basis = frame.basis;
  } else {
    // A frame that is dropped below still counts as an arrival: the delay then grows until such frames come in time.
    record_arrival(sample_time_ns, arrival_time_ns);
    if (started_ && !frames_.empty() && index <= played) {
      ++dropped_count_;
      return;
    }
    frames_.insert(place, {sample_time_ns,
                           frame.discontinuous,
                           frame.asleep,
                           std::llround(1e9 * double{frame.step_s}),
                           {frame.pose, frame.level, frame.coefficients, frame.basis}});
  }
  // The curve that is shown depends on frames up to two after the played one (see Weights), so a later frame changes
  // nothing yet.
  if (started_ && index <= played + 2) correct(gap_ns);
  if (frames_.size() > kFramesMax) {
    frames_.pop_front();
    ++dropped_count_;
  }
  check_invariants();
}

void Playout::freeze() {
  if (frames_.empty()) return;
  BufferedFrame& last = frames_.back();
  // The shown state may already be easing to rest. It becomes the frame, so that hair does not jump back.
  if (started_ && time_ns_ >= last.time_ns) {
    last.state = shown_;
    correction_.reset();
  }
  last.asleep = true;
}

void Playout::record_arrival(std::int64_t sample_time_ns, std::int64_t arrival_time_ns) {
  arrivals_.push_back({sample_time_ns, arrival_time_ns - sample_time_ns});
  if (arrivals_.size() > kArrivalsMax) arrivals_.pop_front();
  min_late_ns_ = max_late_ns_ = arrivals_.front().lateness_ns;
  std::vector<std::int64_t> intervals;
  for (std::size_t i = 0; i < arrivals_.size(); ++i) {
    min_late_ns_ = std::min(min_late_ns_, arrivals_[i].lateness_ns);
    max_late_ns_ = std::max(max_late_ns_, arrivals_[i].lateness_ns);
    if (i > 0 && arrivals_[i].time_ns > arrivals_[i - 1].time_ns)
      intervals.push_back(arrivals_[i].time_ns - arrivals_[i - 1].time_ns);
  }
  interval_ns_ = kIntervalDefault_ns;
  if (intervals.empty()) return;
  // The index is that of the ninth decile: nine of ten intervals are not longer. The largest interval would let a
  // single lost frame delay everything.
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(9 * (intervals.size() - 1) / 10);
  std::nth_element(intervals.begin(), middle, intervals.end());
  interval_ns_ = *middle;
}

std::int64_t Playout::target_delay_ns() const {
  HAIRNET_ASSERT(!frames_.empty());
  // When the server begins to step the character less often, the frame's step says so before the arrivals do.
  const std::int64_t interval = std::max(interval_ns_, frames_.back().step_ns);
  return min_late_ns_ + interval + std::max(interval / 2, max_late_ns_ - min_late_ns_);
}

// Advances the play time to `render_time_ns`.
void Playout::advance(std::int64_t render_time_ns) {
  const std::int64_t target = target_delay_ns();
  if (!started_) {
    started_ = true;
    render_time_ns_ = render_time_ns;
    delay_ns_ = target;
    time_ns_ = render_time_ns - delay_ns_;
    return;
  }
  const std::int64_t elapsed = std::max<std::int64_t>(0, render_time_ns - render_time_ns_);
  render_time_ns_ += elapsed;
  const bool starved = frames_.back().time_ns < time_ns_;
  const auto slew = static_cast<std::int64_t>(kSlewMax * static_cast<double>(elapsed));
  // Without a newer frame to show, a larger delay is taken at once: the play time stops here, and late frames are in
  // time again.
  if (starved && target > delay_ns_)
    delay_ns_ = target;
  else
    delay_ns_ += std::clamp(target - delay_ns_, -slew, slew);
  time_ns_ = std::max(time_ns_, render_time_ns_ - delay_ns_);
}

Playout::Sample Playout::sample(std::int64_t render_time_ns) {
  if (frames_.empty()) return {};
  const bool was_started = started_;
  const std::size_t from = was_started ? index_at(time_ns_) : 0;
  advance(render_time_ns);
  // The play time may have passed a discontinuity, across which a correction would drag the old place of the hair
  // along.
  for (std::size_t i = from; i < index_at(time_ns_); ++i) {
    if (!is_joined(i)) correction_.reset();
  }
  // The played frame keeps two before it, which the slope at it may need.
  while (frames_.size() > 3 && frames_[3].time_ns <= time_ns_) frames_.pop_front();
  curve_at(time_ns_, shown_);
  apply_correction();
  check_invariants();
  return {true, shown_.pose, shown_.level, shown_.coefficients, shown_.basis, time_ns_};
}

// The last frame that is not after a time, or the first.
std::size_t Playout::index_at(std::int64_t time_ns) const {
  std::size_t i = 0;
  while (i + 1 < frames_.size() && frames_[i + 1].time_ns <= time_ns) ++i;
  return i;
}

bool Playout::are_joined(const State& from, const State& to) {
  // Coefficients of two bases cannot be mixed. A state without a basis is at rest, which is 0 in each basis.
  return from.basis == to.basis || !from.basis || !to.basis;
}

// Whether frame i and the next may be mixed.
bool Playout::is_joined(std::size_t i) const {
  return !frames_[i + 1].discontinuous && are_joined(frames_[i].state, frames_[i + 1].state);
}

// Whether frame i and the next say how fast the character moved. Frames that are nearer than half of the character's
// step do not: the estimate of the server's clock has changed between their arrivals.
bool Playout::is_smooth(std::size_t i) const {
  const std::int64_t apart_ns = frames_[i + 1].time_ns - frames_[i].time_ns;
  return is_joined(i) && !frames_[i].asleep && apart_ns <= kSmooth_ns_max &&
         2 * apart_ns >= std::min(frames_[i].step_ns, frames_[i + 1].step_ns);
}

double Playout::duration_ns(std::size_t i) const {
  return static_cast<double>(frames_[i + 1].time_ns - frames_[i].time_ns);
}

// Adds a share of the mean speed between frame j and the next to the weights of frames i - 2 to i + 2.
void Playout::add_difference(std::size_t i, std::size_t j, double share, Weights& weights) const {
  weights[j + 1 + 2 - i] += share / duration_ns(j);
  weights[j + 2 - i] -= share / duration_ns(j);
}

// Adds a share of the speed at frame j, in the same weights. The speed is the slope of the parabola through frame j and
// its neighbours. Where it has a neighbour on one side alone, the parabola goes through frame j and the two next to it.
void Playout::add_slope(std::size_t i, std::size_t j, double share, Weights& weights) const {
  const bool has_before = j > 0 && is_smooth(j - 1), has_after = j + 1 < frames_.size() && is_smooth(j);
  if (has_before && has_after) {
    // Each mean speed has the weight of the other interval, which gives the slope of the parabola.
    const double h0 = duration_ns(j - 1), h = duration_ns(j);
    add_difference(i, j - 1, share * h / (h0 + h), weights);
    add_difference(i, j, share * h0 / (h0 + h), weights);
  } else if (has_before) {
    const bool has_two = j > 1 && is_smooth(j - 2);
    // The parabola through three frames bends on beyond the nearest interval by this share of the change of the mean
    // speed.
    const double bend = has_two ? duration_ns(j - 1) / (duration_ns(j - 2) + duration_ns(j - 1)) : 0;
    add_difference(i, j - 1, share * (1 + bend), weights);
    if (has_two) add_difference(i, j - 2, -share * bend, weights);
  } else if (has_after) {
    const bool has_two = j + 2 < frames_.size() && is_smooth(j + 1);
    const double bend = has_two ? duration_ns(j) / (duration_ns(j) + duration_ns(j + 1)) : 0;
    add_difference(i, j, share * (1 + bend), weights);
    if (has_two) add_difference(i, j + 1, -share * bend, weights);
  }
}

// Sums up frames i - 2 to i + 2 with these weights.
void Playout::blend(std::size_t i, const Weights& weights, State& out) const {
  std::size_t count = 0;
  for (std::size_t w = 0; w < weights.size(); ++w) {
    if (weights[w] != 0) count = std::max(count, frames_[i + w - 2].state.coefficients.size());
  }
  // Frames may have different numbers of coefficients; those that a frame lacks are 0.
  out.coefficients.assign(count, 0.0f);
  for (std::size_t w = 0; w < weights.size(); ++w) {
    if (weights[w] == 0) continue;
    const std::vector<float>& c = frames_[i + w - 2].state.coefficients;
    for (std::size_t k = 0; k < c.size(); ++k) out.coefficients[k] += static_cast<float>(weights[w]) * c[k];
  }
}

void Playout::curve_at(std::int64_t time_ns, State& out) const {
  const std::size_t i = index_at(time_ns);
  if (i + 1 == frames_.size()) {
    after_last(time_ns, out);
  } else if (time_ns <= frames_[i].time_ns || !is_joined(i)) {
    out = frames_[i].state;
  } else {
    between(i, time_ns, out);
  }
}

// The cubic with the values c_0, c_1 and the slopes m_0, m_1 at the ends of an interval of duration h:
//
//   c(s) = c_0 + s^2 (3 - 2 s) (c_1 - c_0) + s (1 - s)^2 h m_0 - s^2 (1 - s) h m_1.
void Playout::between(std::size_t i, std::int64_t time_ns, State& out) const {
  const BufferedFrame &from = frames_[i], &to = frames_[i + 1];
  const double h = duration_ns(i), s = static_cast<double>(time_ns - from.time_ns) / h;
  Weights weights{};
  // The weight of the next frame. Between frames that give no speed the curve is a straight line.
  const double ahead = is_smooth(i) ? s * s * (3 - 2 * s) : s;
  weights[2] = 1 - ahead;
  weights[3] = ahead;
  if (is_smooth(i)) {
    add_slope(i, i, s * (1 - s) * (1 - s) * h, weights);
    add_slope(i, i + 1, -s * s * (1 - s) * h, weights);
  }
  blend(i, weights, out);
  out.pose = interpolate(from.state.pose, to.state.pose, s);
  out.level = to.state.level;
  out.basis = to.state.basis ? to.state.basis : from.state.basis;
}

// Shows the hair when no newer frame has come: it goes on ever more slowly, waits, and then eases to rest.
void Playout::after_last(std::int64_t time_ns, State& out) const {
  const std::size_t i = frames_.size() - 1;
  const BufferedFrame& last = frames_[i];
  const auto after_ns = static_cast<double>(std::max<std::int64_t>(0, time_ns - last.time_ns));
  out.pose = last.state.pose;
  out.level = last.state.level;
  out.basis = last.state.basis;
  Weights weights{};
  weights[2] = 1;
  if (!last.asleep && i > 0 && is_smooth(i - 1)) {
    // The last speed decays exponentially, so hair moves on by no more than that speed would in kGoOn_ns. Going on at
    // full speed would overshoot by more, the longer a frame is late.
    const double moved_ns = kGoOn_ns * (1 - std::exp(-after_ns / kGoOn_ns));
    add_slope(i, i, moved_ns, weights);
    out.pose = interpolate(frames_[i - 1].state.pose, last.state.pose, 1 + moved_ns / duration_ns(i - 1));
  }
  // A sleeping character gets no frames, so its silence says nothing about the connection.
  const double waited = after_ns - static_cast<double>(std::max(kFreeze_ns, 2 * last.step_ns));
  const double left = last.asleep ? 1 : 1 - smoothstep(0.0, double{kEaseToRest_ns}, waited);
  for (double& weight : weights) weight *= left;
  blend(i, weights, out);
  if (!out.basis) out.coefficients.clear();
}

// The curve has changed. Remembers the difference between what was shown and the new curve at this moment;
// apply_correction() adds it and fades it out.
void Playout::correct(std::int64_t gap_ns) {
  Correction correction;
  curve_at(time_ns_, correction.curve);
  correction_.reset();
  if (!are_joined(shown_, correction.curve)) return;
  correction.shown = shown_;
  correction.begun_ns = time_ns_;
  // A longer gap has moved the curve farther, so more time is given. Below the minimum the correction is seen as a
  // jerk; above the maximum the hair trails behind its frames.
  correction.duration_ns = std::clamp(gap_ns, kCorrect_ns_min, kCorrect_ns_max);
  correction_ = std::move(correction);
}

void Playout::apply_correction() {
  if (!correction_) return;
  const Correction& c = *correction_;
  const double left =
      1 - smoothstep(0.0, static_cast<double>(c.duration_ns), static_cast<double>(time_ns_ - c.begun_ns));
  const std::shared_ptr<const KnownBasis>& basis = c.shown.basis ? c.shown.basis : c.curve.basis;
  if (left <= 0 || (basis && shown_.basis && basis != shown_.basis)) {
    correction_.reset();
    return;
  }
  for (std::size_t bone = 0; bone < kBoneCount; ++bone)
    shown_.pose.bones[bone] =
        corrected(shown_.pose.bones[bone], c.shown.pose.bones[bone], c.curve.pose.bones[bone], left);
  if (!basis) return;
  shown_.basis = basis;
  std::vector<float>& coefficients = shown_.coefficients;
  coefficients.resize(std::max({coefficients.size(), c.shown.coefficients.size(), c.curve.coefficients.size()}));
  for (std::size_t k = 0; k < c.shown.coefficients.size(); ++k)
    coefficients[k] += static_cast<float>(left) * c.shown.coefficients[k];
  for (std::size_t k = 0; k < c.curve.coefficients.size(); ++k)
    coefficients[k] -= static_cast<float>(left) * c.curve.coefficients[k];
}

}  // namespace hairnet::link
