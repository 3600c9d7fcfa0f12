#include "server/room/pose_inbox.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// The head's speed, for extrapolation, is taken over at least this time: over two closer poses, their jitter would be
// extrapolated too far.
constexpr std::int64_t kSlopeLeast_ns = 8'000'000;
// Poses that are further apart than this tell nothing about the present speed.
constexpr std::int64_t kSlopeMost_ns = 250'000'000;

// How far `at_ns` lies from `from_ns` towards `to_ns`: 0 to 1 between the two, and more beyond.
double fraction(std::int64_t from_ns, std::int64_t to_ns, std::int64_t at_ns) {
  HAIRNET_ASSERT(from_ns < to_ns);
  HAIRNET_ASSERT(at_ns >= from_ns);
  return static_cast<double>(at_ns - from_ns) / static_cast<double>(to_ns - from_ns);
}

void shift(const Vec3& by, Pose& pose) {
  // All bones move alike, since the vehicle moves the whole person.
  for (RigidTransform& bone : pose.bones) bone.position += by;
}

}  // namespace

void PoseInbox::check_invariants() const {
  HAIRNET_ASSERT(poses_.size() <= kPosesMax);
  for (std::size_t i = 1; i < poses_.size(); ++i) {
    HAIRNET_VALIDATE(poses_[i].sample.capture_time_ns > poses_[i - 1].sample.capture_time_ns);
    HAIRNET_VALIDATE(wire::is_newer_sequence(poses_[i].sample.sequence, poses_[i - 1].sample.sequence));
    // sample() marks every pose that its time has passed, so marked poses come first.
    HAIRNET_VALIDATE(poses_[i - 1].teleport_reported || !poses_[i].teleport_reported);
  }
}

PoseInbox::Put PoseInbox::put(const wire::PoseSample& sample, std::int64_t now_ns) {
  // A pose far in the future would make all later poses out of order, so the head would not move until that time.
  if (sample.capture_time_ns > now_ns + kLeadMax_ns) return Put::future;
  if (sample.capture_time_ns < now_ns - kAgeMax_ns) return Put::stale;
  if (!poses_.empty()) {
    const wire::PoseSample& newest = poses_.back().sample;
    if (!wire::is_newer_sequence(sample.sequence, newest.sequence) ||
        sample.capture_time_ns <= newest.capture_time_ns) {
      // A newer pose has overtaken this one in the network. The pose is of no more use, but its teleport is: without
      // the teleport, the head would move fast between the two poses around it.
      if (sample.teleport && wire::is_newer_sequence(newest.sequence, sample.sequence)) has_late_teleport_ = true;
      return Put::out_of_order;
    }
  }
  if (poses_.size() == kPosesMax) {
    // The dropped pose's teleport moves to the next pose, so that it is not lost.
    Entry& next = poses_[1];
    if (poses_[0].sample.teleport && !poses_[0].teleport_reported) next.sample.teleport = true;
    poses_.erase(poses_.begin());
  }
  poses_.push_back({sample});
  if (std::exchange(has_late_teleport_, false)) poses_.back().sample.teleport = true;
  check_invariants();
  return Put::accepted;
}

PoseInbox::Sample PoseInbox::sample(std::int64_t time_ns) {
  if (poses_.empty()) return {};
  // The times of ticks rise, so older poses are not needed again, except for the speed.
  forget_before(time_ns - kHistory_ns);
  HAIRNET_ASSERT(!poses_.empty());
  const auto after = std::find_if(poses_.begin(), poses_.end(),
                                  [&](const Entry& entry) { return entry.sample.capture_time_ns > time_ns; });
  bool teleport = false;
  for (auto entry = poses_.begin(); entry != after; ++entry) {
    teleport |= entry->sample.teleport && !entry->teleport_reported;
    entry->teleport_reported = true;
  }
  if (after == poses_.end()) {
    Sample sample = beyond_newest(time_ns);
    sample.teleport = sample.teleport || teleport;
    return sample;
  }
  // Before the first pose the head stands where that pose has it: an extrapolation backwards would move a head that has
  // just come.
  if (after == poses_.begin()) return {Kind::clamped, teleport, after->sample.pose};
  const wire::PoseSample& a = std::prev(after)->sample;
  const wire::PoseSample& b = after->sample;
  // The head stands at its last place until the time of the teleport, because it does not move between the two places.
  if (b.teleport) return {Kind::clamped, teleport, a.pose};
  return {Kind::interpolated, teleport,
          interpolate(a.pose, b.pose, fraction(a.capture_time_ns, b.capture_time_ns, time_ns))};
}

PoseInbox::Sample PoseInbox::beyond_newest(std::int64_t time_ns) {
  HAIRNET_ASSERT(!poses_.empty());
  const wire::PoseSample& newest = poses_.back().sample;
  HAIRNET_ASSERT(time_ns >= newest.capture_time_ns);
  // At exactly its time the newest pose needs no second one.
  if (time_ns == newest.capture_time_ns) return {Kind::interpolated, false, newest.pose};
  const std::int64_t to_ns = std::min(time_ns, newest.capture_time_ns + kExtrapolationMax_ns);
  const Kind kind = to_ns == time_ns ? Kind::extrapolated : Kind::stale;
  // The speed is that between the newest pose and the next earlier one that is at least kSlopeLeast_ns older. A
  // teleport between the two ends the search, because a speed across a teleport means nothing.
  bool crosses_teleport = newest.teleport;
  for (std::size_t i = poses_.size() - 1; i-- > 0 && !crosses_teleport;) {
    const wire::PoseSample& before = poses_[i].sample;
    const std::int64_t span_ns = newest.capture_time_ns - before.capture_time_ns;
    if (span_ns > kSlopeMost_ns) break;
    if (span_ns >= kSlopeLeast_ns) {
      Sample sample{
          kind, false,
          interpolate(before.pose, newest.pose, fraction(before.capture_time_ns, newest.capture_time_ns, to_ns))};
      const Vec3 velocity = head_velocity(before.pose, newest.pose, 1e-9 * static_cast<double>(span_ns));
      if (kind == Kind::extrapolated || velocity.norm() < kRideLeast_m_per_s) return sample;
      // The head is in a vehicle (kRideLeast_m_per_s): from to_ns on it goes straight on at this velocity.
      const std::int64_t ends_ns = newest.capture_time_ns + kRideMax_ns;
      shift(1e-9 * static_cast<double>(std::min(time_ns, ends_ns) - to_ns) * velocity, sample.pose);
      if (time_ns > ends_ns) sample.teleport = !std::exchange(poses_.back().ride_ended, true);
      return sample;
    }
    crosses_teleport = before.teleport;
  }
  return {kind, false, newest.pose};
}

void PoseInbox::forget_before(std::int64_t time_ns) {
  // The last two poses always stay: extrapolation needs them.
  std::size_t passed = 0;
  while (poses_.size() - passed > 2 && poses_[passed + 1].sample.capture_time_ns < time_ns &&
         poses_[passed].teleport_reported)
    ++passed;
  poses_.erase(poses_.begin(), poses_.begin() + static_cast<std::ptrdiff_t>(passed));
  check_invariants();
}

}  // namespace hairnet::server
