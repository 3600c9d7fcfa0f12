#include "client/link/send_queue.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::link {
namespace {

bool holds_poses(const wire::ClientMessage& message) {
  return std::holds_alternative<wire::PoseBatch>(message);
}

// A pose with a teleport was dropped. Marks the character's next waiting pose, from `from` on, as a teleport: it does
// not continue the last pose that the server received. Returns false when no pose of the character waits.
bool carry_teleport(std::deque<wire::ClientMessage>::iterator from,
                    const std::deque<wire::ClientMessage>::iterator& end, std::uint32_t character) {
  for (; from != end; ++from) {
    auto* batch = std::get_if<wire::PoseBatch>(&*from);
    if (!batch) continue;
    const auto next = std::find_if(batch->poses.begin(), batch->poses.end(),
                                   [&](const wire::PoseSample& pose) { return pose.character == character; });
    if (next == batch->poses.end()) continue;
    next->teleport = true;
    return true;
  }
  return false;
}

// Replaces the waiting hands. A jump of a waiting hand passes to the new hand of its number, which has not moved
// continuously to its place either.
void replace(std::optional<wire::HandsSample>& waiting, wire::HandsSample newer) {
  for (Hand& hand : newer.hands) {
    const auto has_jumped = [&](const Hand& before) {
      return before.first_number == hand.first_number && before.has_jumped;
    };
    hand.has_jumped |= waiting && std::ranges::any_of(waiting->hands, has_jumped);
  }
  waiting = std::move(newer);
}

}  // namespace

void SendQueue::check_invariants() const {
  HAIRNET_ASSERT(pose_batch_count_ <= messages_.size());
  HAIRNET_VALIDATE(std::cmp_equal(pose_batch_count_, std::ranges::count_if(messages_, holds_poses)));
}

bool SendQueue::push(wire::ClientMessage message) {
  HAIRNET_ASSERT(pose_batch_count_ <= messages_.size());
  if (messages_.size() - pose_batch_count_ >= kOthersMax) return false;
  pose_batch_count_ += holds_poses(message);
  messages_.push_back(std::move(message));
  return true;
}

void SendQueue::push_poses(std::vector<wire::PoseSample> poses) {
  if (!teleport_pending_.empty()) {
    // The pose with the teleport was dropped. Without its mark on the next pose the server would see a fast motion, and
    // the hair would swing.
    for (wire::PoseSample& pose : poses) pose.teleport |= teleport_pending_.erase(pose.character) != 0;
  }
  auto* const last = messages_.empty() ? nullptr : std::get_if<wire::PoseBatch>(&messages_.back());
  // Programs push one character after another, so a waiting batch takes the next pose in. A second pose of a character
  // begins a new batch, so that the poses of a batch belong to one time. An empty batch is a sign of life, and stays
  // so.
  const bool continues =
      last && !last->poses.empty() && last->poses.size() + poses.size() <= wire::kPosesPerBatchMax &&
      std::ranges::none_of(poses, [&](const auto& pose) { return in_last_.contains(pose.character); });
  if (!continues) in_last_.clear();
  for (const wire::PoseSample& pose : poses) in_last_.insert(pose.character);
  if (continues) {
    last->poses.insert(last->poses.end(), poses.begin(), poses.end());
    return;
  }
  // The server would use the newest poses only, so the oldest go. Other messages are never dropped: each changes
  // something that lasts.
  while (pose_batch_count_ >= kPoseBatchesMax) drop_oldest_poses();
  for (std::size_t begin = 0; begin < poses.size(); begin += wire::kPosesPerBatchMax) {
    const auto from = poses.begin() + static_cast<std::ptrdiff_t>(begin);
    const std::size_t count = std::min(poses.size() - begin, wire::kPosesPerBatchMax);
    messages_.push_back(wire::PoseBatch{{from, from + static_cast<std::ptrdiff_t>(count)}});
    ++pose_batch_count_;
  }
  check_invariants();
}

void SendQueue::drop_oldest_poses() {
  const auto oldest = std::find_if(messages_.begin(), messages_.end(), holds_poses);
  // pose_batch_count_ has counted a batch, so there is one.
  HAIRNET_ASSERT(oldest != messages_.end());
  const wire::PoseBatch dropped = std::get<wire::PoseBatch>(std::move(*oldest));
  const auto after = messages_.erase(oldest);
  --pose_batch_count_;
  poses_dropped_ += dropped.poses.size();
  for (const wire::PoseSample& pose : dropped.poses) {
    if (pose.teleport && !carry_teleport(after, messages_.end(), pose.character))
      teleport_pending_.insert(pose.character);
  }
}

void SendQueue::push_hands(wire::HandsSample hands) {
  replace(hands_, std::move(hands));
}

void SendQueue::put_back(wire::HandsSample hands) {
  // The datagram had no room for the hands beside its poses. They are the next message, so they are as new as those
  // poses.
  messages_.push_front(wire::PoseBatch{{}, {}, std::move(hands)});
  ++pose_batch_count_;
}

std::size_t SendQueue::next_pose_count() const {
  const auto* next = messages_.empty() ? nullptr : std::get_if<wire::PoseBatch>(&messages_.front());
  return next ? next->poses.size() : 0;
}

std::optional<wire::ClientMessage> SendQueue::pop(std::size_t poses_max) {
  HAIRNET_ASSERT(poses_max > 0);
  const bool is_batch = !messages_.empty() && holds_poses(messages_.front());
  // Hands are put into the batch at the last moment, so that they are the newest.
  if (hands_ && is_batch) replace(std::get<wire::PoseBatch>(messages_.front()).hands, *std::exchange(hands_, {}));
  if (hands_) return wire::PoseBatch{{}, {}, std::exchange(hands_, {})};
  if (messages_.empty()) return std::nullopt;
  if (next_pose_count() > poses_max) {
    auto& waiting = std::get<wire::PoseBatch>(messages_.front());
    const auto end = waiting.poses.begin() + static_cast<std::ptrdiff_t>(poses_max);
    // Hands go with the first part.
    wire::PoseBatch part{{waiting.poses.begin(), end}, {}, std::exchange(waiting.hands, {})};
    waiting.poses.erase(waiting.poses.begin(), end);
    return part;
  }
  wire::ClientMessage message = std::move(messages_.front());
  messages_.pop_front();
  HAIRNET_ASSERT(pose_batch_count_ > 0 || !holds_poses(message));
  pose_batch_count_ -= holds_poses(message);
  return message;
}

void SendQueue::clear() {
  check_invariants();
  for (const wire::ClientMessage& message : messages_) {
    if (const auto* batch = std::get_if<wire::PoseBatch>(&message)) drop_poses(batch->poses);
  }
  messages_.clear();
  hands_.reset();
  pose_batch_count_ = 0;
}

void SendQueue::drop_poses(const std::vector<wire::PoseSample>& poses) {
  poses_dropped_ += poses.size();
  for (const wire::PoseSample& pose : poses) {
    if (pose.teleport) teleport_pending_.insert(pose.character);
  }
}

}  // namespace hairnet::link
