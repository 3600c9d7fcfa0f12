#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/pose/pose.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::server {

// The last few poses of one character, which the tick samples at any time. The tick samples a little in the past (pose
// delay), so that it usually stands between two poses although the network jitters. No clock, no I/O. Tick thread.
class PoseInbox {
 public:
  // The most poses that wait: 0.4 s of them at 72 Hz. More would serve only a client that floods the server.
  static constexpr std::size_t kPosesMax = 32;
  // A pose that is older than this is refused, and so is one that claims to be further in the future.
  static constexpr std::int64_t kAgeMax_ns = 1'000'000'000;
  static constexpr std::int64_t kLeadMax_ns = 1'000'000'000;
  // The longest time for which a head moves on without a newer pose. With a much longer one, a head that has stopped
  // would visibly move on and then jump back.
  static constexpr std::int64_t kExtrapolationMax_ns = 50'000'000;
  // A head that is faster than anyone runs sits in a vehicle. Without newer poses such a head goes straight on, for
  // kRideMax_ns at most: if it stopped after kExtrapolationMax_ns although the vehicle has not, its hair would be flung
  // forward.
  static constexpr double kRideLeast_m_per_s = 13;
  static constexpr std::int64_t kRideMax_ns = 1'000'000'000;
  // Poses up to this much older than the last sampled time stay in the inbox: extrapolation needs two poses.
  static constexpr std::int64_t kHistory_ns = 100'000'000;

  // Whether put() has taken a pose, or why it was refused: older than kAgeMax_ns, older than the newest pose, or
  // further in the future than kLeadMax_ns.
  enum class Put : std::uint8_t { accepted, stale, out_of_order, future };
  // The capture time is on the server's clock, as `now_ns` is. The teleport of a pose that comes after a newer one
  // passes to the next pose.
  Put put(const wire::PoseSample& sample, std::int64_t now_ns);

  enum class Kind : std::uint8_t { none, interpolated, extrapolated, stale, clamped };
  struct Sample {
    // none: no pose has come yet. clamped: before the first pose, or before a teleport: the nearest pose as it is.
    // stale: more than kExtrapolationMax_ns after the newest pose.
    Kind kind = Kind::none;
    // A teleport lies between the last sample and this one.
    bool teleport = false;
    Pose pose;
  };
  // Between two poses: interpolates, except that a teleport jumps at its capture time. Before the first pose: returns
  // it as it is. After the newest: extrapolates from the last two poses for at most kExtrapolationMax_ns, then stops
  // there. A head that rides then goes straight on without turning; after kRideMax_ns it stops, with a teleport.
  Sample sample(std::int64_t time_ns);

  // Capture time of the newest pose; none without a pose.
  [[nodiscard]] std::optional<std::int64_t> newest_ns() const {
    return poses_.empty() ? std::nullopt : std::optional(poses_.back().sample.capture_time_ns);
  }

 private:
  struct Entry {
    wire::PoseSample sample;
    // A Sample has reported its teleport, or has passed a pose without one: each teleport is reported once.
    bool teleport_reported = false;
    // A Sample has reported that the head stopped after kRideMax_ns without a newer pose.
    bool ride_ended = false;
  };
  // The sample at a time after the newest pose: extrapolates, stops, or goes straight on in a vehicle.
  Sample beyond_newest(std::int64_t time_ns);
  // Removes poses that later samples cannot need.
  void forget_before(std::int64_t time_ns);
  void check_invariants() const;

  // In the order of their capture times and sequences.
  std::vector<Entry> poses_;
  // A pose with a teleport came too late; the next pose carries it.
  bool has_late_teleport_ = false;
};

}  // namespace hairnet::server
