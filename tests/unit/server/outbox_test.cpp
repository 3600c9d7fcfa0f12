#include "server/session/outbox.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hairnet::server {
namespace {

using testing::ElementsAre;

constexpr std::size_t kControlBytes = 4096;
constexpr std::size_t kFrameBytes = 2048;

wire::Frame frame(std::uint32_t character, std::size_t nodes = 0, bool discontinuous = false) {
  wire::Frame made;
  made.character = character;
  made.level = nodes ? LevelIndex::low : LevelIndex::rigid;
  made.discontinuous = discontinuous;
  if (nodes) {
    made.quantum_m = wire::kQuantumMin_m;
    made.displacements.assign(3 * nodes, 7);
  }
  return made;
}

class OutboxTest : public testing::Test {
 protected:
  // The next message; nothing waits when it holds a Hello.
  wire::Message take() {
    std::vector<std::uint8_t> packet;
    if (!outbox_.take(packet, 0)) return wire::Hello{};
    taken_bytes_ = packet.size();
    wire::Decoded decoded = wire::decode_packet(packet);
    EXPECT_EQ(decoded.error, wire::DecodeError::none) << decoded.detail;
    return decoded.envelope.message;
  }
  wire::FrameBatch take_frames() { return std::get<wire::FrameBatch>(take()); }

  SessionCounters counters_;
  Outbox outbox_{kControlBytes, kFrameBytes, counters_};
  std::size_t taken_bytes_ = 0;
};

TEST_F(OutboxTest, sends_control_in_order_and_before_frames) {
  outbox_.push_frames(1, 10, {frame(1)});
  outbox_.push(wire::CharacterAdded{2, {}, LevelIndex::low}, 0);
  outbox_.push(wire::CharacterAdded{3, {}, LevelIndex::low}, 0);
  EXPECT_EQ(std::get<wire::CharacterAdded>(take()).character, 2u);
  EXPECT_EQ(std::get<wire::CharacterAdded>(take()).character, 3u);
  EXPECT_EQ(take_frames().frames.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<wire::Hello>(take()));
}

TEST_F(OutboxTest, the_newest_frame_of_a_character_wins_and_inherits_a_discontinuity) {
  outbox_.push_frames(1, 10, {frame(1, 0, true), frame(2)});
  outbox_.push_frames(2, 20, {frame(1), frame(2)});
  const wire::FrameBatch batch = take_frames();
  EXPECT_EQ(batch.tick, 2u);
  EXPECT_EQ(batch.sample_time_ns, 20);
  ASSERT_EQ(batch.frames.size(), 2u);
  EXPECT_TRUE(batch.frames[0].discontinuous);
  EXPECT_FALSE(batch.frames[1].discontinuous);
  EXPECT_EQ(counters_.frames_superseded.value(), 2u);
  EXPECT_TRUE(std::holds_alternative<wire::Hello>(take()));
}

TEST_F(OutboxTest, frames_of_different_ticks_never_share_a_batch) {
  outbox_.push_frames(1, 10, {frame(1), frame(2)});
  outbox_.push_frames(2, 20, {frame(2)});
  EXPECT_EQ(take_frames().tick, 1u);
  EXPECT_EQ(take_frames().tick, 2u);
}

TEST_F(OutboxTest, splits_a_tick_so_that_no_packet_exceeds_the_bound) {
  std::vector<wire::Frame> frames;
  for (std::uint32_t c = 1; c <= 20; ++c) frames.push_back(frame(c, 100));
  outbox_.push_frames(1, 10, frames);
  std::vector<std::uint32_t> seen;
  while (seen.size() < frames.size()) {
    for (const wire::Frame& f : take_frames().frames) seen.push_back(f.character);
    EXPECT_LE(taken_bytes_, kFrameBytes + wire::kPacketOverheadBytesMax);
  }
  std::sort(seen.begin(), seen.end());
  for (std::uint32_t c = 1; c <= 20; ++c) EXPECT_EQ(seen[c - 1], c);
}

TEST_F(OutboxTest, a_slow_client_gets_all_its_characters_in_turn) {
  std::set<std::uint32_t> seen;
  for (std::uint64_t tick = 1; tick <= 10; ++tick) {
    std::vector<wire::Frame> frames;
    for (std::uint32_t c = 1; c <= 20; ++c) frames.push_back(frame(c, 100));
    outbox_.push_frames(tick, 10, std::move(frames));
    for (const wire::Frame& f : take_frames().frames) seen.insert(f.character);  // one packet a tick
  }
  EXPECT_EQ(seen.size(), 20u);
}

TEST_F(OutboxTest, a_removed_character_loses_its_waiting_frame) {
  outbox_.push_frames(1, 10, {frame(1), frame(2)});
  outbox_.push(wire::CharacterRemoved{1}, 0);
  take();
  const wire::FrameBatch batch = take_frames();
  ASSERT_EQ(batch.frames.size(), 1u);
  EXPECT_EQ(batch.frames[0].character, 2u);
}

TEST_F(OutboxTest, overflows_when_control_messages_exceed_their_bound) {
  for (int i = 0; i < 1000 && !outbox_.overflowed(); ++i)
    outbox_.push(wire::Error{wire::ErrorReason::malformed, 0, {}, "x"}, 0);
  ASSERT_TRUE(outbox_.overflowed());
  // The goodbye still goes out, alone.
  outbox_.push_goodbye({wire::GoodbyeReason::slow_consumer, ""}, 0);
  EXPECT_EQ(std::get<wire::Goodbye>(take()).reason, wire::GoodbyeReason::slow_consumer);
  EXPECT_TRUE(std::holds_alternative<wire::Hello>(take()));
}

TEST_F(OutboxTest, nothing_follows_a_goodbye) {
  outbox_.push_frames(1, 10, {frame(1)});
  outbox_.push_goodbye({wire::GoodbyeReason::server_draining, ""}, 0);
  outbox_.push_frames(2, 20, {frame(1)});
  outbox_.push(wire::CharacterRemoved{1}, 0);
  EXPECT_EQ(std::get<wire::Goodbye>(take()).reason, wire::GoodbyeReason::server_draining);
  EXPECT_TRUE(std::holds_alternative<wire::Hello>(take()));
}

}  // namespace
}  // namespace hairnet::server
