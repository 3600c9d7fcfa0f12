#include "server/tick/touch.hpp"

#include <functional>
#include <optional>
#include <vector>

#include "tests/unit/server/touch_fixture.hpp"

// Hands and props, from the commands of sessions through the scheduler to the hair and back to messages.
namespace hairnet::server {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

// One run of StrokeTest: who may touch Ann's hair, and whether Ben strokes it.
struct Stroke {
  std::optional<TouchAudience> audience;
  std::vector<std::uint64_t> chosen = {};
  bool may_touch_others = true;
  bool has_hand = true;
};

class StrokeTest : public TouchTest {
 protected:
  // Returns the displacements of Ann's hair after 20 ticks. Two runs in which no hand touches the hair agree to the
  // bit.
  std::vector<Vec3f> hair_after(const Stroke& stroke_of) {
    start(nullptr);
    tick_ = 1;
    open(kAnn);
    open(kBen);
    if (!stroke_of.may_touch_others) commands_.put(SetTouchRight{kBen, false});
    add(kAnn);
    if (stroke_of.audience) say(kAnn, wire::SetTouch{1, *stroke_of.audience, stroke_of.chosen});
    tick();
    if (stroke_of.has_hand)
      stroke();
    else
      ticks(20);
    return displacement();
  }
};

TEST_F(StrokeTest, a_hand_moves_hair_of_one_who_allows_it_and_not_of_one_who_does_not) {
  using enum TouchAudience;
  const std::vector<Vec3f> alone = hair_after({.audience = everyone, .has_hand = false});
  EXPECT_NE(hair_after({everyone}), alone);
  EXPECT_NE(hair_after({chosen, {9, kBen, kBen}}), alone);
  EXPECT_EQ(hair_after({std::nullopt}), alone);
  EXPECT_EQ(hair_after({oneself}), alone);
  EXPECT_EQ(hair_after({nobody}), alone);
  EXPECT_EQ(hair_after({chosen, {kEve, 9}}), alone);
  EXPECT_EQ(hair_after({.audience = everyone, .may_touch_others = false}), alone);
}

TEST_F(TouchTest, a_hand_moves_its_owners_hair_without_a_word_also_when_it_may_not_touch_others) {
  open(kBen);
  commands_.put(SetTouchRight{kBen, false});
  add(kBen);
  tick();
  ticks(40);
  const std::vector<Vec3f> before = displacement(kBen);
  stroke();
  EXPECT_NE(displacement(kBen), before);
  EXPECT_TRUE(hair(kBen).is_touched);
}

TEST_F(TouchTest, props_touch_everyone_until_they_are_removed) {
  const auto ann = open(kAnn), ben = open(kBen);
  add(kAnn);
  tick();
  say(kBen, wire::SetProps{{ball_prop(3, kInHair), ball_prop(4, kHead + Vec3(3, 0, 0))}});
  tick();
  EXPECT_TRUE(hair().is_touched);
  for (const auto& sink : {ann, ben}) {
    const auto announced = sink->all<wire::RoomProps>();
    ASSERT_THAT(announced, SizeIs(1));
    EXPECT_THAT(announced[0].props, SizeIs(2));
    EXPECT_FALSE(announced[0].all);
  }
  say(kBen, wire::SetProps{{ball_prop(4, kHead + Vec3(2, 0, 0))}, {}});
  say(kAnn, wire::SetProps{{ball_prop(5, kHead + Vec3(2, 0, 0))}, {3, 99}});
  tick();
  const auto announced = ann->all<wire::RoomProps>();
  ASSERT_THAT(announced, SizeIs(2)) << "one message a tick";
  EXPECT_THAT(announced[1].removed, ElementsAre(3));
  ASSERT_THAT(announced[1].props, SizeIs(2));
  EXPECT_EQ(announced[1].props[0].number, 4);
  EXPECT_EQ(announced[1].props[1].number, 5);
  tick();
  EXPECT_FALSE(hair().is_touched);
  EXPECT_THAT(ann->all<wire::RoomProps>(), SizeIs(2));
}

TEST_F(TouchTest, a_prop_that_was_away_or_jumped_within_a_tick_has_jumped) {
  // A tick may bring several messages for one prop, of which the last place counts. A prop that jumped on the way, or
  // was removed and placed again, must not sweep the hair on the straight line between its places.
  const auto ann = open(kAnn);
  tick();
  say(kAnn, wire::SetProps{{ball_prop(1, kHead), ball_prop(2, kHead), ball_prop(3, kHead)}});
  tick();
  wire::Prop jumping = ball_prop(1, kHead + Vec3(1, 0, 0));
  jumping.has_jumped = true;
  say(kAnn, wire::SetProps{{jumping}, {2}});
  say(kAnn, wire::SetProps{{ball_prop(1, kHead), ball_prop(2, kHead), ball_prop(3, kInHair)}});
  tick();
  say(kAnn, wire::SetProps{{ball_prop(1, kInHair)}});
  tick();
  const auto announced = ann->all<wire::RoomProps>();
  ASSERT_THAT(announced, SizeIs(3));
  std::vector<bool> jumps;
  for (const wire::Prop& prop : announced[1].props) jumps.push_back(prop.has_jumped);
  EXPECT_THAT(jumps, ElementsAre(true, true, false));
  EXPECT_FALSE(announced[2].props[0].has_jumped) << "once";
}

TEST_F(TouchTest, a_room_begins_with_its_props_and_takes_them_along_when_it_ends) {
  const auto ann = open(kAnn, {ball_prop(3, kInHair)});
  add(kAnn);
  ticks(2);
  const auto announced = ann->all<wire::RoomProps>();
  ASSERT_THAT(announced, SizeIs(1));
  EXPECT_TRUE(announced[0].all);
  EXPECT_THAT(announced[0].props, SizeIs(1));
  EXPECT_TRUE(hair().is_touched);
  commands_.put(CloseSession{kAnn});
  // An empty room exists for 10 s (SchedulerDef::room_grace_ns); 400 ticks last 13 s.
  ticks(400);
  ASSERT_EQ(room_counters_.rooms_closed.value(), 1u);
  const auto ben = open(kBen);
  add(kBen);
  ticks(2);
  EXPECT_FALSE(hair(kBen).is_touched);
  EXPECT_THAT(ben->all<wire::RoomProps>(), IsEmpty());
}

TEST_F(TouchTest, who_comes_late_or_again_learns_of_props_and_rules) {
  const auto ann = open(kAnn);
  add(kAnn);
  say(kAnn, wire::SetTouch{1, TouchAudience::chosen, {9, 4}});
  say(kAnn, wire::SetProps{{ball_prop(3, kInHair)}});
  ticks(2);
  // Eve's session brings the props that her server remembers of the room. The room exists already, so they are ignored.
  const auto eve = open(kEve, {ball_prop(7, kHead)});
  add(kEve, kHead + Vec3(5, 0, 0));
  ticks(2);
  const auto props = eve->all<wire::RoomProps>();
  ASSERT_THAT(props, SizeIs(1));
  EXPECT_TRUE(props[0].all);
  ASSERT_THAT(props[0].props, SizeIs(1)) << "the room had its own already";
  EXPECT_EQ(props[0].props[0].number, 3);
  for (const auto& sink : {ann, eve}) {
    const auto rules = sink->all<wire::MemberTouch>();
    ASSERT_THAT(rules, SizeIs(1)) << "none of whose rule is the default";
    EXPECT_EQ(rules[0].member, 1u);
    EXPECT_EQ(rules[0].audience, TouchAudience::chosen);
    EXPECT_THAT(rules[0].chosen, ElementsAre(4, 9));
  }
  commands_.put(DetachSession{kEve});
  say(kAnn, wire::SetProps{{}, {3}});
  say(kAnn, wire::SetTouch{1, TouchAudience::oneself});
  ticks(40);
  const auto again = open(kEve, {}, true);
  ticks(2);
  ASSERT_THAT(again->all<wire::RoomProps>(), SizeIs(1));
  EXPECT_TRUE(again->all<wire::RoomProps>()[0].all) << "it may know props that have gone";
  EXPECT_THAT(again->all<wire::RoomProps>()[0].props, IsEmpty());
  const auto rules = again->all<wire::MemberTouch>();
  ASSERT_THAT(rules, SizeIs(1)) << "it knows an earlier rule of Ann's";
  EXPECT_EQ(rules[0].audience, TouchAudience::oneself);
}

TEST_F(TouchTest, rules_that_change_all_the_time_are_told_a_few_times_a_second) {
  open(kAnn);
  const auto eve = open(kEve);
  add(kAnn);
  tick();
  for (int t = 0; t < 60; ++t) {
    say(kAnn, wire::SetTouch{1, t % 2 == 0 ? TouchAudience::everyone : TouchAudience::nobody});
    tick();
  }
  ticks(10);
  const auto rules = eve->all<wire::MemberTouch>();
  // A rule is announced four times in a second at most (kRuleChangesPer_s in touch.cpp), so about eight times in two
  // seconds. The last rule must always arrive.
  EXPECT_LE(rules.size(), 10u);
  EXPECT_GE(rules.size(), 7u);
  EXPECT_EQ(rules.back().audience, TouchAudience::nobody);
}

TEST_F(TouchTest, held_hair_follows_the_hand_until_it_lets_go) {
  open(kAnn);
  const auto ben = open(kBen);
  add(kAnn);
  say(kAnn, wire::SetTouch{1, TouchAudience::everyone});
  move(kInHair, kInHair, 30);
  const std::vector<Vec3> before = points();
  take_hold();
  const auto held = ben->all<wire::Held>();
  ASSERT_THAT(held, SizeIs(1));
  EXPECT_EQ(held[0].member, 1u);
  EXPECT_EQ(held[0].hand, 0);
  EXPECT_EQ(held[0].point_count, held_count());
  EXPECT_EQ(counters_.holds_taken.value(), 1u);
  const LevelIndex level = hair().level;
  // The hand pulls 4 cm forward within a second and then stays for another one.
  const Vec3 pull(0, 0, 0.04);
  move(kInHair, kInHair + pull, 30);
  move(kInHair + pull, kInHair + pull, 30);
  EXPECT_EQ(hair().level, level) << "another level would end the hold";
  Vec3 way = Vec3::Zero();
  int count = 0;
  const std::vector<Vec3> after = points();
  for (std::size_t p = 0; p < before.size(); ++p) {
    // The hand has taken hold of the hair within 8 cm; points within 5 cm are surely held.
    if ((before[p] - kInHair).norm() > 0.05) continue;
    way += after[p] - before[p];
    ++count;
  }
  ASSERT_GT(count, 0);
  // The roots stay on the head and springs pull back, so the hair follows a part of the 4 cm; without the hold it would
  // stay.
  EXPECT_GT(way.z() / count, 0.01);
  say(kBen, wire::LetGo{1, 0, Release::drop});
  ticks(2);
  EXPECT_EQ(held_count(), 0u);
  EXPECT_THAT(ben->all<wire::Held>(), SizeIs(1)) << "it has let go itself";
  EXPECT_EQ(counters_.holds_ended.value(), 0u);
}

TEST_F(TouchTest, who_may_not_touch_any_more_pins_nothing_and_earlier_pins_stay) {
  // Ben is muted in the tick in which he pins hair, then while his pin waits for the next tick, and then when the pin
  // exists. Only the last pin stays.
  open(kAnn);
  open(kBen);
  add(kAnn);
  tick();
  take_hold();
  commands_.put(SetTouchRight{kBen, false});
  say(kBen, wire::LetGo{1, 0, Release::pin});
  put_hands(kBen, {});
  ticks(3);
  EXPECT_FALSE(hair().is_touched) << "muted in the same tick";

  commands_.put(SetTouchRight{kBen, true});
  put_hands(kBen, {ball_hand(kInHair)});
  say(kBen, wire::TakeHold{1, 0, Vec3f::Zero(), 0.08f});
  say(kBen, wire::LetGo{1, 0, Release::pin});
  tick();
  ASSERT_TRUE(hair().is_touched);
  commands_.put(SetTouchRight{kBen, false});
  put_hands(kBen, {});
  ticks(3);
  EXPECT_FALSE(hair().is_touched) << "muted before the World has the pin";

  commands_.put(SetTouchRight{kBen, true});
  take_hold();
  say(kBen, wire::LetGo{1, 0, Release::pin});
  tick();
  commands_.put(SetTouchRight{kBen, false});
  put_hands(kBen, {});
  ticks(3);
  EXPECT_TRUE(hair().is_touched) << "by the pin that was made before";
  say(kAnn, wire::LetGo{1, 0, Release::unpin});
  ticks(2);
  EXPECT_FALSE(hair().is_touched);
}

TEST_F(TouchTest, what_a_hand_takes_and_drops_or_pins_in_one_tick_it_does_not_hold_and_the_pin_stays) {
  open(kAnn);
  const auto ben = open(kBen);
  add(kAnn);
  say(kAnn, wire::SetTouch{1, TouchAudience::everyone});
  put_hands(kBen, {ball_hand(kInHair)});
  tick();
  // The World releases before it grabs within a step. So a drop cancels a hold of the same tick, and a pin waits for
  // the next tick; otherwise the hand would go on holding the hair.
  say(kBen, wire::TakeHold{1, 0, Vec3f::Zero(), 0.3f});
  say(kBen, wire::LetGo{1, 0, Release::drop});
  ticks(2);
  EXPECT_EQ(held_count(), 0u);
  ASSERT_THAT(ben->all<wire::Held>(), SizeIs(1));
  EXPECT_EQ(ben->all<wire::Held>()[0].point_count, 0u);
  say(kBen, wire::TakeHold{1, 0, Vec3f::Zero(), 0.3f});
  say(kBen, wire::LetGo{1, 0, Release::pin});
  ticks(2);
  EXPECT_EQ(held_count(), 0u);
  ASSERT_THAT(ben->all<wire::Held>(), SizeIs(2)) << "a pin is no end of a hold";
  EXPECT_GT(ben->all<wire::Held>()[1].point_count, 0u);
  put_hands(kBen, {});
  ticks(3);
  EXPECT_TRUE(hair().is_touched) << "by the pin";
  say(kBen, wire::LetGo{1, 0, Release::unpin});
  ticks(2);
  EXPECT_FALSE(hair().is_touched);
}

TEST_F(TouchTest, holds_of_nobody_or_of_who_does_not_allow_it_are_refused_with_a_reason) {
  open(kAnn);
  const auto ben = open(kBen);
  add(kAnn);
  put_hands(kBen, {ball_hand(kInHair)});
  tick();
  // Ann's rule is the default: only her own hands may touch her hair. The next four messages name members that do not
  // exist. Then Ann allows everyone, but Ben has lost the right, and in the end he names a hand that he does not have.
  say(kBen, wire::TakeHold{1, 0, Vec3f::Zero(), 0.1f});
  for (const std::uint32_t member : {0u, 2u, 4'000'000'000u}) say(kBen, wire::TakeHold{member, 0});
  say(kBen, wire::LetGo{77, 0});
  say(kAnn, wire::SetTouch{1, TouchAudience::everyone});
  commands_.put(SetTouchRight{kBen, false});
  say(kBen, wire::TakeHold{1, 0, Vec3f::Zero(), 0.1f});
  commands_.put(SetTouchRight{kBen, true});
  say(kBen, wire::TakeHold{1, 9, Vec3f::Zero(), 0.1f});
  tick();
  std::vector<wire::ErrorReason> reasons;
  for (const wire::Error& error : ben->all<wire::Error>()) {
    reasons.push_back(error.reason);
    EXPECT_EQ(error.character, 0u);
    EXPECT_FALSE(error.detail.empty());
  }
  using enum wire::ErrorReason;
  EXPECT_THAT(reasons, ElementsAre(not_allowed, character_unknown, character_unknown, character_unknown,
                                   character_unknown, not_allowed));
  ASSERT_THAT(ben->all<wire::Held>(), SizeIs(1)) << "it has no hand 9";
  EXPECT_EQ(ben->all<wire::Held>()[0].point_count, 0u);
  EXPECT_EQ(counters_.holds_refused_not_allowed.value(), 2u);
  EXPECT_EQ(counters_.holds_refused_unknown.value(), 3u);
  EXPECT_EQ(counters_.holds_refused_out_of_reach.value(), 1u);
}

TEST_F(TouchTest, hair_is_let_go_and_its_holder_told_when_the_hold_ends_otherwise) {
  // `end` is what ends the hold, and `tick_count` the ticks until Ben hears of it.
  struct Case {
    const char* name;
    std::function<void()> end;
    int tick_count;
  };
  const std::vector<Case> cases{
      // Hands are gone 0.5 s after their last sample (HandsInbox::kGone_ns), which are 15 ticks; the delay of poses and
      // the tick that tells Ben come to these.
      {"no hands for half a second", [] {}, 17},
      {"a sample without them", [&] { put_hands(kBen, {}); }, 1},
      // Held hair stretches by 0.25 m at most (kHoldStretchMax_m); the hand moves 1 m.
      {"torn away", [&] { put_hands(kBen, {ball_hand(kInHair + Vec3(0, 0, 1))}); }, 1},
      {"not allowed any more",
       [&] {
         say(kAnn, wire::SetTouch{1, TouchAudience::nobody});
       },
       1},
      {"muted",
       [&] {
         commands_.put(SetTouchRight{kBen, false});
       },
       1},
  };
  for (const auto& [name, end, tick_count] : cases) {
    SCOPED_TRACE(name);
    start(nullptr);
    open(kAnn);
    const auto ben = open(kBen);
    add(kAnn);
    tick();
    take_hold();
    end();
    ticks(tick_count - 2);
    EXPECT_THAT(ben->all<wire::Held>(), SizeIs(1));
    ticks(2);
    EXPECT_EQ(held_count(), 0u);
    const auto held = ben->all<wire::Held>();
    ASSERT_THAT(held, SizeIs(2));
    EXPECT_EQ(held[1].member, 1u);
    EXPECT_EQ(held[1].point_count, 0u);
  }
  EXPECT_EQ(counters_.holds_ended.value(), cases.size());
}

}  // namespace
}  // namespace hairnet::server
