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
  // Bounds the pose batches that wait beside those that were pushed last: more than two seconds at 30 Hz.
  static constexpr std::size_t kPoseBatchesMax = 64;
  // Bounds all other messages that wait.
  static constexpr std::size_t kOthersMax = 65'536;

  // False when full: the caller has sent more requests than any server accepts.
  [[nodiscard]] bool push(wire::ClientMessage message);
  // Adds the poses to the batch at the end of the queue, unless that batch has one of their characters: programs push
  // one character after another. All these poses are queued; where there are then too many batches, the oldest ones are
  // dropped. A dropped pose's teleport passes to the character's next pose.
  void push_poses(std::vector<wire::PoseSample> poses);
  // The hands travel with the next poses, or alone where no poses are next. They replace the hands that wait; a jump of
  // a waiting hand passes to the new hand of its number.
  void push_hands(wire::HandsSample hands);
  // Takes back hands that did not fit beside poses: they are the next message, alone.
  void put_back(wire::HandsSample hands);
  // Returns the number of poses in the message that is next; 0: the next message has no poses, or none waits.
  [[nodiscard]] std::size_t next_pose_count() const;
  // Returns the next message; none: the queue is empty. A batch of more than `poses_max` poses is divided, and its
  // other poses are next.
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
  // The newest hands that wait.
  std::optional<wire::HandsSample> hands_;
  // The characters of the batch that was pushed last.
  std::set<std::uint32_t> in_last_;
  // The characters whose next pose must be sent as a teleport.
  std::set<std::uint32_t> teleport_pending_;
  std::uint64_t poses_dropped_ = 0;
};

}  // namespace hairnet::link
