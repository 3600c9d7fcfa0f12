#pragma once

#include <cstdint>
#include <vector>

#include "core/touch/hand.hpp"
#include "schema/wire/messages.hpp"
#include "server/room/pose_inbox.hpp"

namespace hairnet::server {

// The last few samples of one session's hands, which the tick samples at any time. It does not extrapolate as PoseInbox
// does: after the newest sample, hands stay where they are and are soon gone. No clock, no I/O. Tick thread.
class HandsInbox {
 public:
  // As many as of poses: the tick samples both at the same times.
  static constexpr std::size_t kSamplesMax = PoseInbox::kPosesMax;
  // Hands are gone when nothing newer has come for so long.
  static constexpr std::int64_t kGone_ns = 500'000'000;

  using Put = PoseInbox::Put;
  // The capture time is on the server's clock, as `now_ns` is. Asserts that the hands are valid. The jumps of a sample
  // that comes after a newer one pass to the next sample.
  Put put(const wire::HandsSample& sample, std::int64_t now_ns);

  // The hands at a time, valid. Before the first sample: as they are in it. Between two samples the hands are those of
  // the earlier one; a hand that both have, by its number and its count of shapes, moves to where the later one has it,
  // with the later one's shapes, unless it jumps there. After the newest sample they stay, for kGone_ns. `has_jumped`
  // tells, once, that a jump lies between the last call's time and this one's; also that a hand went and came back.
  std::vector<Hand> sample(std::int64_t time_ns);

  // A sample is newer than that time.
  [[nodiscard]] bool is_newer_than(std::int64_t time_ns) const;

  // All hands are gone until the next sample.
  void end();

 private:
  void check_invariants() const;

  // Their capture times and sequences rise. A hand that the sample before did not have has jumped; what has been
  // reported has not.
  std::vector<wire::HandsSample> samples_;
  // Has a bit for the first number of each hand that jumped in samples which came too late.
  std::uint32_t late_jumps_ = 0;
};

}  // namespace hairnet::server
