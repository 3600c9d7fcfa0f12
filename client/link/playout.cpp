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
constexpr std::int64_t kCubic_ns_max = 250'000'000;
constexpr std::int64_t kEaseToRest_ns = 500'000'000;
// The delay changes by at most this share of the elapsed time: motion becomes slower or faster, but too little to
// notice.
constexpr double kSlewMax = 0.1;

// The same rotation with the quaternion's sign for which it is less than half a turn.
Quat nearer(const Quat& q) {
  return q.w() < 0 ? Quat(-q.coeffs()) : q;
}

}  // namespace

// Over a long gap the end velocities no longer describe the motion between, so the cubic is not used.
bool Playout::is_cubic(const BufferedFrame& from, const BufferedFrame& to) {
  const std::size_t count = to.displacement.size();
  return count > 0 && to.velocity.size() == count && from.velocity.size() == count &&
         from.displacement.size() == count && to.geometry && to.geometry->active_nodes.size() == count &&
         to.time_ns - from.time_ns <= kCubic_ns_max;
}

// The buffered frames are in order of time, no two at the same.
void Playout::check_invariants() const {
  HAIRNET_ASSERT(frames_.size() <= kFramesMax);
  HAIRNET_ASSERT(arrivals_.size() <= kArrivalsMax);
  HAIRNET_ASSERT(frames_.empty() || !arrivals_.empty());
  for (std::size_t i = 1; i < frames_.size(); ++i) HAIRNET_VALIDATE(frames_[i - 1].time_ns < frames_[i].time_ns);
}

void Playout::push(const Frame& frame, std::int64_t sample_time_ns, std::int64_t arrival_time_ns) {
  HAIRNET_ASSERT(frame.displacements.size() % 3 == 0);
  HAIRNET_ASSERT(frame.velocities.empty() || frame.velocities.size() == frame.displacements.size());
  HAIRNET_ASSERT(!frame.geometry || frame.displacements.empty() ||
                 frame.displacements.size() == 3 * frame.geometry->active_nodes.size());
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
  }
  BufferedFrame buffered{sample_time_ns, frame.discontinuous, frame.asleep, frame.pose, frame.level, {}, {}, 0,
                         frame.geometry};
  buffered.step_ns = std::llround(1e9 * double{frame.step_s});
  codec::dequantise_nodes(frame.displacements, frame.error_class, buffered.displacement);
  codec::dequantise_velocities(frame.velocities, frame.error_class, buffered.velocity);
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
  HAIRNET_ASSERT(!started_ || shown_.time_ns < last.time_ns || shown_.displacement.size() == last.displacement.size());
  // the shown state may already be easing
  if (started_ && shown_.time_ns >= last.time_ns) last.displacement = shown_.displacement;
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
    const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
    std::nth_element(intervals.begin(), middle, intervals.end());
    interval = *middle;
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
  while (frames_.size() > 1 && frames_[1].time_ns <= now) frames_.pop_front();
  if (now <= frames_[0].time_ns || frames_.size() == 1)
    show_last(frames_[0]);
  else
    show_between(frames_[0], frames_[1]);
  check_invariants();
  HAIRNET_ASSERT(shown_.displacement.empty() || !shown_.geometry ||
                 shown_.displacement.size() == shown_.geometry->active_nodes.size());
  return {true, shown_.pose, shown_.level, shown_.displacement, now, shown_.geometry};
}

void Playout::show_between(const BufferedFrame& from, const BufferedFrame& to) {
  HAIRNET_ASSERT(from.time_ns < to.time_ns);
  HAIRNET_ASSERT(shown_.time_ns > from.time_ns && shown_.time_ns < to.time_ns);
  shown_.level = from.level;
  const bool joined =
      !to.discontinuous && to.level == from.level &&
      (to.displacement.size() == from.displacement.size() || to.displacement.empty() || from.displacement.empty());
  if (!joined) {
    shown_.pose = from.pose;
    shown_.displacement = from.displacement;
    shown_.geometry = from.geometry;
    return;
  }
  const double s = static_cast<double>(shown_.time_ns - from.time_ns) / static_cast<double>(to.time_ns - from.time_ns);
  shown_.pose = interpolate(from.pose, to.pose, s);
  shown_.geometry = to.displacement.empty() ? from.geometry : to.geometry;
  if (is_cubic(from, to)) return show_cubic(from, to, s);
  // An empty frame is a lattice at rest.
  shown_.displacement.assign(std::max(from.displacement.size(), to.displacement.size()), Vec3f::Zero());
  for (std::size_t i = 0; i < from.displacement.size(); ++i)
    shown_.displacement[i] += static_cast<float>(1 - s) * from.displacement[i];
  for (std::size_t i = 0; i < to.displacement.size(); ++i)
    shown_.displacement[i] += static_cast<float>(s) * to.displacement[i];
}

