#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <vector>

#include "schema/wire/messages.hpp"

namespace hairnet::link {

// Messages that wait to be sent, in order; groom bytes are in UploadQueue. Bounded: when the connection is too slow,
// the queue drops the oldest pose batches, which newer poses replace anyway. No I/O; one thread.
class SendQueue {
 public:
  static constexpr std::size_t kPoseBatchesMax = 64;  // beside those pushed last
  static constexpr std::size_t kOthersMax = 65'536;

  // False when full: the caller has sent more requests than any server accepts.
  [[nodiscard]] bool push(wire::ClientMessage message);
  // A batch that waits last takes them in, unless it has one of their characters: programs push one character after
  // another. All are queued: where there are too many batches with them, those pushed before are dropped. A dropped
  // pose's teleport passes to the character's next pose.
  void push_poses(std::vector<wire::PoseSample> poses);
  // They travel with the next poses, or alone where other messages or none are next. They replace those that wait: a
  // jump of a hand passes on.
  void push_hands(wire::HandsSample hands);
  // They have no place beside poses: they are next, alone, or newer ones in their place.
  void put_back(wire::HandsSample hands);
  // That `pop` would return; 0: another message is next, or none.
  [[nodiscard]] std::size_t next_pose_count() const;
  // Of a larger batch only the first `poses_max` poses; the others are next.
  std::optional<wire::ClientMessage> pop(std::size_t poses_max = wire::kPosesPerBatchMax);
  // Drops everything, since the connection is lost. A teleport among the dropped poses passes to the character's next
  // pose.
  void clear();
  // Drops these poses without queueing them. Their teleports pass on in the same way.
  void drop_poses(const std::vector<wire::PoseSample>& poses);
  [[nodiscard]] bool empty() const { return messages_.empty() && !hands_; }

  [[nodiscard]] std::uint64_t poses_dropped() const { return poses_dropped_; }

 private:
  void drop_oldest_poses();
  void check_invariants() const;

  std::deque<wire::ClientMessage> messages_;
  std::size_t pose_batch_count_ = 0;
  std::optional<wire::HandsSample> hands_;    // the newest that wait
  std::set<std::uint32_t> in_last_;           // characters of the batch that was pushed last
  std::set<std::uint32_t> teleport_pending_;  // characters whose next pose must be sent as a teleport
  std::uint64_t poses_dropped_ = 0;
};

}  // namespace hairnet::link
