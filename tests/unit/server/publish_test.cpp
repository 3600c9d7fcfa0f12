#include "server/tick/publish.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/learnt/learnt_hair.hpp"
#include "schema/wire/frame_datagram.hpp"
#include "tests/support/frame_reader.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/levels.hpp"

namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// An observer's end of the tick: it decodes and counts what the Publisher pushes. `full` makes the next call of
// drop_if_congested() report a slow connection.
class FakeObserverSink final : public ObserverSink {
 public:
  void push(const wire::Message& message, std::int64_t) override { messages.push_back(message); }
  void push_encoded(const wire::Message&, std::vector<std::uint8_t>, std::int64_t) override {}
  void push_frames(std::vector<FramePacket> packets) override {
    ++ticks_waiting;
    for (const FramePacket& packet : packets) {
      frames_announced += packet.frame_count;
      if (packet.may_be_lost) datagram_bytes.push_back(packet.bytes.size());
      (packet.may_be_lost ? unreliable_frames : reliable_frames) += packet.frame_count;
      const bool is_datagram = wire::is_frame_datagram(packet.bytes);
      EXPECT_EQ(is_datagram, packet.may_be_lost && knows_frame_datagrams);
      batches.push_back(std::get<wire::FrameBatch>(
          (is_datagram ? wire::decode_frame_datagram(packet.bytes) : wire::decode_packet(packet.bytes))
              .envelope.message));
    }
  }
  bool drop_if_congested() override { return std::exchange(full, false); }
  [[nodiscard]] std::size_t datagram_bytes_max() const override { return datagram_max; }
  [[nodiscard]] bool takes_frame_datagrams() const override { return knows_frame_datagrams; }
  [[nodiscard]] double bytes_per_s() const override { return network_bytes_per_s; }

  // Returns the frames of this tick in the order in which they came.
  std::vector<wire::Frame> newest(std::uint64_t tick) const {
    std::vector<wire::Frame> frames;
    for (const wire::FrameBatch& batch : batches) {
      if (batch.tick == tick) frames.insert(frames.end(), batch.frames.begin(), batch.frames.end());
    }
    return frames;
  }
  std::vector<wire::Message> messages;
  std::vector<wire::FrameBatch> batches;
  std::vector<std::size_t> datagram_bytes;
  std::size_t ticks_waiting = 0, frames_announced = 0, unreliable_frames = 0, reliable_frames = 0, datagram_max = 0;
  double network_bytes_per_s = 0;
  bool full = false, knows_frame_datagrams = false;
};

// The characters are rigid and move with every tick, so each frame is a pose without hair.
class PublishTest : public testing::Test {
 protected:
  std::shared_ptr<FakeObserverSink> open(SessionId session) {
    auto sink = std::make_shared<FakeObserverSink>();
    rooms_.open(session, "", sink);
    return sink;
  }
  Character& add(SessionId session, std::uint32_t number) {
    Character& character = *rooms_.add(character_key(session, number), {}, LevelIndex::rigid);
    character.in_world = true;
    inputs_.added.push_back({character.key, {}, 0, false, LevelIndex::rigid, pose()});
    return character;
  }
  void tick() {
    ++inputs_.tick;
    for (auto& [key, character] : rooms_.characters()) {
      character.discontinuous = false;
      inputs_.poses.push_back({key, false, pose()});
    }
    for (auto& [session, observer] : rooms_.observers()) observer.views.resize(rooms_.room(observer.room).slots.size());
    simulation_.step(inputs_);
    publisher_.publish(rooms_, simulation_, inputs_, {}, 1);
    inputs_.added.clear();
    inputs_.poses.clear();
  }
  Pose pose() const { return rigid_pose({Quat::Identity(), {0.01 * static_cast<double>(inputs_.tick), 1, 0}}); }
  RoomCounters room_counters_;
  TickCounters counters_;
  Rooms rooms_{room_counters_, Wind{}, 0, 4096};
  Simulation simulation_{WorldDef{}};
  Publisher publisher_{PublishDef{.packet_bytes_max = 4096}, counters_};
  wire::RecordedTick inputs_;
};

