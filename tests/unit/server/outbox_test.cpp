#include "server/session/outbox.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hairnet::server {
namespace {

using Packets = std::vector<FramePacket>;

// This many bytes of messages may wait; the packets of frames do not count.
constexpr std::size_t kControlBytes = 4096;

// Makes this many packets of one tick's frames, with one frame in each.
Packets frames_of(std::uint64_t tick, std::size_t packet_count = 1) {
  Packets packets;
  for (std::size_t p = 0; p < packet_count; ++p) {
    wire::FrameBatch batch;
    batch.tick = tick;
    batch.frames.emplace_back().member = static_cast<std::uint32_t>(p + 1);
    packets.push_back({wire::encode_packet({1, batch}), 1});
  }
  return packets;
}

class OutboxTest : public testing::Test {
 protected:
  // Returns the next message, or a Hello when none waits: servers never send one.
  wire::Message take(std::int64_t now_ns = 0) {
    std::vector<std::uint8_t> packet;
    if (!outbox_.take(packet, may_be_lost_, now_ns)) return wire::Hello{};
    wire::DecodedPacket decoded = wire::decode_packet(packet);
    EXPECT_EQ(decoded.error, wire::DecodeError::none) << decoded.detail;
    clock_ns_ = decoded.envelope.clock_ns;
    return decoded.envelope.message;
  }
  std::uint64_t take_tick() { return std::get<wire::FrameBatch>(take()).tick; }
  bool is_empty() { return std::holds_alternative<wire::Hello>(take()); }

