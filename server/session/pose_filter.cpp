#include "server/session/pose_filter.hpp"

#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "core/assert.hpp"
#include "schema/wire/earlier_pose.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;

// A pose that was captured within this time of the last one is left out. No headset captures more often than at 250 Hz,
// which is one pose in 4 ms. Without this bound, a client could fill the 32 places of its PoseInbox with poses of
// nearly the same time, which would push out those that the tick needs.
constexpr std::int64_t kPoseSpacing_ns = 4'000'000;
constexpr const char* kFarCapture = "capture time is far from the envelope's clock";

Counter* counter_of(wire::PoseRefusal refusal, SessionCounters& counters) {
  switch (refusal) {
    case wire::PoseRefusal::none:
      return nullptr;
    case wire::PoseRefusal::not_finite:
      return &counters.poses_rejected_not_finite;
    case wire::PoseRefusal::not_unit:
      return &counters.poses_rejected_not_unit;
    case wire::PoseRefusal::too_far:
      return &counters.poses_rejected_too_far;
  }
  return nullptr;
}

}  // namespace

void PoseFilter::add_missing(wire::PoseBatch& batch) {
  std::vector<wire::PoseSample> missing;
  for (const wire::EarlierPose& earlier : batch.earlier) {
    const wire::PoseSample* later = wire::first_of(batch.poses, earlier.character);
    // The decoder has checked that the batch has a pose of the same character.
    HAIRNET_ASSERT(later);
    const auto own = identity.characters.find(earlier.character);
    // Unsigned, so that the sequence may wrap.
    const std::uint32_t sequence = later->sequence - earlier.sequence_before;
    if (own != identity.characters.end() && own->second.pose_sequence &&
        !wire::is_newer_sequence(sequence, *own->second.pose_sequence))
      counters.poses_repeated.add();
    else
      missing.push_back(wire::from_earlier(earlier, *later));
  }
  // Earlier poses go in front, since the inbox refuses a pose that comes after a newer one.
  batch.poses.insert(batch.poses.begin(), missing.begin(), missing.end());
}

Refused PoseFilter::check(wire::PoseSample& sample) {
  const auto own = identity.characters.find(sample.character);
  // Numbers are per session, so no client can name another session's character.
  if (own == identity.characters.end()) {
    counters.poses_rejected_character.add();
    return {ErrorReason::character_unknown, "pose of character " + std::to_string(sample.character)};
  }
  const wire::PoseRefusal refusal = wire::validate_pose(sample.pose);
  if (Counter* counter = counter_of(refusal, counters)) {
    counter->add();
    return {ErrorReason::pose_invalid, wire::to_string(refusal)};
  }
  const std::optional<std::int64_t> captured_ns = clock.to_server(sample.capture_time_ns);
  if (!captured_ns) {
    counters.poses_rejected_time.add();
    return {ErrorReason::pose_invalid, kFarCapture};
  }
  // The tick asserts this.
  HAIRNET_VALIDATE(is_valid(sample.pose));
  sample.capture_time_ns = *captured_ns;
  // Only a valid pose moves the sequence: after an invalid one with a high number, add_missing() would take valid poses
  // for known ones.
  std::optional<std::uint32_t>& newest = own->second.pose_sequence;
  if (!newest || wire::is_newer_sequence(sample.sequence, *newest)) newest = sample.sequence;
  return {};
}

Refused PoseFilter::check(wire::HandsSample& sample) {
  const std::optional<std::int64_t> captured_ns = clock.to_server(sample.capture_time_ns);
  if (!captured_ns) {
    counters.hands_rejected_time.add();
    return {ErrorReason::touch_invalid, kFarCapture};
  }
  // The decoder has checked this.
  HAIRNET_VALIDATE(validate(sample.hands).empty());
  sample.capture_time_ns = *captured_ns;
  return {};
}

bool PoseFilter::is_too_close(wire::PoseSample& sample) {
  OwnCharacter& character = identity.characters.at(sample.character);
  if (character.pose_ns && std::abs(sample.capture_time_ns - *character.pose_ns) < kPoseSpacing_ns) {
    // A teleport that is dropped with its pose would turn into a fast motion, which flings the hair.
    character.teleport_pending = character.teleport_pending || sample.teleport;
    counters.poses_thinned.add();
    return true;
  }
  character.pose_ns = sample.capture_time_ns;
  sample.teleport = std::exchange(character.teleport_pending, false) || sample.teleport;
  return false;
}

}  // namespace hairnet::server