TEST_F(PublishTest, everyone_gets_everyone_coded_once) {
  const auto first = open(1), second = open(2);
  add(1, 4);
  add(2, 4);
  add(2, 5);
  for (int t = 0; t < 5; ++t) tick();
  for (const auto& sink : {first, second}) {
    // Three characters have a frame in each of five ticks.
    EXPECT_EQ(sink->frames_announced, 15u);
    std::vector<std::uint32_t> members;
    for (const wire::Frame& frame : sink->newest(5)) members.push_back(frame.member);
    EXPECT_THAT(members, ElementsAre(1, 2, 3));
  }
  EXPECT_EQ(counters_.frames_encoded.value(), 15u) << "not once an observer";
  EXPECT_EQ(counters_.frames_published.value(), 30u);
}

TEST_F(PublishTest, a_late_joiner_reads_the_first_frame_that_it_gets) {
  const auto early = open(1);
  add(1, 1);
  for (int t = 0; t < 5; ++t) tick();
  const auto late = open(2);
  tick();
  FrameReader reader;
  reader.take(wire::MemberJoined{.member = 1});
  std::vector<std::string> errors;
  ASSERT_EQ(late->batches.size(), 1u);
  EXPECT_EQ(reader.take(late->batches[0], errors).size(), 1u);
  EXPECT_THAT(errors, IsEmpty());
  EXPECT_EQ(early->frames_announced, 6u);
}

// An observer whose connection was full once gets fewer bytes, and later all again. FrameThrottle first makes the hair
// of frames coarser; these frames have no hair, so it can only send fewer of them.
TEST_F(PublishTest, a_slow_connection_restarts_with_fewer_frames) {
  const auto slow = open(1), other = open(2);
  add(1, 1);
  for (int t = 0; t < 5; ++t) tick();
  slow->full = true;
  std::vector<std::uint64_t> ticks;
  for (std::uint64_t t = 6; t <= 600; ++t) {
    tick();
    const auto frames = slow->newest(t);
    if (frames.empty()) continue;
    ticks.push_back(t);
    EXPECT_EQ(frames[0].discontinuous, t == 6) << "it may have missed one";
  }
  // Two seconds after the loss, at 30 ticks a second, half of the 30 ticks of a second have a frame. FrameThrottle
  // supposes that a connection carries twice as much after 6 s, so after 20 s every tick has a frame again.
  const auto begin = std::ranges::lower_bound(ticks, 60u), end = std::ranges::lower_bound(ticks, 90u);
  EXPECT_LE(end - begin, 16) << "every second tick";
  EXPECT_EQ(ticks.back() - ticks[ticks.size() - 2], 1u) << "the stride comes back";
  EXPECT_EQ(counters_.observers_congested.value(), 1u);
  EXPECT_EQ(other->frames_announced, 600u);
}

TEST_F(PublishTest, an_observers_stride_is_kept) {
  const auto sink = open(1);
  rooms_.observer(1)->observe.stride = 4;
  add(1, 1);
  for (int t = 0; t < 13; ++t) tick();
  // With a stride of 4 the frames are those of the ticks 1, 5, 9 and 13.
  EXPECT_EQ(sink->frames_announced, 4u);
  EXPECT_EQ(sink->newest(13).size(), 1u);
}

TEST_F(PublishTest, every_frame_can_be_read_for_any_change_of_strides) {
  // Three observers change their stride, error and view at random, and lose frames. A frame must never depend on
  // another one that its observer did not get. The percentages make each change happen about a hundred times in 3000
  // ticks.
  std::mt19937 random(7);
  const auto chance = [&](unsigned percent) { return random() % 100 < percent; };
  struct Peer {
    std::shared_ptr<FakeObserverSink> sink;
    FrameReader reader;
    std::size_t batches_read = 0;
  };
  std::vector<Peer> peers(3);
  for (SessionId s = 1; s <= peers.size(); ++s) peers[s - 1].sink = open(s);
  for (std::uint32_t c = 1; c <= 2; ++c) add(1, c);
  for (Peer& peer : peers) {
    for (std::uint32_t member = 1; member <= 2; ++member) peer.reader.take(wire::MemberJoined{.member = member});
  }
  std::vector<std::string> errors;
  std::size_t read = 0;
  for (int t = 0; t < 3000; ++t) {
    for (SessionId s = 1; s <= peers.size(); ++s) {
      if (chance(4)) rooms_.observer(s)->observe.stride = 1 << random() % 3;
      if (chance(4)) rooms_.observer(s)->observe.error_m = 1e-3f * static_cast<float>(random() % 30);
      if (chance(3)) peers[s - 1].sink->full = true;
      for (View& view : rooms_.observer(s)->views) {
        if (chance(6)) view.in_view = !view.in_view;
      }
    }
    tick();
    for (Peer& peer : peers) {
      for (; peer.batches_read < peer.sink->batches.size(); ++peer.batches_read) {
        for (const ReadFrame& frame : peer.reader.take(peer.sink->batches[peer.batches_read], errors)) {
          ++read;
          // A pose is rounded by half a step of kHeadPositionStep_m (1/8192 m) along each axis, 0.11 mm in all.
          EXPECT_LT((frame.pose.head().position - pose().head().position).norm(), 2e-4);
        }
      }
    }
  }
  EXPECT_THAT(errors, IsEmpty());
  // Most of 18 000 frames are out of view or skipped by strides; this many show that the test reads frames at all.
  EXPECT_GT(read, 3000u);
}