  SessionCounters counters_;
  Outbox outbox_{kControlBytes, counters_};
  std::int64_t clock_ns_ = 0;
  bool may_be_lost_ = false;
};

TEST_F(OutboxTest, sends_messages_and_frames_in_the_order_they_came) {
  outbox_.push(wire::CharacterAdded{2, {}, LevelIndex::low, 1}, 0);
  outbox_.push_frames(frames_of(1));
  outbox_.push(wire::CharacterRemoved{2}, 0);
  EXPECT_EQ(std::get<wire::CharacterAdded>(take()).character, 2u);
  EXPECT_EQ(take_tick(), 1u);
  EXPECT_EQ(std::get<wire::CharacterRemoved>(take()).character, 2u);
  EXPECT_TRUE(is_empty());
  EXPECT_EQ(counters_.frames_sent.value(), 1u);
}

// The last argument of the outbox is the largest datagram of its connection, bytes: packets may be lost only where
// there are datagrams.
TEST_F(OutboxTest, says_which_packets_may_be_lost) {
  Outbox outbox(kControlBytes, counters_, 1024);
  EXPECT_EQ(outbox.datagram_bytes_max(), 1024u);
  Packets frames = frames_of(1, 2);
  frames[1].may_be_lost = true;
  outbox.push(wire::CharacterRemoved{2}, 0);
  outbox.push_frames(std::move(frames));
  std::vector<bool> seen;
  std::vector<std::uint8_t> packet;
  for (bool may_be_lost = false; outbox.take(packet, may_be_lost, 0);) seen.push_back(may_be_lost);
  EXPECT_EQ(seen, (std::vector<bool>{false, false, true}));
}

TEST_F(OutboxTest, packets_that_may_be_lost_need_not_wait_for_others) {
  // Each of three ticks has a message, a packet that must arrive and two that may be lost. While the channel is
  // blocked, datagrams can still be sent.
  Outbox outbox(kControlBytes, counters_, 1024);
  for (std::uint64_t tick = 1; tick <= Outbox::kTicksWaitingMax; ++tick) {
    Packets frames = frames_of(tick, 3);
    frames[1].may_be_lost = frames[2].may_be_lost = true;
    outbox.push(wire::CharacterRemoved{static_cast<std::uint32_t>(tick)}, 0);
    outbox.push_frames(std::move(frames));
  }
  outbox.mark_blocked();
  std::vector<std::uint8_t> packet;
  std::size_t taken = 0;
  for (; outbox.take_unreliable(packet, 9); ++taken) EXPECT_EQ(wire::decode_packet(packet).envelope.clock_ns, 9);
  EXPECT_EQ(taken, 2 * Outbox::kTicksWaitingMax);
  EXPECT_EQ(counters_.frames_sent.value(), taken);
  EXPECT_EQ(outbox.ticks_waiting(), Outbox::kTicksWaitingMax) << "each has a packet that may not be lost";
  std::size_t messages = 0, ticks = 0;
  for (bool may_be_lost = false; outbox.take(packet, may_be_lost, 0);) {
    EXPECT_FALSE(may_be_lost);
    ++(std::holds_alternative<wire::FrameBatch>(wire::decode_packet(packet).envelope.message) ? ticks : messages);
  }
  EXPECT_EQ(messages, Outbox::kTicksWaitingMax);
  EXPECT_EQ(ticks, Outbox::kTicksWaitingMax);
  EXPECT_EQ(outbox.ticks_waiting(), 0u);
}

TEST_F(OutboxTest, only_the_newest_change_of_a_member_waits_and_after_what_came_before_it) {
  outbox_.push(wire::MemberChanged{5, "a", {}}, 0);
  outbox_.push(wire::MemberChanged{6, "b", {}}, 0);
  outbox_.push(wire::MemberLeft{5}, 0);
  outbox_.push(wire::MemberJoined{.member = 5}, 0);
  // A thousand changes would exceed kControlBytes.
  for (int i = 0; i < 1000; ++i) outbox_.push(wire::MemberChanged{5, "newest", {}}, 0);
  EXPECT_FALSE(outbox_.overflowed());
  EXPECT_EQ(std::get<wire::MemberChanged>(take()).tag, "b");
  EXPECT_EQ(std::get<wire::MemberLeft>(take()).member, 5u);
  EXPECT_EQ(std::get<wire::MemberJoined>(take()).member, 5u);
  EXPECT_EQ(std::get<wire::MemberChanged>(take()).tag, "newest");
  EXPECT_TRUE(is_empty());
  // All changes of member 5 but the last are cancelled: the "a", and 999 of the thousand.
  EXPECT_EQ(counters_.messages_cancelled.value(), 1000u);
}

// A client that reads slowly must not get the change of a member of whom it has never heard.
TEST_F(OutboxTest, forgets_the_change_of_a_member_that_leaves_unannounced) {
  outbox_.push(wire::CharacterRemoved{2}, 0);
  outbox_.mark_blocked();
  outbox_.push(wire::MemberJoined{.member = 5}, 0);
  outbox_.push(wire::MemberChanged{5, "a", {}}, 0);
  outbox_.push(wire::MemberLeft{5}, 0);
  EXPECT_EQ(std::get<wire::CharacterRemoved>(take()).character, 2u);
  EXPECT_TRUE(is_empty());
}

TEST_F(OutboxTest, only_the_newest_word_of_who_may_touch_a_member_waits_and_none_of_one_that_leaves_unannounced) {
  outbox_.push(wire::MemberTouch{5, TouchAudience::nobody, {}}, 0);
  outbox_.push(wire::MemberTouch{6, TouchAudience::nobody, {}}, 0);
  outbox_.push(wire::MemberChanged{5, "a", {}}, 0);
  for (int i = 0; i < 1000; ++i) outbox_.push(wire::MemberTouch{5, TouchAudience::everyone, {}}, 0);
  EXPECT_FALSE(outbox_.overflowed());
  EXPECT_EQ(std::get<wire::MemberTouch>(take()).member, 6u);
  EXPECT_EQ(std::get<wire::MemberChanged>(take()).member, 5u);
  EXPECT_EQ(std::get<wire::MemberTouch>(take()).audience, TouchAudience::everyone);
  EXPECT_TRUE(is_empty());
  outbox_.mark_blocked();
  outbox_.push(wire::MemberJoined{.member = 5}, 0);
  outbox_.push(wire::MemberChanged{5, "a", {}}, 0);
  outbox_.push(wire::MemberTouch{5, TouchAudience::everyone, {}}, 0);
  outbox_.push(wire::MemberLeft{5}, 0);
  EXPECT_TRUE(is_empty());
  // A thousand messages give way to a newer one, and three to the member's end.
  EXPECT_EQ(counters_.messages_cancelled.value(), 1003u);
}

// The client knows messages up to number 7 of union Body. These two are later messages of the protocol.
TEST_F(OutboxTest, sends_no_message_that_the_client_does_not_know) {
  outbox_.set_message_max(7);
  outbox_.push(wire::MemberLeft{5}, 0);
  outbox_.push(wire::RoomWind{}, 0);
  EXPECT_TRUE(is_empty());
}

TEST_F(OutboxTest, takes_hands_for_clients_that_know_them_only_and_counts_no_frames_for_them) {
  EXPECT_TRUE(outbox_.takes_room_hands());
  outbox_.push_frames({{wire::encode_packet({1, wire::RoomHands{}}), 0}});
  EXPECT_TRUE(std::holds_alternative<wire::RoomHands>(take()));
  EXPECT_EQ(outbox_.ticks_waiting(), 0u);
  EXPECT_EQ(counters_.frames_sent.value(), 0u);
  outbox_.set_message_max(static_cast<std::uint8_t>(wire::Message(wire::RoomHands{}).index()));
  EXPECT_FALSE(outbox_.takes_room_hands());
}

TEST_F(OutboxTest, offers_frame_datagrams_to_clients_that_know_them_only) {
  EXPECT_FALSE(outbox_.takes_frame_datagrams());
  outbox_.set_datagram_layout(wire::kFrameDatagramLayout);
  EXPECT_TRUE(outbox_.takes_frame_datagrams());
  outbox_.set_datagram_layout(wire::kFrameDatagramLayout + 1);
  EXPECT_TRUE(outbox_.takes_frame_datagrams()) << "who knows a later layout knows those before it";
}

TEST_F(OutboxTest, sets_the_clock_of_a_frame_datagram_when_it_is_taken) {
  Outbox outbox(kControlBytes, counters_, 1024);
  wire::FrameBatch batch;
  batch.frames.emplace_back().member = 1;
  batch.generations = {0};
  outbox.push_frames(
      {{wire::encode_frame_datagram(5, batch), 1, true}, {wire::encode_frame_datagram(5, batch), 1, true}});
  std::vector<std::uint8_t> datagram;
  bool may_be_lost = false;
  ASSERT_TRUE(outbox.take(datagram, may_be_lost, 77));
  EXPECT_TRUE(may_be_lost);
  EXPECT_EQ(wire::decode_frame_datagram(datagram).envelope.clock_ns, 77);
  ASSERT_TRUE(outbox.take_unreliable(datagram, 78));
  EXPECT_EQ(wire::decode_frame_datagram(datagram).envelope.clock_ns, 78);
}

TEST_F(OutboxTest, sets_the_clock_of_every_packet_when_it_is_taken) {
  outbox_.push(wire::CharacterRemoved{2}, 5);
  outbox_.push_frames(frames_of(1));
  take(77);
  EXPECT_EQ(clock_ns_, 77);
  take(99);
  EXPECT_EQ(clock_ns_, 99);
}

TEST_F(OutboxTest, makes_way_only_when_as_many_ticks_wait_as_may) {
  // The connection takes nothing, so the frames of kTicksWaitingMax ticks (3) may wait before the queue drops them.
  outbox_.mark_blocked();
  for (std::uint64_t tick = 1; tick < Outbox::kTicksWaitingMax; ++tick) {
    EXPECT_FALSE(outbox_.drop_if_congested());
    outbox_.push_frames(frames_of(tick, 3));
  }
  EXPECT_FALSE(outbox_.drop_if_congested());
  outbox_.push_frames(frames_of(Outbox::kTicksWaitingMax));
  EXPECT_TRUE(outbox_.drop_if_congested()) << "all of them: each is predicted from the one before";
  EXPECT_TRUE(is_empty());
  EXPECT_EQ(counters_.frames_superseded.value(), 3 * (Outbox::kTicksWaitingMax - 1) + 1);
  EXPECT_FALSE(outbox_.drop_if_congested());
}

TEST_F(OutboxTest, taken_packets_of_a_dropped_tick_count_as_sent) {
  outbox_.push_frames(frames_of(1, 3));
  take();
  outbox_.push_goodbye({}, 0);
  EXPECT_EQ(counters_.frames_sent.value(), 1u);
  EXPECT_EQ(counters_.frames_superseded.value(), 2u);
}

// Each tick has two packets. With one of them taken, the tick still waits, since its frames are not complete; with both
// taken, the queue has room for a tick more.
TEST_F(OutboxTest, a_tick_waits_until_its_last_packet_is_taken) {
  for (std::uint64_t tick = 1; tick <= Outbox::kTicksWaitingMax; ++tick) outbox_.push_frames(frames_of(tick, 2));
  EXPECT_EQ(take_tick(), 1u);
  outbox_.mark_blocked();
  EXPECT_TRUE(outbox_.drop_if_congested());
  for (std::uint64_t tick = 1; tick <= Outbox::kTicksWaitingMax; ++tick) outbox_.push_frames(frames_of(tick, 2));
  take();
  take();
  outbox_.mark_blocked();
  EXPECT_FALSE(outbox_.drop_if_congested());
}

TEST_F(OutboxTest, ticks_without_an_attempt_to_send_are_no_sign_of_a_slow_client) {
  // A late server runs several ticks before its I/O thread sends again, so kTicksUnseenMax ticks (8) may wait.
  for (std::uint64_t tick = 1; tick <= Outbox::kTicksUnseenMax; ++tick) {
    EXPECT_FALSE(outbox_.drop_if_congested()) << tick;
    outbox_.push_frames(frames_of(tick));
  }
  EXPECT_TRUE(outbox_.drop_if_congested()) << "they do not pile up forever";
  EXPECT_EQ(counters_.frames_superseded.value(), Outbox::kTicksUnseenMax);
}

TEST_F(OutboxTest, a_connection_that_takes_packets_again_is_not_limited_any_more) {
  outbox_.mark_blocked();
  outbox_.push_frames(frames_of(1));
  EXPECT_EQ(take_tick(), 1u);
  for (std::uint64_t tick = 2; tick <= 1 + Outbox::kTicksWaitingMax; ++tick) outbox_.push_frames(frames_of(tick));
  EXPECT_FALSE(outbox_.drop_if_congested());
}

TEST_F(OutboxTest, frames_that_make_way_leave_messages_where_they_are) {
  outbox_.push(wire::CharacterRemoved{1}, 0);
  for (std::uint64_t tick = 1; tick <= Outbox::kTicksWaitingMax; ++tick) outbox_.push_frames(frames_of(tick));
  outbox_.push(wire::CharacterRemoved{2}, 0);
  outbox_.mark_blocked();
  ASSERT_TRUE(outbox_.drop_if_congested());
  EXPECT_EQ(std::get<wire::CharacterRemoved>(take()).character, 1u);
  EXPECT_EQ(std::get<wire::CharacterRemoved>(take()).character, 2u);
  EXPECT_TRUE(is_empty());
}

TEST_F(OutboxTest, overflows_when_messages_exceed_their_bound) {
  // A thousand errors exceed kControlBytes.
  for (int i = 0; i < 1000 && !outbox_.overflowed(); ++i)
    outbox_.push(wire::Error{wire::ErrorReason::malformed, 0, {}, "x"}, 0);
  ASSERT_TRUE(outbox_.overflowed());
  // The goodbye still goes out, alone.
  outbox_.push_goodbye({wire::GoodbyeReason::slow_consumer, ""}, 0);
  EXPECT_EQ(std::get<wire::Goodbye>(take()).reason, wire::GoodbyeReason::slow_consumer);
  EXPECT_TRUE(is_empty());
}

TEST_F(OutboxTest, a_member_that_leaves_before_a_slow_client_was_told_leaves_no_trace) {
  // Members that come and go while a client does not read must not fill its queue, or a lively room would end it.
  outbox_.push(wire::MemberLeft{1}, 0);
  outbox_.mark_blocked();
  for (int i = 0; i < 1000; ++i) {
    outbox_.push(wire::MemberJoined{1, 9, 1, {}}, 0);
    outbox_.push(wire::MemberJoined{2, 9, 2, {}}, 0);
    outbox_.push(wire::MemberLeft{2}, 0);
    outbox_.push(wire::MemberLeft{1}, 0);
  }
  outbox_.push(wire::MemberJoined{2, 9, 7, {}}, 0);
  EXPECT_EQ(outbox_.packet_count(), 2u);
  EXPECT_EQ(counters_.messages_cancelled.value(), 2000u);
  EXPECT_FALSE(outbox_.overflowed());
  EXPECT_EQ(std::get<wire::MemberLeft>(take()).member, 1u);
  EXPECT_EQ(std::get<wire::MemberJoined>(take()).character, 7u);
  EXPECT_EQ(outbox_.control_bytes_waiting(), 0u);
}

TEST_F(OutboxTest, a_member_that_the_client_knows_leaves_by_a_message) {
  outbox_.push(wire::MemberJoined{1, 9, 1, {}}, 0);
  outbox_.push(wire::MemberJoined{2, 9, 2, {}}, 0);
  take();
  outbox_.mark_blocked();
  outbox_.push(wire::MemberLeft{1}, 0);
  EXPECT_EQ(std::get<wire::MemberJoined>(take()).member, 2u);
  EXPECT_EQ(std::get<wire::MemberLeft>(take()).member, 1u);
}

TEST_F(OutboxTest, a_client_that_reads_gets_every_message) {
  outbox_.push(wire::MemberJoined{1, 9, 1, {}}, 0);
  outbox_.push_frames(frames_of(1));
  outbox_.push(wire::MemberLeft{1}, 0);
  EXPECT_EQ(std::get<wire::MemberJoined>(take()).member, 1u);
  EXPECT_EQ(take_tick(), 1u);
  EXPECT_EQ(std::get<wire::MemberLeft>(take()).member, 1u);
}

// The member's MemberJoined is cancelled, but a tick with its frames waits already. The client could not say whose they
// are, so that tick's frames go, and the sender of frames must learn of the loss.
TEST_F(OutboxTest, frames_of_a_member_that_the_client_never_hears_of_are_dropped) {
  outbox_.mark_blocked();
  outbox_.push(wire::MemberJoined{1, 9, 1, {}}, 0);
  outbox_.push_frames(frames_of(1));
  outbox_.push(wire::MemberLeft{1}, 0);
  EXPECT_TRUE(outbox_.drop_if_congested());
  EXPECT_FALSE(outbox_.drop_if_congested());
  EXPECT_TRUE(is_empty());
  outbox_.mark_blocked();
  outbox_.push_frames(frames_of(2));
  outbox_.push(wire::MemberJoined{1, 9, 1, {}}, 0);
  outbox_.push(wire::MemberLeft{1}, 0);
  EXPECT_FALSE(outbox_.drop_if_congested()) << "those frames are older than the member";
  EXPECT_EQ(take_tick(), 2u);
}

TEST_F(OutboxTest, a_message_is_overdue_after_its_wait_and_the_time_of_those_before_it) {
  // A message may wait for a second, and longer by the time that the messages before it take at kReadLeast_bytes_per_s.
  // So a long queue does not make a client slow that reads well.
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  EXPECT_FALSE(outbox_.is_overdue(100 * kSecond_ns, kSecond_ns)) << "nothing waits";
  outbox_.push_frames(frames_of(1));
  EXPECT_FALSE(outbox_.is_overdue(100 * kSecond_ns, kSecond_ns)) << "frames make way, so they may wait";
  outbox_.push(wire::Error{wire::ErrorReason::malformed, 0, {}, std::string(1000, 'x')}, 0);
  const auto first_bytes = static_cast<double>(outbox_.control_bytes_waiting());
  outbox_.push(wire::CharacterRemoved{1}, 0);
  EXPECT_FALSE(outbox_.is_overdue(kSecond_ns, kSecond_ns));
  EXPECT_TRUE(outbox_.is_overdue(kSecond_ns + 1, kSecond_ns));
  take();
  take();
  const auto read_ns = static_cast<std::int64_t>(1e9 * first_bytes / Outbox::kReadLeast_bytes_per_s);
  EXPECT_FALSE(outbox_.is_overdue(kSecond_ns + read_ns, kSecond_ns));
  EXPECT_TRUE(outbox_.is_overdue(kSecond_ns + read_ns + 1, kSecond_ns));
}

using OutboxDeathTest = OutboxTest;

TEST_F(OutboxDeathTest, a_packet_without_bytes_stops_the_program) {
  EXPECT_DEATH(outbox_.push_frames({{{}, 1}}), "assertion failed: !packet.bytes.empty\\(\\)");
}

TEST_F(OutboxTest, nothing_follows_a_goodbye) {
  outbox_.push_frames(frames_of(1));
  outbox_.push_goodbye({wire::GoodbyeReason::server_draining, ""}, 0);
  outbox_.push_frames(frames_of(2));
  outbox_.push(wire::CharacterRemoved{1}, 0);
  EXPECT_EQ(std::get<wire::Goodbye>(take()).reason, wire::GoodbyeReason::server_draining);
  EXPECT_TRUE(is_empty());
}

}  // namespace
}  // namespace hairnet::server
