#include <gmock/gmock.h>

#include "client/link/event_queue.hpp"
#include "schema/codec/hand_code.hpp"
#include "tests/unit/client/link_core_driver.hpp"

// Tests how a LinkCore sends hands, and what it makes of messages about touch.
namespace hairnet::link {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

Hand hand_at(double x, std::uint8_t number = 0) {
  return {number, {Quat::Identity(), Vec3(x, 1, 2)}, false, {{Vec3::Zero(), Vec3(0, 0.08, 0), 0.01}}};
}

// Returns hands with large numbers, so that each takes some 32 bytes of a packet.
std::vector<Hand> far_hands(std::size_t count) {
  std::vector<Hand> hands;
  for (std::size_t i = 0; i < count; ++i)
    hands.push_back({static_cast<std::uint8_t>(i),
                     {Quat::Identity(), Vec3(5000, 5000, 5000)},
                     false,
                     {{Vec3(9, 9, 9), Vec3(-9, -9, -9), 9}}});
  return hands;
}

// Gives each test a client that has three own characters after join(). Poses come 14 ms apart, as from a 72 Hz headset.
class TouchLinkTest : public ::testing::Test {
 protected:
  void open(bool has_datagrams, wire::Welcome welcome = welcome_to(5)) {
    d.core.start();
    for (int i = 0; i < 10 && !d.core.wants_connection(); ++i) d.pass_to_deadline();
    d.core.on_opening(d.now_ns);
    d.core.on_open(d.now_ns, has_datagrams);
    d.expect<wire::Hello>();
    d.send(std::move(welcome));
  }
  void join(bool has_datagrams = false) {
    for (const std::uint32_t character : {1u, 2u, 3u}) d.core.send(wire::AddCharacter{character, hash_of(1)});
    open(has_datagrams);
    d.take_all();
  }
  void push_poses(std::uint32_t characters) {
    std::vector<wire::PoseSample> poses;
    ++pose_sequence;
    for (std::uint32_t c = 1; c <= characters; ++c)
      poses.push_back({c, pose_sequence, d.now_ns, false, rigid_pose({})});
    d.core.push_poses(std::move(poses));
  }
  void push_hands(std::vector<Hand> hands) { d.core.push_hands(std::move(hands), d.now_ns); }
  void say_hands(std::uint64_t tick, std::vector<wire::RoomHands::Person> people) {
    d.send(wire::RoomHands{tick, kServerClock_ns + d.now_ns, std::move(people)});
  }
  LinkCoreDriver d;
  std::uint32_t pose_sequence = 0;
};

// Hands that came a tick before or after the poses of the same person would touch hair beside where they are seen.
TEST_F(TouchLinkTest, hands_go_beside_the_poses_of_their_moment_or_alone) {
  join();
  push_poses(1);
  push_hands({hand_at(1)});
  const auto both = d.expect<wire::PoseBatch>();
  EXPECT_THAT(both.poses, SizeIs(1));
  ASSERT_TRUE(both.hands);
  EXPECT_EQ(both.hands->capture_time_ns, d.now_ns);
  ASSERT_THAT(both.hands->hands, SizeIs(1));
  EXPECT_NEAR(both.hands->hands[0].place.position.x(), 1, codec::kHandStep_m);
  EXPECT_FALSE(d.take()) << "once";

  push_hands({hand_at(2)});
  push_poses(1);
  EXPECT_TRUE(d.expect<wire::PoseBatch>().hands) << "pushed before the poses";
  push_poses(1);
  EXPECT_FALSE(d.expect<wire::PoseBatch>().hands) << "none was pushed";
  push_hands({hand_at(3)});
  const auto alone = d.expect<wire::PoseBatch>();
  EXPECT_THAT(alone.poses, IsEmpty());
  ASSERT_TRUE(alone.hands);
  EXPECT_GT(alone.hands->sequence, both.hands->sequence);
}

TEST_F(TouchLinkTest, hands_are_there_before_they_take_hold) {
  join();
  push_hands({hand_at(1)});
  d.core.send(wire::TakeHold{7, 0, Vec3f::Zero(), 0.03f});
  EXPECT_TRUE(d.expect<wire::PoseBatch>().hands);
  EXPECT_EQ(d.expect<wire::TakeHold>().member, 7u);
}

// A lost jump would sweep hair along the way between both places.
TEST_F(TouchLinkTest, only_the_newest_hands_are_sent_and_a_jump_passes_on_to_them) {
  join();
  Hand jumps = hand_at(1, 8);
  jumps.has_jumped = true;
  push_hands({hand_at(1), jumps});
  push_hands({hand_at(2), hand_at(2, 8)});
  const auto batch = d.expect<wire::PoseBatch>();
  ASSERT_TRUE(batch.hands);
  ASSERT_THAT(batch.hands->hands, SizeIs(2));
  EXPECT_NEAR(batch.hands->hands[0].place.position.x(), 2, codec::kHandStep_m);
  EXPECT_FALSE(batch.hands->hands[0].has_jumped);
  EXPECT_TRUE(batch.hands->hands[1].has_jumped);
  EXPECT_FALSE(d.take());
}

// A hand that the server never loses would stay in the room and push hair forever.
TEST_F(TouchLinkTest, that_hands_are_gone_is_said_once_and_so_that_it_arrives) {
  join(true);
  push_hands({});
  EXPECT_FALSE(d.take()) << "there were none";
  push_hands({hand_at(1)});
  d.expect<wire::PoseBatch>();
  EXPECT_TRUE(d.core.taken_may_be_lost());
  push_hands({});
  const auto gone = d.expect<wire::PoseBatch>();
  ASSERT_TRUE(gone.hands);
  EXPECT_THAT(gone.hands->hands, IsEmpty());
  EXPECT_FALSE(d.core.taken_may_be_lost());
  push_hands({});
  EXPECT_FALSE(d.take());
  Hand jumps = hand_at(1);
  jumps.has_jumped = true;
  push_hands({jumps});
  d.expect<wire::PoseBatch>();
  EXPECT_FALSE(d.core.taken_may_be_lost()) << "a lost jump would sweep hair along";
}

TEST_F(TouchLinkTest, hands_without_a_session_are_dropped) {
  push_hands({hand_at(1)});
  join();
  push_hands({hand_at(2)});
  d.core.on_closed("the cable", d.now_ns);
  push_hands({hand_at(3)});
  open(false, welcome_to(5, true));
  for (const wire::Message& message : d.take_all()) EXPECT_FALSE(std::holds_alternative<wire::PoseBatch>(message));
  push_hands({hand_at(4)});
  EXPECT_TRUE(d.expect<wire::PoseBatch>().hands);
}

TEST_F(TouchLinkTest, poses_of_before_make_way_for_hands_in_a_datagram) {
  join(true);
  // A datagram repeats the last two poses of each character (SentPoses::kPosesMax), so the third one is as large as
  // they become.
  std::size_t poses_bytes = 0;
  for (int i = 0; i < 3; ++i) {
    d.now_ns += 14 * kMs;
    push_poses(3);
    poses_bytes = d.core.take_packet(d.now_ns).size();
  }
  ASSERT_LE(poses_bytes, wire::kDatagramBytesMax);
  std::size_t count = 1;
  // So many hands fit a datagram beside new poses, but not beside the repeated ones too.
  while (poses_bytes + codec::encode_hands(far_hands(count)).size() <= wire::kDatagramBytesMax) ++count;
  d.now_ns += 14 * kMs;
  push_poses(3);
  push_hands(far_hands(count));
  const std::vector<std::uint8_t> packet = d.core.take_packet(d.now_ns);
  EXPECT_TRUE(d.core.taken_may_be_lost());
  EXPECT_LE(packet.size(), wire::kDatagramBytesMax);
  const auto batch = std::get<wire::PoseBatch>(wire::decode_packet(packet).envelope.message);
  EXPECT_THAT(batch.poses, SizeIs(3));
  EXPECT_THAT(batch.earlier, IsEmpty());
  ASSERT_TRUE(batch.hands);
  EXPECT_THAT(batch.hands->hands, SizeIs(count));
  EXPECT_FALSE(d.take());
}

TEST_F(TouchLinkTest, many_hands_have_a_datagram_of_their_own) {
  join(true);
  push_poses(3);
  d.take_all();
  d.now_ns += 14 * kMs;
  std::size_t count = 1;
  const auto bytes_with = [&](std::size_t hands) {
    wire::PoseBatch batch;
    for (std::uint32_t c = 1; c <= 3; ++c) batch.poses.push_back({c, 9, d.now_ns, false, rigid_pose({})});
    batch.hands = wire::HandsSample{9, d.now_ns, far_hands(hands)};
    return wire::encode_client_packet(d.now_ns, batch).size();
  };
  // So many hands do not fit a datagram even beside the new poses alone.
  while (bytes_with(count) <= wire::kDatagramBytesMax) ++count;
  ASSERT_LE(codec::encode_hands(far_hands(count)).size(), wire::kHandsBytesMax);
  push_poses(3);
  push_hands(far_hands(count));
  std::vector<wire::PoseBatch> batches;
  for (std::vector<std::uint8_t> packet; !(packet = d.core.take_packet(d.now_ns)).empty();) {
    EXPECT_TRUE(d.core.taken_may_be_lost());
    EXPECT_LE(packet.size(), wire::kDatagramBytesMax);
    batches.push_back(std::get<wire::PoseBatch>(wire::decode_packet(packet).envelope.message));
  }
  ASSERT_THAT(batches, SizeIs(2));
  EXPECT_THAT(batches[0].poses, SizeIs(3));
  EXPECT_THAT(batches[0].earlier, SizeIs(3)) << "there is room for them without the hands";
  EXPECT_FALSE(batches[0].hands);
  EXPECT_THAT(batches[1].poses, IsEmpty());
  ASSERT_TRUE(batches[1].hands);
  EXPECT_THAT(batches[1].hands->hands, SizeIs(count));
}

TEST_F(TouchLinkTest, the_most_hands_fit_no_datagram_and_are_a_packet_of_their_own) {
  join(true);
  push_poses(3);
  d.take_all();
  d.now_ns += 14 * kMs;
  std::vector<Hand> most = far_hands(kHandShapesMax);
  // The largest coordinates of all make wire::kHandsBytesMax, 1041 bytes, which is more than a datagram has.
  for (Hand& hand : most) {
    hand.place.position.setConstant(kHandPlaceMax_m);
    hand.shapes[0] = {Vec3::Constant(kHandSizeMax_m), Vec3::Constant(-kHandSizeMax_m), kHandSizeMax_m, true};
  }
  ASSERT_EQ(codec::encode_hands(most).size(), wire::kHandsBytesMax);
  push_poses(3);
  push_hands(most);
  std::vector<std::vector<std::uint8_t>> packets;
  for (std::vector<std::uint8_t> packet; packets.size() < 5 && !(packet = d.core.take_packet(d.now_ns)).empty();)
    packets.push_back(packet);
  ASSERT_THAT(packets, SizeIs(2));
  EXPECT_LE(packets[0].size(), wire::kDatagramBytesMax);
  EXPECT_GT(packets[1].size(), wire::kDatagramBytesMax);
  const wire::DecodedPacket alone = wire::decode_packet(packets[1]);
  ASSERT_EQ(alone.error, wire::DecodeError::none) << alone.detail;
  const auto& batch = std::get<wire::PoseBatch>(alone.envelope.message);
  ASSERT_TRUE(batch.hands);
  EXPECT_THAT(batch.hands->hands, SizeIs(kHandShapesMax));
}

// The rule of who may touch is a wish that lasts. A hold or a prop is of its moment, and the server of a resumed
// session still has them.
TEST_F(TouchLinkTest, who_may_touch_is_said_again_after_a_reconnect_and_holds_and_props_are_not) {
  join();
  d.core.send(wire::SetTouch{1, TouchAudience::everyone});
  d.core.send(wire::SetTouch{1, TouchAudience::chosen, {9}});
  d.core.send(wire::TakeHold{7, 0, Vec3f::Zero(), 0.03f});
  d.core.send(wire::LetGo{7, 0, Release::pin});
  d.core.send(wire::SetProps{{{3, sphere(0.1), {}, false}}});
  d.take_all();
  for (const bool resumed : {true, false}) {
    d.core.on_closed("the cable", d.now_ns);
    open(false, welcome_to(resumed ? 5 : 6, resumed));
    std::vector<wire::SetTouch> rules;
    for (const wire::Message& message : d.take_all()) {
      if (const auto* rule = std::get_if<wire::SetTouch>(&message)) rules.push_back(*rule);
      EXPECT_FALSE(std::holds_alternative<wire::TakeHold>(message));
      EXPECT_FALSE(std::holds_alternative<wire::LetGo>(message));
      EXPECT_FALSE(std::holds_alternative<wire::SetProps>(message));
    }
    ASSERT_THAT(rules, SizeIs(1));
    EXPECT_EQ(rules[0].audience, TouchAudience::chosen);
    if (resumed)
      EXPECT_THAT(rules[0].chosen, ElementsAre(9u));
    else
      EXPECT_THAT(rules[0].chosen, IsEmpty()) << "the number may be a stranger's now";
  }
}

TEST_F(TouchLinkTest, sessions_that_are_chosen_before_the_first_welcome_are_said) {
  d.core.send(wire::AddCharacter{1, hash_of(1)});
  d.core.send(wire::SetTouch{1, TouchAudience::chosen, {9}});
  open(false);
  std::vector<wire::SetTouch> rules;
  for (const wire::Message& message : d.take_all()) {
    if (const auto* rule = std::get_if<wire::SetTouch>(&message)) rules.push_back(*rule);
  }
  ASSERT_THAT(rules, SizeIs(1));
  EXPECT_THAT(rules[0].chosen, ElementsAre(9u));
}

TEST_F(TouchLinkTest, what_the_server_says_of_touch_is_told) {
  join();
  d.core.take_events();
  d.send(wire::RoomProps{{{3, sphere(0.1), {}, false}}, {}, true});
  d.send(wire::MemberTouch{7, TouchAudience::everyone, {}});
  d.send(wire::Held{7, 2, 12});
  say_hands(1, {{9, {hand_at(1)}}});
  const std::vector<Event> events = d.core.take_events();
  ASSERT_THAT(events, SizeIs(4));
  EXPECT_THAT(std::get<wire::RoomProps>(events[0]).props, SizeIs(1));
  EXPECT_EQ(std::get<wire::MemberTouch>(events[1]).audience, TouchAudience::everyone);
  EXPECT_EQ(std::get<wire::Held>(events[2]).point_count, 12u);
  EXPECT_EQ(std::get<wire::RoomHands>(events[3]).people.at(0).session, 9u);
}

TEST_F(TouchLinkTest, hands_of_others_that_overtake_the_welcome_are_dropped) {
  d.core.start();
  d.open();
  d.expect<wire::Hello>();
  say_hands(1, {{9, {hand_at(1)}}});
  ASSERT_FALSE(d.core.wants_close());
  d.send(welcome_to(5));
  EXPECT_THAT(d.events<wire::RoomHands>(), IsEmpty());
  say_hands(8, {{9, {hand_at(1)}}});
  EXPECT_THAT(d.events<wire::RoomHands>(), SizeIs(1));
}

TEST(EventQueueOfHands, drops_the_oldest_the_longer_nobody_reads) {
  EventQueue events;
  Hand glove = hand_at(1);
  glove.shapes.resize(kHandShapesMax, glove.shapes[0]);
  wire::RoomHands crowd;
  while (crowd.people.size() < 1000) crowd.people.push_back({crowd.people.size(), {glove}});
  const std::size_t crowd_bytes = crowd.people.size() * kHandShapesMax * sizeof(HandShape);
  // The hands together exceed the bound of events that must not be dropped, which would end the link. They count with
  // frames, whose oldest are dropped.
  for (; crowd.tick <= EventQueue::kOtherBytesMax / crowd_bytes; ++crowd.tick) ASSERT_TRUE(events.push(crowd));
  ASSERT_TRUE(events.push(Connected{}));
  const std::vector<Event> all = events.take_all();
  EXPECT_LE(all.size() * crowd_bytes, EventQueue::kFrameBytesMax + crowd_bytes);
  ASSERT_THAT(all, SizeIs(::testing::Ge(3u)));
  EXPECT_TRUE(std::holds_alternative<Connected>(all.back()));
  EXPECT_EQ(std::get<wire::RoomHands>(all[all.size() - 2]).tick, crowd.tick - 1);
  EXPECT_EQ(events.frames_dropped(), 0u);
}

}  // namespace
}  // namespace hairnet::link