TEST_F(PublishTest, a_reused_slot_is_another_member_to_everyone) {
  const auto sink = open(1);
  add(1, 1);
  for (int t = 0; t < 5; ++t) tick();
  // The first character leaves, and the second gets its slot and with this its number in frames.
  inputs_.removed.push_back(character_key(1, 1));
  rooms_.remove(character_key(1, 1), 0);
  Character& next = add(1, 2);
  rooms_.observer(1)->views[next.slot] = {};
  tick();
  ASSERT_EQ(sink->newest(6).size(), 1u);
  EXPECT_FALSE(sink->newest(6)[0].discontinuous) << "nothing of it was shown before";
}

TEST_F(PublishTest, no_observer_gets_members_out_of_view_or_unwanted) {
  const auto sink = open(1);
  add(1, 1);
  add(1, 2);
  add(1, 3);
  tick();
  rooms_.observer(1)->views[0].in_view = false;
  rooms_.observer(1)->views[1].wanted = false;
  tick();
  ASSERT_EQ(sink->newest(2).size(), 1u);
  EXPECT_EQ(sink->newest(2)[0].member, 3u);
}

TEST_F(PublishTest, many_frames_are_cut_into_packets_of_the_bound) {
  const auto sink = open(1);
  for (std::uint32_t c = 1; c <= 800; ++c) add(1, c);
  tick();
  EXPECT_EQ(sink->newest(1).size(), 800u);
  // 800 frames exceed three packets of PublishDef::packet_bytes_max, which is 4096 here.
  EXPECT_GT(sink->batches.size(), 3u);
  EXPECT_EQ(sink->unreliable_frames, 0u) << "the connection has no datagrams";
}

TEST_F(PublishTest, frames_that_newer_ones_replace_are_cut_into_datagrams_of_the_connections_size) {
  SessionId session = 0;
  for (const auto& [bytes_max, knows_frame_datagrams] :
       {std::pair(512u, false), std::pair(1024u, false), std::pair(512u, true), std::pair(1024u, true)}) {
    const auto sink = open(++session);
    sink->datagram_max = bytes_max;
    sink->knows_frame_datagrams = knows_frame_datagrams;
    // Each round adds an observer with datagrams of another kind or size, and 100 characters more.
    for (std::uint32_t c = 1; c <= 100; ++c) add(session, c);
    tick();
    tick();
    EXPECT_EQ(sink->newest(inputs_.tick).size(), 100u * session);
    EXPECT_GT(sink->unreliable_frames, 0u);
    ASSERT_FALSE(sink->datagram_bytes.empty());
    EXPECT_LE(std::ranges::max(sink->datagram_bytes), bytes_max);
    // A datagram that is less than two thirds full would have had room for more frames.
    EXPECT_GT(std::ranges::max(sink->datagram_bytes), bytes_max * 2 / 3);
  }
}

TEST_F(PublishTest, more_frames_fit_a_datagram_without_an_envelope) {
  const auto old = open(1), knowing = open(2);
  old->datagram_max = knowing->datagram_max = 1024;
  knowing->knows_frame_datagrams = true;
  for (std::uint32_t c = 1; c <= 300; ++c) add(1, c);
  tick();
  tick();
  EXPECT_EQ(old->unreliable_frames, 600u);
  EXPECT_EQ(knowing->unreliable_frames, 600u);
  EXPECT_LT(knowing->datagram_bytes.size(), old->datagram_bytes.size());
}

