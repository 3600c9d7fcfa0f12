#include "server/room/pose_inbox.hpp"

#include <algorithm>

namespace hairnet::server {
namespace {

// A slope spans at least this time: over two close poses, jitter would be extrapolated too far.
constexpr std::int64_t kSlopeLeast_ns = 8'000'000;
constexpr std::int64_t kSlopeMost_ns = 250'000'000;

double fraction(std::int64_t from_ns, std::int64_t to_ns, std::int64_t at_ns) {
  return static_cast<double>(at_ns - from_ns) / static_cast<double>(to_ns - from_ns);
}

// Sequences wrap.
bool is_newer(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::int32_t>(a - b) > 0;
}

}  // namespace

PoseInbox::Put PoseInbox::put(const TimedPose& pose, std::int64_t now_ns) {
  if (pose.captured_ns > now_ns + kLeadMax_ns) return Put::future;
  if (pose.captured_ns < now_ns - kAgeMax_ns) return Put::stale;
  if (!poses_.empty()) {
    const TimedPose& newest = poses_.back().timed;
    if (!is_newer(pose.sequence, newest.sequence) || pose.captured_ns <= newest.captured_ns) return Put::out_of_order;
  }
  if (poses_.size() == kPosesMax) {
    // The dropped pose's teleport moves to the next pose, so that it is not lost.
    Entry& next = poses_[1];
    if (poses_[0].timed.teleport && !poses_[0].reported) next.timed.teleport = true;
    poses_.erase(poses_.begin());
  }
  poses_.push_back({pose});
  return Put::accepted;
}

PoseInbox::Sample PoseInbox::sample(std::int64_t time_ns) {
  if (poses_.empty()) return {};
  forget_before(time_ns - kHistory_ns);
  const auto after =
      std::find_if(poses_.begin(), poses_.end(), [&](const Entry& entry) { return entry.timed.captured_ns > time_ns; });
  bool teleport = false;
  for (auto entry = poses_.begin(); entry != after; ++entry) {
    teleport |= entry->timed.teleport && !entry->reported;
    entry->reported = true;
  }
  if (after == poses_.end()) {
    Sample sample = beyond_newest(time_ns);
    sample.teleport = teleport;
    return sample;
  }
  if (after == poses_.begin()) return {Kind::clamped, teleport, after->timed.pose};
  const TimedPose& a = std::prev(after)->timed;
  const TimedPose& b = after->timed;
  if (b.teleport) return {Kind::clamped, teleport, a.pose};
  return {Kind::interpolated, teleport, interpolate(a.pose, b.pose, fraction(a.captured_ns, b.captured_ns, time_ns))};
}

PoseInbox::Sample PoseInbox::beyond_newest(std::int64_t time_ns) const {
  const TimedPose& newest = poses_.back().timed;
  if (time_ns == newest.captured_ns) return {Kind::interpolated, false, newest.pose};
  const std::int64_t to_ns = std::min(time_ns, newest.captured_ns + kExtrapolationMax_ns);
  const Kind kind = to_ns == time_ns ? Kind::extrapolated : Kind::stale;
  bool crosses_teleport = newest.teleport;
  for (std::size_t i = poses_.size() - 1; i-- > 0 && !crosses_teleport;) {
    const TimedPose& before = poses_[i].timed;
    const std::int64_t span_ns = newest.captured_ns - before.captured_ns;
    if (span_ns > kSlopeMost_ns) break;
    if (span_ns >= kSlopeLeast_ns)
      return {kind, false,
              interpolate(before.pose, newest.pose, fraction(before.captured_ns, newest.captured_ns, to_ns))};
    crosses_teleport = before.teleport;
  }
  return {kind, false, newest.pose};
}

void PoseInbox::forget_before(std::int64_t time_ns) {
  // The last two poses always stay: extrapolation needs them.
  std::size_t passed = 0;
  while (poses_.size() - passed > 2 && poses_[passed + 1].timed.captured_ns < time_ns && poses_[passed].reported)
    ++passed;
  poses_.erase(poses_.begin(), poses_.begin() + static_cast<std::ptrdiff_t>(passed));
}

}  // namespace hairnet::server
