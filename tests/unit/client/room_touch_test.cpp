#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <limits>
#include <tuple>

#include "core/touch/hand.hpp"
#include "core/world/grab.hpp"
#include "schema/codec/frame.hpp"
#include "schema/limits.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/unit/client/room_on_core.hpp"

// Tests hands, holds and props of a room.
namespace hairnet::room {
namespace {

using link::kMs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::uint32_t kOther = 40, kOwn = 31;
constexpr std::uint64_t kSession = 5, kOthersSession = 9;
const double kNan = std::numeric_limits<double>::quiet_NaN();

// Returns a hand of one capsule, 8 cm long with a radius of 1 cm, at (x, 1, 2) in the world.
Hand hand_at(double x) {
  return {0, {Quat::Identity(), Vec3(x, 1, 2)}, false, {{Vec3::Zero(), Vec3(0, 0.08, 0), 0.01}}};
}
wire::Prop ball(std::uint8_t number, double radius_m = 0.1) {
  return {number, sphere(radius_m), {}, false};
}

// Gives each test a connected room with an own character, kOwn, and a character of another session, kOther.
class RoomTouchTest : public RoomOnCore {
 protected:
  void SetUp() override {
    me = *room->add_character(file);
    d.core.start();
    d.open();
    welcome(kSession, false);
  }
  void welcome(std::uint64_t session, bool resumed, bool may_touch = true, bool may_set_props = false) {
    wire::Welcome welcome = link::welcome_to(session, resumed);
    welcome.may_touch = may_touch;
    welcome.may_set_props = may_set_props;
    d.send(welcome);
    d.send(wire::CharacterAdded{me, wire::hash_groom(*file), LevelIndex::high, kOwn});
    d.send(wire::MemberJoined{kOther, kOthersSession, 1, wire::hash_groom(*file)});
    advance();
    d.take_all();
    events<Error>();
  }
  void come_back(std::uint64_t session, bool resumed, bool may_touch = true, bool may_set_props = false) {
    d.core.on_closed("the cable", d.now_ns);
    d.open();
    welcome(session, resumed, may_touch, may_set_props);
  }
  // Sends the hands of other people as the server does, and lets then_ms pass. 33 ms are a tick at 30 Hz.
  void say(std::uint64_t tick, std::vector<wire::RoomHands::Person> people, std::int64_t then_ms = 33) {
    d.send(wire::RoomHands{tick, link::kServerClock_ns + d.now_ns, std::move(people)});
    advance(then_ms);
  }
  [[nodiscard]] double x_of_others_hand() const {
    const auto found = std::ranges::find(room->hands(), kOthersSession, &wire::RoomHands::Person::session);
    return found == room->hands().end() ? kNan : found->hands.at(0).place.position.x();
  }
  // Sends a frame that shows the head of the other member at `x`.
  void send_frame(std::uint64_t tick, double x) {
    codec::EncodedFrame coded;
    codec::encode_frame(rigid_pose({Quat::Identity(), Vec3(x, 1, 2)}), nullptr, {}, 0, coded);
    const std::span<const std::uint8_t> bytes = coded.prefix(0);
    wire::FrameBatch batch;
    batch.tick = tick;
    batch.sample_time_ns = link::kServerClock_ns + d.now_ns;
    wire::Frame& frame = batch.frames.emplace_back();
    frame.member = kOther;
    frame.content = bytes;
    d.send(batch);
  }
  [[nodiscard]] const Member& other() const { return *room->members().at(kOther); }
  [[nodiscard]] const Member& own() const { return *room->members().at(kOwn); }
  link::RequestedState::Bytes file =
      std::make_shared<const std::vector<std::uint8_t>>(wire::encode_groom(support::make_head_of_hair(20)));
  std::uint32_t me = 0;
};

// The room refuses wrong hands at the call, where their author hears of it.
TEST_F(RoomTouchTest, hands_are_sent_and_wrong_ones_are_refused_in_a_line_and_counted) {
  EXPECT_TRUE(room->push_hands(std::vector{hand_at(1)}));
  const auto batches = sent<wire::PoseBatch>();
  ASSERT_THAT(batches, SizeIs(1));
  ASSERT_TRUE(batches[0].hands);
  EXPECT_THAT(batches[0].hands->hands, SizeIs(1));

  EXPECT_FALSE(room->push_hands(std::vector{hand_at(kNan)}));
  std::vector<Hand> many;
  for (std::uint8_t i = 0; i < kHandShapesMax; ++i)
    many.push_back({i, {Quat::Identity(), Vec3(5000, 5000, 5000)}, false, {{Vec3(9, 9, 9), Vec3(-9, -9, -9), 9}}});
  // One hand more than kHandShapesMax, 32, with the number of the last one.
  many.push_back(many.back());
  const Result<void> pushed = room->push_hands(many);
  ASSERT_FALSE(pushed);
  EXPECT_THAT(pushed.error(), HasSubstr("do not ascend"));
  EXPECT_EQ(room->inputs_dropped(), 2u);
  EXPECT_THAT(sent<wire::PoseBatch>(), IsEmpty());
  many.pop_back();
  EXPECT_TRUE(room->push_hands(many)) << "as many as there are numbers of shapes";
}

TEST_F(RoomTouchTest, a_hand_takes_hold_and_the_answer_is_told) {
  EXPECT_TRUE(room->take_hold(kOther, 3, Vec3f(0, 0.1f, 0), 0.05f));
  room->let_go(kOther, 3, Release::pin);
  room->let_go(kOther + 1, 3, Release::drop);
  const std::vector<wire::Message> messages = d.take_all();
  ASSERT_THAT(messages, SizeIs(2));
  EXPECT_EQ(std::get<wire::TakeHold>(messages[0]).hand, 3);
  EXPECT_EQ(std::get<wire::LetGo>(messages[1]).release, Release::pin);

  d.send(wire::Held{kOther, 3, 12});
  d.send(wire::Held{kOther + 1, 3, 12});
  advance();
  const auto held = events<HeldChanged>();
  ASSERT_THAT(held, SizeIs(1)) << "the other member is not known";
  EXPECT_EQ(held[0].member, kOther);
  EXPECT_EQ(held[0].hand, 3);
  EXPECT_EQ(held[0].point_count, 12u);

  EXPECT_FALSE(room->take_hold(kOther + 1, 3, Vec3f::Zero(), 0.05f)) << "nobody";
  EXPECT_FALSE(room->take_hold(kOther, kHandShapesMax, Vec3f::Zero(), 0.05f)) << "no number of a shape";
  EXPECT_FALSE(room->take_hold(kOther, 3, Vec3f::Zero(), static_cast<float>(kGrabRadiusMax_m) + 0.01f));
  EXPECT_FALSE(room->take_hold(kOther, 3, Vec3f(0, static_cast<float>(kNan), 0), 0.1f));
  EXPECT_EQ(room->inputs_dropped(), 4u);
  EXPECT_THAT(d.take_all(), IsEmpty());
}

TEST_F(RoomTouchTest, tells_whom_this_client_may_touch) {
  EXPECT_TRUE(room->may_touch(own()));
  EXPECT_FALSE(room->may_touch(other())) << "at first oneself alone";
  for (const auto& [audience, chosen, may] :
       {std::tuple(TouchAudience::everyone, std::uint64_t{0}, true), std::tuple(TouchAudience::nobody, kSession, false),
        std::tuple(TouchAudience::chosen, kOthersSession, false), std::tuple(TouchAudience::chosen, kSession, true)}) {
    d.send(wire::MemberTouch{kOther, audience, {chosen}});
    advance();
    EXPECT_EQ(room->may_touch(other()), may) << static_cast<int>(audience) << ' ' << chosen;
    const auto changes = events<TouchChanged>();
    ASSERT_THAT(changes, SizeIs(1));
    EXPECT_EQ(changes[0].number, kOther);
  }
  // Nothing is said of the default.
  come_back(kSession, true);
  EXPECT_FALSE(room->may_touch(other()));
  d.send(wire::MemberTouch{kOther, TouchAudience::everyone, {}});
  advance();
  EXPECT_TRUE(room->may_touch(other()));
  come_back(kSession, true, false);
  d.send(wire::MemberTouch{kOther, TouchAudience::everyone, {}});
  advance();
  EXPECT_FALSE(room->may_touch(other())) << "the server forbids this client to touch others";
  EXPECT_TRUE(room->may_touch(own()));
}

TEST_F(RoomTouchTest, says_who_may_touch_an_own_character_over_a_change_of_the_server) {
  EXPECT_TRUE(room->set_touch(me, TouchAudience::nobody));
  EXPECT_FALSE(room->may_touch(own()));
  EXPECT_THAT(events<TouchChanged>(), SizeIs(1));
  EXPECT_TRUE(room->set_touch(me, TouchAudience::chosen, {kOthersSession}));
  const auto rules = sent<wire::SetTouch>();
  ASSERT_THAT(rules, SizeIs(2));
  EXPECT_EQ(rules[1].character, me);
  EXPECT_THAT(rules[1].chosen, ElementsAre(kOthersSession));
  // This is the answer to the first of the two settings. It must not undo the second one.
  d.send(wire::MemberTouch{kOwn, TouchAudience::nobody, {}});
  advance();
  EXPECT_EQ(own().touch, TouchAudience::chosen);
  come_back(kSession, true);
  EXPECT_THAT(own().touch_chosen, ElementsAre(kOthersSession));
  d.core.on_closed("the cable", d.now_ns);
  d.open();
  // Earlier events are dropped, so that the count below is that of the new server.
  (void)room->take_events();
  d.send(link::welcome_to(kSession + 1, false));
  advance();
  EXPECT_THAT(events<TouchChanged>(), SizeIs(1)) << "the numbers may be strangers' now";
  d.send(wire::CharacterAdded{me, wire::hash_groom(*file), LevelIndex::high, kOwn + 1});
  advance();
  const Member& again = *room->members().at(kOwn + 1);
  EXPECT_EQ(again.touch, TouchAudience::chosen);
  EXPECT_THAT(again.touch_chosen, IsEmpty());
  d.take_all();

  EXPECT_TRUE(room->set_touch(me + 1, TouchAudience::everyone)) << "nothing happens";
  EXPECT_FALSE(room->set_touch(me, TouchAudience::chosen, std::vector<std::uint64_t>(wire::kTouchChosenMax + 1)));
  EXPECT_EQ(again.touch, TouchAudience::chosen);
  EXPECT_EQ(room->inputs_dropped(), 1u);
}

TEST_F(RoomTouchTest, props_are_those_that_the_server_has_told) {
  EXPECT_FALSE(room->may_set_props());
  EXPECT_TRUE(room->set_props({ball(3), ball(4)}, {5}));
  const auto set = sent<wire::SetProps>();
  ASSERT_THAT(set, SizeIs(1));
  EXPECT_THAT(set[0].removed, ElementsAre(5));
  EXPECT_THAT(room->props(), IsEmpty()) << "before the server says so";
  d.send(wire::RoomProps{{ball(3), ball(4)}, {}, true});
  advance();
  EXPECT_THAT(events<PropsChanged>(), SizeIs(1));
  EXPECT_THAT(room->props(), SizeIs(2));
  d.send(wire::RoomProps{{ball(4, 0.2)}, {3}, false});
  advance();
  ASSERT_THAT(room->props(), SizeIs(1));
  EXPECT_NEAR(room->props().at(4).shape.radius_m, 0.2, 1e-6);

  wire::Prop lost = ball(4);
  lost.place.position.x() = kNan;
  EXPECT_FALSE(room->set_props({lost}));
  // Numbers of props are below wire::kPropsMax.
  EXPECT_FALSE(room->set_props({ball(wire::kPropsMax)}));
  EXPECT_FALSE(room->set_props({}, {wire::kPropsMax}));
  EXPECT_FALSE(room->set_props({ball(1, kTouchSizeMax_m + 1)}));
  EXPECT_EQ(room->inputs_dropped(), 4u);
  EXPECT_THAT(sent<wire::SetProps>(), IsEmpty());

  // A server says nothing of the props of a room without any.
  come_back(kSession, true, true, true);
  EXPECT_TRUE(room->may_set_props());
  EXPECT_THAT(room->props(), IsEmpty());
}

// Holds and props are of their moment. Sent after a reconnect, they would grab at hair that has moved on.
TEST_F(RoomTouchTest, what_is_done_without_a_connection_is_refused_in_a_line_and_counted) {
  d.core.on_closed("the cable", d.now_ns);
  advance();
  ASSERT_EQ(room->state(), State::reconnecting);
  const std::array refused{room->take_hold(kOther, 3, Vec3f::Zero(), 0.05f), room->let_go(kOther, 3, Release::unpin),
                           room->set_props({ball(3)})};
  for (const Result<void>& each : refused) {
    ASSERT_FALSE(each);
    EXPECT_THAT(each.error(), HasSubstr("not connected"));
  }
  EXPECT_EQ(room->inputs_dropped(), refused.size());
  come_back(kSession, true);
  EXPECT_TRUE(room->let_go(kOther, 3, Release::unpin));
  EXPECT_THAT(sent<wire::LetGo>(), SizeIs(1));
}

TEST_F(RoomTouchTest, hands_of_others_are_the_newest_until_they_are_gone_or_nothing_comes_of_them) {
  say(1, {{kOthersSession, {hand_at(1)}}, {77, {hand_at(1)}}});
  EXPECT_THAT(room->hands(), SizeIs(2));
  say(2, {{kOthersSession, {hand_at(2)}}, {77, {}}});
  EXPECT_THAT(room->hands(), SizeIs(1));
  EXPECT_NEAR(x_of_others_hand(), 2, 1e-3);
  // Hands of which nothing comes are gone after kHandsGone_ns, 0.5 s (room_touch.hpp): not after 433 ms, but after 633.
  advance(400);
  EXPECT_THAT(room->hands(), SizeIs(1));
  advance(200);
  EXPECT_THAT(room->hands(), IsEmpty());

  say(40, {{kOthersSession, {hand_at(3)}}});
  come_back(kSession, true);
  EXPECT_THAT(room->hands(), IsEmpty());
}

TEST_F(RoomTouchTest, the_newest_tick_of_each_person_counts) {
  say(8, {{kOthersSession, {hand_at(2)}}});
  say(7, {{kOthersSession, {}}, {77, {hand_at(1)}}});
  EXPECT_THAT(room->hands(), SizeIs(2)) << "the older word that they have gone came later";
  say(7, {{kOthersSession, {hand_at(1)}}});
  EXPECT_NEAR(x_of_others_hand(), 2, 1e-3);
  say(9, {{kOthersSession, {}}});
  say(8, {{kOthersSession, {hand_at(2)}}});
  EXPECT_THAT(room->hands(), SizeIs(1)) << "an older datagram brings nobody back";
}

TEST_F(RoomTouchTest, hands_of_others_move_with_the_hair_that_is_shown) {
  constexpr std::int64_t kTick_ms = 32;
  std::uint64_t tick = 0;
  // Moves the hand and the head by the same 0.1 m in each tick. Hair is shown with a delay, so a hand that is shown
  // without one would not be where it touches the hair.
  const auto pass_tick = [&](std::vector<Hand> hands) {
    ++tick;
    send_frame(tick, 0.1 * static_cast<double>(tick));
    say(tick, {{kOthersSession, std::move(hands)}}, 0);
    for (std::int64_t ms = 0; ms < kTick_ms; ms += 8) {
      advance(8);
      if (tick > 20 || room->hands().empty()) continue;
      EXPECT_NEAR(x_of_others_hand(), other().pose->head().position.x(), 0.002) << tick;
    }
  };
  while (tick < 20) pass_tick({hand_at(0.1 * static_cast<double>(tick + 1))});
  ASSERT_THAT(room->hands(), SizeIs(1));
  EXPECT_LT(x_of_others_hand(), 1.95) << "hair is shown late";
  pass_tick({});
  EXPECT_THAT(room->hands(), SizeIs(1)) << "where hair is shown they have not gone yet";
  for (int i = 0; i < 8; ++i) pass_tick({});
  EXPECT_THAT(room->hands(), IsEmpty());
}

}  // namespace
}  // namespace hairnet::room