TEST_F(PublishTest, frames_in_datagrams_name_the_generation_of_their_member_and_others_do_not) {
  // A late datagram may show a member that has gone while another has its number. The generation of a number tells the
  // two apart. Packets of a channel come in order, and need none.
  const auto near = open(1), far = open(2), knowing = open(3);
  far->datagram_max = knowing->datagram_max = 1024;
  knowing->knows_frame_datagrams = true;
  for (std::uint32_t c = 1; c <= 3; ++c) add(1, c);
  tick();
  rooms_.remove(character_key(1, 2), 1);
  // The new character gets the member number 2, whose generation is now 2.
  add(1, 4);
  tick();
  near->batches.clear();
  far->batches.clear();
  knowing->batches.clear();
  tick();
  for (const auto& each : {far, knowing}) {
    ASSERT_EQ(each->batches.size(), 1u);
    EXPECT_THAT(each->batches[0].generations, ElementsAre(1, 2, 1));
  }
  ASSERT_EQ(near->batches.size(), 1u);
  EXPECT_EQ(near->batches[0].frames.size(), 3u);
  EXPECT_THAT(near->batches[0].generations, IsEmpty());
}

TEST_F(PublishTest, frames_are_fewer_where_the_network_carries_less) {
  const auto wide = open(1), narrow = open(2);
  // This network carries 200 bytes for each tick of 30 Hz, too few for the poses of 20 characters.
  narrow->network_bytes_per_s = 30 * 200;
  for (std::uint32_t c = 1; c <= 20; ++c) add(1, c);
  for (int t = 0; t < 150; ++t) tick();
  EXPECT_EQ(rooms_.observer(1)->throttle.stride(), 1);
  EXPECT_GT(rooms_.observer(2)->throttle.stride(), 1);
  EXPECT_LT(narrow->frames_announced, wide->frames_announced * 2 / 3);
}

TEST_F(PublishTest, a_frame_that_sleeps_or_jumps_or_exceeds_a_datagram_is_never_lost) {
  // A frame that marks a jump or sleep must not be lost, since no later frame repeats the mark. A frame that fits no
  // datagram goes by the reliable channel, too.
  const auto sink = open(1), narrow = open(2);
  sink->datagram_max = 1024;
  // A packet with one frame is larger.
  narrow->datagram_max = 120;
  sink->knows_frame_datagrams = true;
  Character& character = add(1, 1);
  add(1, 2);
  tick();
  const std::size_t before = sink->reliable_frames;
  tick();
  EXPECT_EQ(sink->reliable_frames, before);
  // Without new poses both characters fall asleep within 400 ticks, and each has one frame that says so.
  std::size_t asleep = 0;
  for (int t = 0; t < 400; ++t) {
    ++inputs_.tick;
    simulation_.step(inputs_);
    character.discontinuous = t == 0;
    publisher_.publish(rooms_, simulation_, inputs_, {}, 1);
    for (const wire::Frame& frame : sink->newest(inputs_.tick)) asleep += frame.asleep ? 1 : 0;
    EXPECT_EQ(sink->reliable_frames, before + 1 + asleep) << "one has jumped";
  }
  EXPECT_EQ(asleep, 2u);
  EXPECT_EQ(narrow->unreliable_frames, 0u);
  EXPECT_GT(narrow->reliable_frames, 0u);
}

// A character on the learnt level, and an observer that evaluates its hair from tick 1 on.
class PublishLearntTest : public PublishTest {
 protected:
  PublishLearntTest() {
    auto levels = std::make_shared<LevelSet>();
    for (Level& level : levels->levels) level = support::make_random_level({.nodes_per_axis = 3});
    levels->learnt = std::make_shared<LearntHair>(support::random_learnt_hair(3));
    simulation_.put_levels({}, levels);
    publisher_.put_learnt({}, {7});
    character_ = &add(1, 1);
    inputs_.added.back().levels_ready = true;
    inputs_.added.back().level = LevelIndex::learnt;
    tick();
    evaluate();
  }
  void evaluate() { observer().learnt_announced.at({}).evaluated_since = inputs_.tick; }
  Observer& observer() { return *rooms_.observer(1); }
  bool is_evaluated() {
    const std::vector<wire::Frame> frames = sink_->newest(inputs_.tick);
    EXPECT_EQ(frames.size(), 1u);
    return frames.size() == 1 && frames[0].evaluated;
  }
  // Learnt hair follows from the poses alone, so a client with the network can evaluate it itself and needs no
  // coefficients. The network forgets its start within kLearntSettled_ticks (60, two seconds at 30 Hz); until then the
  // client's hair may differ, so the server sends coefficients.
  // The number of ticks, from the next one on, in which the observer gets coefficients; 200 stand for no end.
  int ticks_with_coefficients() {
    for (int count = 0; count < 200; ++count) {
      tick();
      if (is_evaluated()) return count;
    }
    return 200;
  }
  void settle() { EXPECT_LT(ticks_with_coefficients(), 200); }

