#include "client/link/playout.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::link {
namespace {

constexpr std::size_t kFramesMax = 256;   // held while nobody samples
constexpr std::size_t kArrivalsMax = 60;  // two seconds at 30 Hz
constexpr std::int64_t kIntervalDefault_ns = 33'333'333;
constexpr std::int64_t kHold_ns = 100'000'000;
constexpr std::int64_t kEaseToRest_ns = 500'000'000;
// The delay changes by at most this share of the time that passes: slower or faster motion that nobody notices.
constexpr double kSlewMax = 0.1;

double smoothstep(double s) {
  return s * s * (3 - 2 * s);
}

}  // namespace

void Playout::push(const wire::Frame& frame, std::int64_t sample_time_ns, std::int64_t arrival_time_ns) {
  observe(sample_time_ns, arrival_time_ns);
  const auto after =
      std::find_if(frames_.begin(), frames_.end(), [&](const Held& held) { return held.time_ns >= sample_time_ns; });
  const bool duplicate = after != frames_.end() && after->time_ns == sample_time_ns;
  if (duplicate || (started_ && sample_time_ns <= shown_.time_ns)) {
    ++dropped_count_;
    return;
  }
  // After a gap the way to the new frame begins at what is on the screen, not at the frame before the gap.
  if (started_ && !frames_.empty() && frames_.back().time_ns < shown_.time_ns) {
    frames_.clear();
    frames_.push_back(shown_);
  }
  Held held{sample_time_ns, frame.discontinuous, frame.asleep, frame.pose, frame.level, {}};
  wire::decode_displacements(frame, held.displacement);
  const auto place =
      std::find_if(frames_.begin(), frames_.end(), [&](const Held& other) { return other.time_ns > sample_time_ns; });
  frames_.insert(place, std::move(held));
  if (frames_.size() > kFramesMax) {
    frames_.pop_front();
    ++dropped_count_;
  }
}

void Playout::observe(std::int64_t sample_time_ns, std::int64_t arrival_time_ns) {
  arrivals_.push_back({sample_time_ns, arrival_time_ns - sample_time_ns});
  if (arrivals_.size() > kArrivalsMax) arrivals_.pop_front();
}

std::int64_t Playout::target_delay_ns() const {
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
  return least + interval + std::max(interval / 2, most - least);
}

// Moves the play time, shown_.time_ns, on to `render_time_ns`.
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
  // With nothing to show anyway, standing still costs nothing and lets late frames be in time again.
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
  return {true, shown_.pose, shown_.level, shown_.displacement, now};
}

void Playout::show_between(const Held& from, const Held& to) {
  shown_.level = from.level;
  const bool joined =
      !to.discontinuous && to.level == from.level &&
      (to.displacement.size() == from.displacement.size() || to.displacement.empty() || from.displacement.empty());
  if (!joined) {
    shown_.pose = from.pose;
    shown_.displacement = from.displacement;
    return;
  }
  const double s = static_cast<double>(shown_.time_ns - from.time_ns) / static_cast<double>(to.time_ns - from.time_ns);
  shown_.pose = interpolate(from.pose, to.pose, s);
  // An empty frame is a lattice at rest.
  shown_.displacement.assign(std::max(from.displacement.size(), to.displacement.size()), Vec3f::Zero());
  for (std::size_t i = 0; i < from.displacement.size(); ++i)
    shown_.displacement[i] += static_cast<float>(1 - s) * from.displacement[i];
  for (std::size_t i = 0; i < to.displacement.size(); ++i)
    shown_.displacement[i] += static_cast<float>(s) * to.displacement[i];
}

void Playout::show_last(const Held& last) {
  const std::int64_t waited = shown_.time_ns - last.time_ns - kHold_ns;
  const double eased = std::clamp(static_cast<double>(waited) / static_cast<double>(kEaseToRest_ns), 0.0, 1.0);
  const float left = last.asleep ? 1 : static_cast<float>(1 - smoothstep(eased));
  shown_.pose = last.pose;
  shown_.level = last.level;
  shown_.displacement = last.displacement;
  for (Vec3f& d : shown_.displacement) d *= left;
}

}  // namespace hairnet::link
