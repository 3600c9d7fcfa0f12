#include "server/room/hands_inbox.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

// A hand is named by the number of its first shape, which is below 32.
std::uint32_t bit_of(const Hand& hand) {
  static_assert(kHandShapesMax <= 32);
  return std::uint32_t{1} << hand.first_number;
}

// One bit for each hand that has jumped.
std::uint32_t jumps_of(const std::vector<Hand>& hands) {
  std::uint32_t jumps = 0;
  for (const Hand& hand : hands) jumps |= hand.has_jumped ? bit_of(hand) : 0;
  return jumps;
}

// Marks the hands of these bits as having jumped.
void add_jumps(std::uint32_t jumps, std::vector<Hand>& hands) {
  for (Hand& hand : hands) hand.has_jumped = hand.has_jumped || (jumps & bit_of(hand)) != 0;
}

// The hands as the solver may have them: rotations are of unit length.
std::vector<Hand> normalised(std::vector<Hand> hands) {
  for (Hand& hand : hands) hand.place.rotation.normalize();
  return hands;
}

}  // namespace

void HandsInbox::check_invariants() const {
  HAIRNET_ASSERT(samples_.size() <= kSamplesMax);
  for (std::size_t i = 1; i < samples_.size(); ++i) {
    HAIRNET_VALIDATE(samples_[i].capture_time_ns > samples_[i - 1].capture_time_ns);
    HAIRNET_VALIDATE(wire::is_newer_sequence(samples_[i].sequence, samples_[i - 1].sequence));
  }
}

HandsInbox::Put HandsInbox::put(const wire::HandsSample& sample, std::int64_t now_ns) {
  HAIRNET_VALIDATE(validate(sample.hands).empty());
  if (sample.capture_time_ns > now_ns + PoseInbox::kLeadMax_ns) return Put::future;
  if (sample.capture_time_ns < now_ns - PoseInbox::kAgeMax_ns) return Put::stale;
  if (!samples_.empty()) {
    const wire::HandsSample& newest = samples_.back();
    if (!wire::is_newer_sequence(sample.sequence, newest.sequence) ||
        sample.capture_time_ns <= newest.capture_time_ns) {
      // A newer sample has overtaken this one in the network. The newer sample does not have this jump, so the hand
      // would move through everything between the two places.
      if (wire::is_newer_sequence(newest.sequence, sample.sequence)) late_jumps_ |= jumps_of(sample.hands);
      return Put::out_of_order;
    }
  }
  if (samples_.size() == kSamplesMax) {
    // The inbox is full: the oldest sample goes, and its jumps pass to the next.
    add_jumps(jumps_of(samples_[0].hands), samples_[1].hands);
    samples_.erase(samples_.begin());
  }
  wire::HandsSample next = sample;
  next.hands = normalised(std::move(next.hands));
  add_jumps(std::exchange(late_jumps_, 0), next.hands);
  if (!samples_.empty()) {
    const wire::HandsSample& before = samples_.back();
    // A hand that comes back after such a gap may be anywhere: it must not sweep through the hair on its way.
    const bool were_gone = next.capture_time_ns - before.capture_time_ns > kGone_ns;
    for (Hand& hand : next.hands) hand.has_jumped = hand.has_jumped || were_gone || !find_same(hand, before.hands);
  }
  samples_.push_back(std::move(next));
  check_invariants();
  return Put::accepted;
}

std::vector<Hand> HandsInbox::sample(std::int64_t time_ns) {
  if (samples_.empty()) return {};
  const auto after = std::ranges::upper_bound(samples_, time_ns, {}, &wire::HandsSample::capture_time_ns);
  if (after == samples_.begin()) {
    std::vector<Hand> hands = after->hands;
    // The hand jumps at its capture time, which is still to come.
    for (Hand& hand : hands) hand.has_jumped = false;
    return hands;
  }
  std::uint32_t jumps = 0;
  for (auto passed = samples_.begin(); passed != after; ++passed) jumps |= jumps_of(passed->hands);
  // The sample that is now in force stays as the first, because later calls move from it.
  const auto now = samples_.erase(samples_.begin(), std::prev(after));
  for (Hand& hand : now->hands) hand.has_jumped = false;
  // A client that falls silent must not leave its hands in someone's hair.
  if (time_ns - now->capture_time_ns > kGone_ns) return {};
  std::vector<Hand> hands = now->hands;
  add_jumps(jumps, hands);
  const auto next = std::next(now);
  if (next == samples_.end()) return hands;
  const double share = static_cast<double>(time_ns - now->capture_time_ns) /
                       static_cast<double>(next->capture_time_ns - now->capture_time_ns);
  move_towards(next->hands, share, hands);
  HAIRNET_VALIDATE(validate(hands).empty());
  return hands;
}

bool HandsInbox::is_newer_than(std::int64_t time_ns) const {
  return !samples_.empty() && samples_.back().capture_time_ns > time_ns;
}

void HandsInbox::end() {
  if (samples_.empty()) return;
  // The newest sample stays, without hands: its sequence and time still refuse older samples that come late.
  samples_.erase(samples_.begin(), std::prev(samples_.end()));
  samples_.back().hands.clear();
  late_jumps_ = 0;
}

}  // namespace hairnet::server