  std::shared_ptr<FakeObserverSink> sink_ = open(1);
  Character* character_ = nullptr;
};

TEST_F(PublishLearntTest, is_announced_once_to_who_sees_it) {
  const auto other = open(2);
  for (int t = 0; t < 10; ++t) tick();
  for (const auto& sink : {sink_, other}) {
    ASSERT_EQ(sink->messages.size(), 1u);
    const auto& announced = std::get<wire::GroomLearnt>(sink->messages[0]);
    EXPECT_EQ(announced.groom, wire::GroomHash{});
    EXPECT_EQ(announced.learnt, wire::GroomHash{7});
  }
  EXPECT_EQ(counters_.learnt_announced.value(), 2u);
}

TEST_F(PublishLearntTest, is_left_to_an_observer_that_has_seen_it_for_two_seconds) {
  const auto other = open(2);
  EXPECT_EQ(ticks_with_coefficients(), kLearntSettled_ticks - 1);
  for (int t = 0; t < 9; ++t) tick();
  EXPECT_TRUE(is_evaluated());
  EXPECT_FALSE(other->newest(inputs_.tick).at(0).evaluated) << "it has not said that it evaluates";
  EXPECT_EQ(counters_.frames_evaluated_by_clients.value(), 10u);
}

TEST_F(PublishLearntTest, is_left_to_who_says_later_that_it_evaluates_two_seconds_later) {
  observer().learnt_announced.clear();
  for (int t = 0; t < 100; ++t) tick();
  EXPECT_FALSE(is_evaluated());
  evaluate();
  EXPECT_EQ(ticks_with_coefficients(), kLearntSettled_ticks - 1);
}

TEST_F(PublishLearntTest, has_coefficients_for_two_seconds_after_a_gap_that_a_network_notices) {
  settle();
  const auto look_away = [&](int ticks) {
    observer().views[0].in_view = false;
    for (int t = 0; t < ticks; ++t) tick();
    observer().views[0].in_view = true;
  };
  // Poses are interpolated over a gap of at most kLearntGapMax_ticks (8); after a longer one the client's network
  // begins again.
  look_away(kLearntGapMax_ticks - 1);
  EXPECT_EQ(ticks_with_coefficients(), 0);
  look_away(kLearntGapMax_ticks);
  EXPECT_EQ(ticks_with_coefficients(), kLearntSettled_ticks);
}

TEST_F(PublishLearntTest, has_coefficients_for_two_seconds_after_another_level) {
  settle();
  for (const LevelIndex level : {LevelIndex::low, LevelIndex::learnt}) {
    inputs_.levels = {{character_->key, level}};
    tick();
    inputs_.levels.clear();
    EXPECT_FALSE(is_evaluated());
  }
  EXPECT_EQ(ticks_with_coefficients(), kLearntSettled_ticks - 1);
}

TEST_F(PublishLearntTest, has_coefficients_in_wind_and_for_two_seconds_after_it) {
  settle();
  // Clients evaluate learnt hair in still air, so hair in wind needs coefficients.
  rooms_.room(character_->room).wind.mean_m_per_s = {1, 0, 0};
  EXPECT_EQ(ticks_with_coefficients(), 200);
  rooms_.room(character_->room).wind = {};
  EXPECT_EQ(ticks_with_coefficients(), kLearntSettled_ticks);
}

TEST_F(PublishLearntTest, has_coefficients_after_frames_were_dropped) {
  settle();
  sink_->full = true;
  tick();
  for (int t = 1; t < kLearntSettled_ticks; ++t) {
    tick();
    for (const wire::Frame& frame : sink_->newest(inputs_.tick)) EXPECT_FALSE(frame.evaluated) << t;
  }
  EXPECT_EQ(ticks_with_coefficients(), 0);
}

TEST_F(PublishLearntTest, has_coefficients_until_the_observer_evaluates_a_network_that_is_new) {
  settle();
  publisher_.put_learnt({}, {8});
  for (int t = 0; t < 100; ++t) tick();
  EXPECT_FALSE(is_evaluated());
  EXPECT_EQ(std::get<wire::GroomLearnt>(sink_->messages.back()).learnt, wire::GroomHash{8});
  evaluate();
  EXPECT_EQ(ticks_with_coefficients(), kLearntSettled_ticks - 1);
}

}  // namespace
}  // namespace hairnet::server
