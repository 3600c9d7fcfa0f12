#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <vector>

#include "server/tick/recorder.hpp"
#include "tests/unit/server/touch_fixture.hpp"

// The messages in which people see the hands of others, and the hands in a recording.
namespace hairnet::server {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

TEST_F(TouchTest, who_leaves_or_loses_the_connection_has_no_hands_and_holds_nothing) {
  open(kAnn);
  auto ben = open(kBen);
  const auto eve = open(kEve);
  add(kAnn);
  tick();
  take_hold();
  commands_.put(DetachSession{kBen});
  tick();
  EXPECT_EQ(held_count(), 0u);
  ben = open(kBen, {}, true);
  take_hold();
  EXPECT_THAT(ben->all<wire::Held>(), SizeIs(1));
  commands_.put(CloseSession{kBen});
  ticks(2);
  EXPECT_EQ(held_count(), 0u);
  EXPECT_FALSE(hair().is_touched);
  // Eve hears twice that Ben's hands are gone: once when he loses the connection, and once when he leaves.
  const auto gone = eve->all<wire::RoomHands>();
  ASSERT_THAT(gone, SizeIs(2));
  for (const wire::RoomHands& hands : gone) {
    ASSERT_THAT(hands.people, SizeIs(1));
    EXPECT_EQ(hands.people[0].session, kBen);
    EXPECT_THAT(hands.people[0].hands, IsEmpty());
  }
}

TEST_F(TouchTest, hands_and_holds_end_with_a_connection_that_a_resume_takes_over) {
  open(kAnn);
  open(kBen);
  const auto eve = open(kEve);
  add(kAnn);
  tick();
  take_hold();
  ASSERT_THAT(eve->hands, SizeIs(1));
  // The old connection may be dead, and its hands with it. Hair must not hang on a hand that nobody moves any more, so
  // the resumed session begins without hands.
  const auto again = open(kBen, {}, true);
  ticks(2);
  EXPECT_EQ(held_count(), 0u);
  EXPECT_FALSE(hair().is_touched);
  EXPECT_THAT(eve->hands, SizeIs(1));
  const auto gone = eve->all<wire::RoomHands>();
  ASSERT_THAT(gone, SizeIs(1));
  EXPECT_THAT(gone[0].people, SizeIs(1));
  take_hold();
  EXPECT_GT(again->all<wire::Held>().back().point_count, 0u);
}

TEST_F(TouchTest, hands_are_shown_to_others_who_see_the_hair_near_them_and_their_going_once) {
  // Ann takes datagrams and Eve does not. The session `blind` observes nobody, and `old` is a client of a version
  // before hands.
  const auto ann = open(kAnn), ben = open(kBen), eve = open(kEve), blind = open(4), old = open(5);
  ann->datagram_max = 1024;
  old->knows_hands = false;
  say(4, wire::Observe{.mode = wire::ObserveMode::list, .from = {}, .members = {}});
  add(kAnn);
  tick();
  for (const Vec3& place : {kInHair, Vec3(kInHair + Vec3(0.01, 0, 0))}) {
    put_hands(kBen, {ball_hand(place)});
    tick();
    for (const auto& sink : {ann, eve}) {
      ASSERT_FALSE(sink->hands.empty());
      const wire::RoomHands& shown = sink->hands.back();
      EXPECT_EQ(shown.tick, tick_ - 1);
      // The hands are those of the sample time of the tick that has just run, and next_ns() is already the time of the
      // next one.
      EXPECT_EQ(shown.sample_time_ns, next_ns() - kTick_ns - kDelay_ns);
      ASSERT_THAT(shown.people, SizeIs(1));
      EXPECT_EQ(shown.people[0].session, kBen);
      ASSERT_THAT(shown.people[0].hands, SizeIs(1));
      // The message rounds each coordinate to a millimetre (kHandStep_m), so all three together err by 0.87 mm at most.
      EXPECT_LT((shown.people[0].hands[0].place.position - place).norm(), 0.001);
    }
  }
  tick();
  EXPECT_THAT(eve->hands, SizeIs(3)) << "in each tick, also when they keep still";
  // Hands are shown up to 1.5 m from a head (kShownReach_m in touch.cpp); these are 4 m away.
  put_hands(kBen, {ball_hand(kHead + Vec3(0, 0, 4))});
  ticks(3);
  for (const auto& sink : {ann, eve}) {
    EXPECT_THAT(sink->hands, SizeIs(3)) << "they are out of reach";
    const auto gone = sink->all<wire::RoomHands>();
    ASSERT_THAT(gone, SizeIs(1)) << "as a message, which is not lost";
    ASSERT_THAT(gone[0].people, SizeIs(1));
    EXPECT_THAT(gone[0].people[0].hands, IsEmpty());
  }
  for (const auto& sink : {ben, blind, old}) {
    EXPECT_THAT(sink->hands, IsEmpty());
    EXPECT_THAT(sink->all<wire::RoomHands>(), IsEmpty());
  }
}

TEST_F(TouchTest, hands_of_many_are_cut_into_datagrams_and_bounded) {
  const auto ann = open(kAnn), eve = open(kEve);
  ann->datagram_max = 300;
  add(kAnn);
  for (SessionId s = 10; s < 110; ++s) open(s);
  tick();
  Hand other = ball_hand(kInHair);
  other.first_number = 1;
  for (SessionId s = 10; s < 110; ++s) put_hands(s, {ball_hand(kInHair), other});
  tick();
  EXPECT_THAT(eve->hands, SizeIs(1));
  // The hands of 64 people do not fit into three datagrams of 300 bytes. Eve has no datagrams, so she gets one packet
  // on her connection.
  EXPECT_GT(ann->hands.size(), 3u);
  for (const auto& sink : {ann, eve}) {
    std::vector<std::uint64_t> sessions;
    for (const wire::RoomHands& shown : sink->hands) {
      for (const auto& person : shown.people) sessions.push_back(person.session);
    }
    // A session gets the hands of 64 others at most (kPeopleShownMax in touch.cpp); here 100 have some.
    EXPECT_THAT(sessions, SizeIs(64));
    EXPECT_TRUE(std::ranges::is_sorted(sessions));
  }
}

TEST_F(TouchTest, a_recording_with_touch_replays_to_the_same_hashes_and_says_nothing_of_hands_that_keep_still) {
  const std::string path = testing::TempDir() + "hairnet_touch_test.hairrec";
  auto recorder = Recorder::create(path, counters_);
  ASSERT_TRUE(recorder) << recorder.error();
  start(recorder->get());
  open(kAnn);
  open(kBen);
  add(kAnn);
  // Ben's own hair is a metre beside Ann's.
  add(kBen, kHead + Vec3(1, 0, 0));
  ticks(5);
  say(kBen, wire::SetProps{{ball_prop(3, kInHair)}});
  ticks(5);
  take_hold();
  ticks(5);
  move(kInHair, kInHair + Vec3(0.03, 0, 0.02), 20);
  say(kBen, wire::LetGo{1, 0, Release::pin});
  stroke();
  commands_.put(SetTouchRight{kBen, false});
  stroke();
  say(kBen, wire::SetProps{{}, {3}});
  commands_.put(CloseSession{kBen});
  ticks(20);
  (*recorder)->poll();

  std::ifstream file(path, std::ios::binary);
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
  std::remove(path.c_str());
  std::span<const std::uint8_t> rest = bytes;
  const auto header = std::get<wire::RecordingHeader>(*wire::take_record_entry(rest));
  WorldDef def;
  def.tick_s = 1.0 / header.tick_rate_hz;
  def.substep_count = header.substep_count;
  def.iterations = header.iterations;
  Simulation again(def, header.wind);
  again.put_levels(kGroom, levels_);
  std::size_t with_bodies = 0, without_bodies = 0, confined = 0, grabs = 0, releases = 0, tick_count = 0;
  std::uint32_t touched = 0;
  while (!rest.empty()) {
    const auto entry = wire::take_record_entry(rest);
    ASSERT_TRUE(entry) << entry.error();
    const auto& tick = std::get<wire::RecordedTick>(*entry);
    touched += again.step(tick).touched;
    ASSERT_EQ(again.hash(), tick.state_hash) << tick.tick;
    ++tick_count;
    grabs += tick.grabs.size();
    releases += tick.releases.size();
    for (const auto& room : tick.bodies) {
      ++(room.bodies.empty() ? without_bodies : with_bodies);
      confined += std::ranges::any_of(room.bodies, &TouchBody::only_own) ? 1 : 0;
    }
  }
  EXPECT_EQ(tick_count, tick_ - 1);
  EXPECT_EQ(grabs, 1u);
  EXPECT_EQ(releases, 1u);
  EXPECT_GT(touched, 60u);
  EXPECT_EQ(without_bodies, 1u);
  // Bodies change in 62 ticks: one places the prop, one brings the hand, and the hand moves three times for 20 ticks.
  // In the last 20 the hand may touch its owner alone.
  EXPECT_EQ(with_bodies, 62u);
  EXPECT_EQ(confined, 20u);
}

}  // namespace
}  // namespace hairnet::server