// Let x = p^0 + d be the node in the head's axes, w the head's angular velocity in these axes, and t the head's
// position. Then
//
//   p' = t' + R (w x x + d').
//
// Both w and t' are constant while `interpolate` moves the head, so d' follows from the node's velocity R^-1 p' in the
// frame. That velocity is the mean over the step that ended with the frame; half a step's change gives the velocity at
// the frame's moment.
void Playout::show_cubic(const BufferedFrame& from, const BufferedFrame& to, double s) {
  HAIRNET_ASSERT(is_cubic(from, to));
  HAIRNET_ASSERT(s >= 0 && s <= 1);
  const double duration_s = 1e-9 * static_cast<double>(to.time_ns - from.time_ns);
  const RigidTransform &a = from.pose.head(), &b = to.pose.head();
  const Quat turn = nearer(a.rotation.conjugate() * b.rotation);  // from the axes of `to` into those of `from`
  const Eigen::AngleAxisd angle(turn);
  const Vec3f spin = (angle.axis() * angle.angle() / duration_s).cast<float>();
  const Vec3 drift = (b.position - a.position) / duration_s;
  const Vec3f drift_a = (a.rotation.conjugate() * drift).cast<float>();
  const Vec3f drift_b = (b.rotation.conjugate() * drift).cast<float>();
  const Eigen::Matrix3f turned = turn.toRotationMatrix().cast<float>(), back = turned.transpose();
  const double step_s = std::min(duration_s, 1e-9 * static_cast<double>(to.step_ns));
  const auto half_step = static_cast<float>(step_s / duration_s / 2);

  const double s2 = s * s, s3 = s2 * s;
  const auto at_from = static_cast<float>(2 * s3 - 3 * s2 + 1), at_to = static_cast<float>(3 * s2 - 2 * s3);
  const auto slope_from = static_cast<float>((s3 - 2 * s2 + s) * duration_s);
  const auto slope_to = static_cast<float>((s3 - s2) * duration_s);
  const LevelGeometry& geometry = *to.geometry;
  shown_.displacement.resize(to.displacement.size());
  for (std::size_t i = 0; i < to.displacement.size(); ++i) {
    const Vec3f rest = geometry.lattice.node(geometry.active_nodes[i]);
    const Vec3f &d_from = from.displacement[i], &d_to = to.displacement[i];
    const Vec3f &v_from = from.velocity[i], &v_to = to.velocity[i];
    const Vec3f rate_from = v_from + half_step * (turned * v_to - v_from) - drift_a - spin.cross(Vec3f(rest + d_from));
    const Vec3f rate_to = v_to + half_step * (v_to - back * v_from) - drift_b - spin.cross(Vec3f(rest + d_to));
    shown_.displacement[i] = at_from * d_from + at_to * d_to + slope_from * rate_from + slope_to * rate_to;
  }
}

void Playout::show_last(const BufferedFrame& last) {
  const std::int64_t waited = shown_.time_ns - last.time_ns - std::max(kFreeze_ns, 2 * last.step_ns);
  const double eased = smoothstep(0.0, double{kEaseToRest_ns}, static_cast<double>(waited));
  const float left = last.asleep ? 1 : static_cast<float>(1 - eased);
  shown_.pose = last.pose;
  shown_.level = last.level;
  shown_.displacement = last.displacement;
  shown_.geometry = last.geometry;
  for (Vec3f& d : shown_.displacement) d *= left;
}

}  // namespace hairnet::link
