#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/pose/pose.hpp"

namespace hairnet::server {

struct TimedPose {
  std::uint32_t sequence = 0;
  std::int64_t captured_ns = 0;  // server clock
  bool teleport = false;         // does not continue from the pose before
  Pose pose;
};

// The last few poses of one character, sampled at times of the server's choosing. Pure; tick thread.
class PoseInbox {
 public:
  static constexpr std::size_t kPosesMax = 32;
  static constexpr std::int64_t kAgeMax_ns = 1'000'000'000;
  static constexpr std::int64_t kLeadMax_ns = 1'000'000'000;
  static constexpr std::int64_t kExtrapolationMax_ns = 50'000'000;
  static constexpr std::int64_t kKept_ns = 100'000'000;  // of poses already passed, for the slope of an extrapolation

  enum class Put : std::uint8_t { accepted, stale, out_of_order, future };
  Put put(const TimedPose& pose, std::int64_t now_ns);

  enum class Kind : std::uint8_t { none, interpolated, extrapolated, stale, held };
  struct Sample {
    // none: no pose has ever come; stale: held beyond the longest extrapolation; held: not yet at the next pose
    Kind kind = Kind::none;
    bool teleported = false;  // a teleport lies between the last sample and this one
    Pose pose;
  };
  // Between two poses: interpolated, but a teleport happens at once, at its own time. Before the first: that one. After
  // the newest: along the last two for at most kExtrapolationMax_ns, then held there.
  Sample sample(std::int64_t time_ns);

  // When the newest pose was captured; none has come: nothing.
  [[nodiscard]] std::optional<std::int64_t> newest_ns() const {
    return poses_.empty() ? std::nullopt : std::optional(poses_.back().timed.captured_ns);
  }

 private:
  struct Held {
    TimedPose timed;
    bool reported = false;  // its teleport has been told
  };
  Sample beyond_newest(std::int64_t time_ns) const;
  void forget_before(std::int64_t time_ns);

  std::vector<Held> poses_;  // captured_ns and sequence rise
};

}  // namespace hairnet::server
