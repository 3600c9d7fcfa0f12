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
  // The inbox has as many samples as one of poses (32), because the tick samples both at the same times.
  static constexpr std::size_t kSamplesMax = PoseInbox::kPosesMax;
  // Hands vanish when no newer sample has come for this long.
  static constexpr std::int64_t kGone_ns = 500'000'000;

  using Put = PoseInbox::Put;
  // The capture time is on the server's clock, as `now_ns` is. Asserts that the hands are valid. The jumps of a sample
  // that comes after a newer one pass to the next sample.
  Put put(const wire::HandsSample& sample, std::int64_t now_ns);

  // Returns the hands at a time; they are valid. Before the first sample they are those of the first sample. Between
  // two samples they are those of the earlier one; a hand that both samples have, with the same number and count of
  // shapes, moves towards its place in the later one, with the shapes of the later one, unless it jumps there. After
  // the newest sample the hands stay for kGone_ns, and then there are none. `has_jumped` is set once for each jump
  // between the time of the last call and this one, also where a hand went and came back.
  std::vector<Hand> sample(std::int64_t time_ns);

  // A sample is newer than that time.
  [[nodiscard]] bool is_newer_than(std::int64_t time_ns) const;

  // All hands are gone until the next sample.
  void end();

 private:
  void check_invariants() const;

  // In the order of their capture times and sequences. A hand that the sample before does not have is marked as
  // has_jumped; a jump that sample() has reported is not marked any more.
  std::vector<wire::HandsSample> samples_;
  // The jumps of samples that came after a newer one; they pass to the next sample. One bit for each hand, by the
  // number of its first shape.
  std::uint32_t late_jumps_ = 0;
};

}  // namespace hairnet::server
