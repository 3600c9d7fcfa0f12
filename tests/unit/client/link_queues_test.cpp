#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "client/link/event_queue.hpp"
#include "client/link/send_queue.hpp"
#include "client/link/upload_queue.hpp"

namespace hairnet::link {
namespace {

wire::GroomHash hash_of(std::uint8_t first) {
  wire::GroomHash hash{};
  hash[0] = first;
  return hash;
}

// Byte i has the value i, so that a byte shows from which offset it comes.
UploadQueue::Bytes counted_bytes(std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
}

// Chunks have up to 10 bytes in these tests, and the groom 25: three chunks, the last one not full.
TEST(UploadQueue, sends_nothing_before_it_is_asked_for) {
  UploadQueue uploads(10);
  ASSERT_TRUE(uploads.offer(hash_of(1), counted_bytes(25)));
  EXPECT_FALSE(uploads.next_chunk());
}

TEST(UploadQueue, chunks_make_up_the_bytes_from_the_offset_asked_for) {
  UploadQueue uploads(10);
  uploads.offer(hash_of(1), counted_bytes(25));
  ASSERT_TRUE(uploads.need({hash_of(1), 3}));
  std::vector<std::uint8_t> received;
  while (const auto chunk = uploads.next_chunk()) {
    EXPECT_EQ(chunk->offset, 3 + received.size());
    EXPECT_LE(chunk->bytes.size(), 10u);
    received.insert(received.end(), chunk->bytes.begin(), chunk->bytes.end());
  }
  ASSERT_EQ(received.size(), 22u);
  EXPECT_EQ(received.front(), 3);
  EXPECT_EQ(received.back(), 24);
}

TEST(UploadQueue, the_same_groom_is_offered_once_while_it_is_on_its_way) {
  UploadQueue uploads(10);
  EXPECT_TRUE(uploads.offer(hash_of(1), counted_bytes(25)));
  EXPECT_FALSE(uploads.offer(hash_of(1), counted_bytes(25)));
  uploads.drop(hash_of(1));
  EXPECT_TRUE(uploads.offer(hash_of(1), counted_bytes(25)));
}

TEST(UploadQueue, a_groom_the_server_has_is_kept_for_when_it_asks_again) {
  UploadQueue uploads(10);
  uploads.offer(hash_of(1), counted_bytes(25));
  // An offset at the end of the groom means that the server needs no bytes now, because another client uploads them.
  // If that client leaves, the server asks from where it stopped.
  EXPECT_TRUE(uploads.need({hash_of(1), 25}));
  EXPECT_FALSE(uploads.next_chunk());
  EXPECT_TRUE(uploads.need({hash_of(1), 20}));
  EXPECT_EQ(uploads.next_chunk()->bytes.size(), 5u);
}

TEST(UploadQueue, refuses_unknown_grooms_and_offsets_beyond_the_end) {
  UploadQueue uploads(10);
  uploads.offer(hash_of(1), counted_bytes(25));
  EXPECT_FALSE(uploads.need({hash_of(2), 0}));
  EXPECT_FALSE(uploads.need({hash_of(1), 26}));
  EXPECT_FALSE(uploads.next_chunk());
}

TEST(UploadQueue, a_dropped_groom_sends_no_more) {
  UploadQueue uploads(10);
  uploads.offer(hash_of(1), counted_bytes(25));
  uploads.offer(hash_of(2), counted_bytes(5));
  uploads.need({hash_of(1), 0});
  uploads.need({hash_of(2), 0});
  EXPECT_EQ(uploads.next_chunk()->hash, hash_of(1));
  uploads.drop(hash_of(1));
  EXPECT_EQ(uploads.next_chunk()->hash, hash_of(2));
  EXPECT_FALSE(uploads.next_chunk());
}

std::vector<wire::PoseSample> pose_of(std::uint32_t character, std::uint32_t sequence, bool teleport = false) {
  wire::PoseSample pose;
  pose.character = character;
  pose.sequence = sequence;
  pose.teleport = teleport;
  return {pose};
}

TEST(SendQueue, keeps_the_order_of_what_was_asked_for) {
  SendQueue queue;
  ASSERT_TRUE(queue.push(wire::SetLevel{1, LevelIndex::low}));
  queue.push_poses(pose_of(1, 1));
  ASSERT_TRUE(queue.push(wire::RemoveCharacter{1}));
  EXPECT_TRUE(std::holds_alternative<wire::SetLevel>(*queue.pop()));
  EXPECT_TRUE(std::holds_alternative<wire::PoseBatch>(*queue.pop()));
  EXPECT_TRUE(std::holds_alternative<wire::RemoveCharacter>(*queue.pop()));
  EXPECT_FALSE(queue.pop());
}

TEST(SendQueue, only_the_oldest_poses_are_dropped) {
  SendQueue queue;
  ASSERT_TRUE(queue.push(wire::SetLevel{1, LevelIndex::low}));
  for (std::uint32_t i = 0; i < SendQueue::kPoseBatchesMax + 10; ++i) queue.push_poses(pose_of(1, i));
  // All poses are of one character, so each has a batch of its own, and the 10 oldest batches over the limit go.
  EXPECT_EQ(queue.poses_dropped(), 10u);
  EXPECT_TRUE(std::holds_alternative<wire::SetLevel>(*queue.pop()));
  EXPECT_EQ(std::get<wire::PoseBatch>(*queue.pop()).poses[0].sequence, 10u);
}

// A server that never learns of a teleport would simulate the jump, and hair would fly across the room.
TEST(SendQueue, a_dropped_teleport_passes_to_the_next_pose_of_that_character) {
  SendQueue queue;
  queue.push_poses(pose_of(7, 0, true));
  // The first pose of character 8 joins the batch of character 7, which waits last. Each further pose of 8 needs a
  // batch of its own.
  for (std::uint32_t i = 1; i <= SendQueue::kPoseBatchesMax; ++i) queue.push_poses(pose_of(8, i));
  queue.push_poses(pose_of(7, 1));
  ASSERT_EQ(queue.poses_dropped(), 0u);
  queue.push_poses(pose_of(8, SendQueue::kPoseBatchesMax + 1));
  // The oldest batch holds one pose of each character, since a batch that waits last takes in the poses of others.
  ASSERT_EQ(queue.poses_dropped(), 2u);
  std::vector<std::uint32_t> jumps;
  while (const auto message = queue.pop()) {
    for (const wire::PoseSample& pose : std::get<wire::PoseBatch>(*message).poses)
      if (pose.teleport) jumps.push_back(pose.character);
  }
  EXPECT_EQ(jumps, std::vector<std::uint32_t>{7});
}

TEST(SendQueue, a_dropped_teleport_without_a_next_pose_waits_for_one) {
  SendQueue queue;
  queue.push_poses(pose_of(7, 0, true));
  for (std::uint32_t i = 0; i <= SendQueue::kPoseBatchesMax; ++i) queue.push_poses(pose_of(8, i));
  ASSERT_EQ(queue.poses_dropped(), 2u);
  // A lost connection clears the queue, but the teleport still has to reach the next server.
  queue.clear();
  queue.push_poses(pose_of(7, 1));
  EXPECT_TRUE(std::get<wire::PoseBatch>(*queue.pop()).poses[0].teleport);
}

TEST(SendQueue, large_batches_are_cut_to_the_protocols_limit) {
  SendQueue queue;
  queue.push_poses(std::vector<wire::PoseSample>(wire::kPosesPerBatchMax + 1));
  EXPECT_EQ(std::get<wire::PoseBatch>(*queue.pop()).poses.size(), wire::kPosesPerBatchMax);
  EXPECT_EQ(std::get<wire::PoseBatch>(*queue.pop()).poses.size(), 1u);
  EXPECT_FALSE(queue.pop());
}

TEST(SendQueue, characters_that_are_pushed_one_after_another_go_together_and_none_is_dropped) {
  SendQueue queue;
  // A program with many characters pushes each of them in turn. If each push were a batch, most poses of one round
  // would be dropped.
  const std::uint32_t count = 8 * SendQueue::kPoseBatchesMax;
  for (std::uint32_t i = 1; i <= 3; ++i)
    for (std::uint32_t c = 1; c <= count; ++c) queue.push_poses(pose_of(c, i));
  EXPECT_EQ(queue.poses_dropped(), 0u);
  for (std::uint32_t i = 1; i <= 3; ++i) {
    EXPECT_EQ(queue.next_pose_count(), count);
    const auto batch = std::get<wire::PoseBatch>(*queue.pop());
    ASSERT_EQ(batch.poses.size(), count);
    EXPECT_EQ(batch.poses.back().sequence, i);
  }
  EXPECT_FALSE(queue.pop());
}

// An empty batch is a sign of life. Poses that joined it, or a batch before another message, would be sent in the
// wrong order.
TEST(SendQueue, signs_of_life_and_other_messages_part_batches) {
  SendQueue queue;
  ASSERT_TRUE(queue.push(wire::PoseBatch{}));
  queue.push_poses(pose_of(1, 1));
  ASSERT_TRUE(queue.push(wire::RemoveCharacter{1}));
  queue.push_poses(pose_of(2, 1));
  EXPECT_TRUE(std::get<wire::PoseBatch>(*queue.pop()).poses.empty());
  EXPECT_EQ(std::get<wire::PoseBatch>(*queue.pop()).poses.at(0).character, 1u);
  EXPECT_TRUE(std::holds_alternative<wire::RemoveCharacter>(*queue.pop()));
  EXPECT_EQ(std::get<wire::PoseBatch>(*queue.pop()).poses.at(0).character, 2u);
}

// A datagram has room for three characters (kPosesPerDatagram in link_core.cpp).
TEST(SendQueue, a_batch_leaves_in_parts_where_fewer_poses_are_wanted) {
  SendQueue queue;
  for (std::uint32_t c = 1; c <= 7; ++c) queue.push_poses(pose_of(c, 1));
  std::vector<std::uint32_t> left;
  for (const std::size_t wanted : {3u, 3u, 1u}) {
    const auto batch = std::get<wire::PoseBatch>(*queue.pop(3));
    EXPECT_EQ(batch.poses.size(), wanted);
    for (const wire::PoseSample& pose : batch.poses) left.push_back(pose.character);
  }
  EXPECT_EQ(left, (std::vector<std::uint32_t>{1, 2, 3, 4, 5, 6, 7}));
  EXPECT_FALSE(queue.pop(3));
}

TEST(SendQueue, refuses_more_messages_than_its_bound) {
  SendQueue queue;
  for (std::size_t i = 0; i < SendQueue::kOthersMax; ++i) ASSERT_TRUE(queue.push(wire::RemoveCharacter{1}));
  EXPECT_FALSE(queue.push(wire::RemoveCharacter{1}));
}

FrameBatch frames_at(std::uint64_t tick, std::size_t numbers, bool discontinuous = false) {
  FrameBatch batch;
  batch.tick = tick;
  batch.frames.resize(1);
  batch.frames[0].member = 1;
  batch.frames[0].discontinuous = discontinuous;
  batch.frames[0].coefficients.resize(numbers);
  return batch;
}

TEST(UploadQueueDeathTest, an_offer_without_bytes_stops_the_program) {
  UploadQueue uploads(1000);
  EXPECT_DEATH(uploads.offer({1}, nullptr), "assertion failed: bytes");
}

TEST(EventQueue, events_come_in_order_and_only_once) {
  EventQueue events;
  ASSERT_TRUE(events.push(wire::CharacterAdded{1, {}, LevelIndex::high, 1}));
  ASSERT_TRUE(events.push(frames_at(5, 3)));
  const std::vector<Event> taken = events.take_all();
  ASSERT_EQ(taken.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<wire::CharacterAdded>(taken[0]));
  EXPECT_TRUE(std::holds_alternative<FrameBatch>(taken[1]));
  EXPECT_TRUE(events.take_all().empty());
}

TEST(EventQueue, the_oldest_frames_are_dropped_and_counted_and_pass_on_their_discontinuities) {
  EventQueue events;
  // Each frame has a quarter of the bound and a little more, so three of the five fit.
  constexpr std::size_t kNumbers = EventQueue::kFrameBytesMax / 4 / sizeof(float);
  ASSERT_TRUE(events.push(wire::CharacterAdded{1, {}, LevelIndex::high, 1}));
  for (std::uint64_t tick = 0; tick < 5; ++tick) ASSERT_TRUE(events.push(frames_at(tick, kNumbers, tick == 1)));
  EXPECT_EQ(events.frames_dropped(), 2u);
  const std::vector<Event> taken = events.take_all();
  ASSERT_EQ(taken.size(), 4u);
  EXPECT_TRUE(std::holds_alternative<wire::CharacterAdded>(taken[0]));
  EXPECT_EQ(std::get<FrameBatch>(taken[1]).tick, 2u);
  EXPECT_TRUE(std::get<FrameBatch>(taken[1]).frames[0].discontinuous);
  EXPECT_FALSE(std::get<FrameBatch>(taken[2]).frames[0].discontinuous);
}

TEST(EventQueue, nothing_comes_after_the_end) {
  EventQueue events;
  events.push_last({wire::GoodbyeReason::server_draining, "first"});
  EXPECT_TRUE(events.push(frames_at(1, 3)));
  events.push_last({wire::GoodbyeReason::none, "second"});
  const std::vector<Event> taken = events.take_all();
  ASSERT_EQ(taken.size(), 1u);
  EXPECT_EQ(std::get<Disconnected>(taken[0]).detail, "first");
}

}  // namespace
}  // namespace hairnet::link
