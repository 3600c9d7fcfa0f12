#include <gmock/gmock.h>

#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "client/hairnet.h"
#include "core/touch/hand.hpp"
#include "core/world/grab.hpp"
#include "schema/limits.hpp"
#include "schema/wire/messages.hpp"

// Tests hands and props of a room through the C interface.
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;
namespace wire = hairnet::wire;

// Hand numbers have 8 bits inside. Cut to these, this one would be 0, which is valid.
constexpr std::uint32_t kBeyondByte = 256;

constexpr std::uint32_t kOther = 40;

// Gives each test a connected room in session 5 with a member of session 9. The test carries the packets, and plays the
// server.
class HairnetHRoomTouch : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(hairnet_open(nullptr, now_ns, &room, nullptr, 0), HAIRNET_OK);
    ASSERT_EQ(hairnet_wants_connection(room, nullptr, nullptr), 1);
    hairnet_on_opening(room, now_ns);
    hairnet_on_open(room, 0, now_ns);
    wire::Welcome welcome;
    welcome.session = 5;
    welcome.may_set_props = true;
    send(welcome);
    send(wire::MemberJoined{kOther, 9, 1, {1}});
    hairnet_advance(room);
    events();
    sent<wire::Hello>();
  }
  void TearDown() override { hairnet_room_free(room); }
  void send(wire::Message message) {
    const std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, std::move(message)});
    hairnet_on_packet(room, packet.data(), packet.size(), now_ns);
  }
  template <class T>
  std::vector<T> sent() {
    std::vector<T> found;
    std::size_t size = 0;
    while (const void* packet = hairnet_take_packet(room, now_ns, &size, nullptr)) {
      wire::DecodedPacket decoded = wire::decode_packet({static_cast<const std::uint8_t*>(packet), size});
      if (auto* m = std::get_if<T>(&decoded.envelope.message)) found.push_back(std::move(*m));
    }
    return found;
  }
  std::vector<hairnet_event> events() {
    std::vector<hairnet_event> all;
    for (hairnet_event event; hairnet_next_event(room, &event) != 0;) all.push_back(event);
    return all;
  }
  std::uint64_t inputs_dropped() {
    hairnet_counters counters = HAIRNET_COUNTERS;
    hairnet_get_counters(room, &counters);
    return counters.inputs_dropped;
  }
  // client/web/src/room/touch.ts writes and reads these fields at fixed offsets.
  static_assert(offsetof(hairnet_touch_body, is_inside_out) == 12 && offsetof(hairnet_touch_body, has_jumped) == 16);
  static_assert(offsetof(hairnet_touch_body, half_size_m) == 20 && offsetof(hairnet_touch_body, radius_m) == 32);
  static_assert(offsetof(hairnet_touch_body, rotation) == 40 && sizeof(hairnet_touch_body) == 96);
  static hairnet_touch_body box(std::uint32_t number) {
    hairnet_touch_body body{};
    body.number = number;
    body.shape = HAIRNET_BOX;
    body.half_size_m[0] = body.half_size_m[1] = body.half_size_m[2] = 0.5f;
    body.rotation[3] = 1;
    body.position[1] = 2;
    return body;
  }

  std::int64_t now_ns = 1'000'000'000;
  hairnet_room* room = nullptr;
  std::array<char, 200> error{};
};

// The server echoes the hands here as those of session 9, so that both directions are compared with each other.
TEST_F(HairnetHRoomTouch, hands_go_out_and_those_of_others_come_in_the_same_form) {
  const std::array<hairnet_hand_shape, 3> shapes{
      {{{0, 0, 0}, {0, 0.08f, 0}, 0.01f, 0}, {{0, 0, 0}, {0, 0, 0}, 0.04f, 0}, {{1, 0, 0}, {1, 0, 0}, 0.5f, 1}}};
  std::array<hairnet_hand, 2> hands{};
  hands[0].shapes = shapes.data();
  hands[0].shape_count = 2;
  hands[1].shapes = shapes.data() + 2;
  hands[1].shape_count = 1;
  hands[1].first_number = 8;
  hands[1].has_jumped = 1;
  for (hairnet_hand& hand : hands) hand.rotation[3] = 1;
  hands[1].position[2] = -3;
  ASSERT_EQ(hairnet_push_hands(room, hands.data(), hands.size(), error.data(), error.size()), HAIRNET_OK)
      << error.data();
  const auto batches = sent<wire::PoseBatch>();
  ASSERT_THAT(batches, SizeIs(1));
  ASSERT_TRUE(batches[0].hands);

  send(wire::RoomHands{1, 0, {{9, batches[0].hands->hands}}});
  hairnet_advance(room);
  ASSERT_EQ(hairnet_get_hands(room, nullptr, 0), 2u);
  std::array<hairnet_hand, 3> theirs{};
  ASSERT_EQ(hairnet_get_hands(room, theirs.data(), theirs.size()), 2u);
  EXPECT_EQ(theirs[1].session, 9u);
  EXPECT_EQ(theirs[1].first_number, 8u);
  EXPECT_EQ(theirs[1].has_jumped, 1u);
  EXPECT_NEAR(theirs[1].position[2], -3, 1e-3);
  EXPECT_NEAR(theirs[1].rotation[3], 1, 1e-3);
  ASSERT_EQ(theirs[0].shape_count, 2u);
  EXPECT_NEAR(theirs[0].shapes[0].to[1], 0.08f, 1e-3f);
  ASSERT_EQ(theirs[1].shape_count, 1u);
  EXPECT_NEAR(theirs[1].shapes[0].from[0], 1, 1e-3f);
  EXPECT_EQ(theirs[1].shapes[0].is_inside_out, 1u);

  // The numbers of a person's hand shapes are below kHandShapesMax, which the message names.
  hands[0].first_number = kBeyondByte;
  EXPECT_EQ(hairnet_push_hands(room, hands.data(), 1, error.data(), error.size()), HAIRNET_INVALID);
  EXPECT_THAT(error.data(), HasSubstr(std::to_string(hairnet::kHandShapesMax)));
  EXPECT_EQ(inputs_dropped(), 1u);
  EXPECT_EQ(hairnet_push_hands(room, nullptr, 0, nullptr, 0), HAIRNET_OK) << "they are gone";
}

TEST_F(HairnetHRoomTouch, a_hold_is_asked_for_and_answered) {
  const std::array<double, 3> place{0, 0.01, 0};
  ASSERT_EQ(hairnet_take_hold(room, kOther, 2, place.data(), 0.05, error.data(), error.size()), HAIRNET_OK);
  EXPECT_EQ(hairnet_let_go(room, kOther, 2, HAIRNET_PIN), HAIRNET_OK);
  EXPECT_THAT(sent<wire::TakeHold>(), SizeIs(1));
  // A count that does not fit 16 bits becomes the greatest that does.
  send(wire::Held{kOther, 2, 70'000});
  hairnet_advance(room);
  const std::vector<hairnet_event> announced = events();
  ASSERT_THAT(announced, SizeIs(1));
  EXPECT_EQ(announced[0].kind, HAIRNET_EVENT_HELD);
  EXPECT_EQ(announced[0].member, kOther);
  EXPECT_EQ(announced[0].hand, 2);
  EXPECT_EQ(announced[0].held, 65'535);

  // Member 3 is not there. Hand numbers are below kHandShapesMax, and the radius is at most kGrabRadiusMax_m.
  EXPECT_EQ(hairnet_take_hold(room, 3, 2, place.data(), 0.05, error.data(), error.size()), HAIRNET_NOT_THERE);
  EXPECT_EQ(hairnet_take_hold(room, kOther, kBeyondByte, place.data(), 0.05, error.data(), error.size()),
            HAIRNET_INVALID);
  EXPECT_EQ(
      hairnet_take_hold(room, kOther, 2, place.data(), hairnet::kGrabRadiusMax_m + 0.01, error.data(), error.size()),
      HAIRNET_INVALID);
  EXPECT_THAT(error.data(), HasSubstr("radius"));
  EXPECT_EQ(hairnet_let_go(room, 3, 2, HAIRNET_DROP), HAIRNET_NOT_THERE);
  EXPECT_EQ(hairnet_let_go(room, kOther, hairnet::kHandShapesMax, HAIRNET_DROP), HAIRNET_INVALID);
  // Only the two holds with invalid numbers count as dropped inputs.
  EXPECT_EQ(inputs_dropped(), 2u);
}

// By default nobody but the owner may touch hair. Then the other member chooses the sessions 4 and 5, and this
// client is session 5.
TEST_F(HairnetHRoomTouch, who_may_touch_is_set_and_told) {
  EXPECT_EQ(hairnet_may_touch(room, kOther), 0);
  send(wire::MemberTouch{kOther, hairnet::TouchAudience::chosen, {4, 5}});
  hairnet_advance(room);
  const std::vector<hairnet_event> announced = events();
  ASSERT_THAT(announced, SizeIs(1));
  EXPECT_EQ(announced[0].kind, HAIRNET_EVENT_TOUCH);
  EXPECT_EQ(announced[0].member, kOther);
  EXPECT_EQ(hairnet_may_touch(room, kOther), 1);
  EXPECT_EQ(hairnet_may_touch(room, 3), 0) << "nobody";

  hairnet_groom* groom = nullptr;
  ASSERT_EQ(hairnet_groom_make("bob", 100, &groom, nullptr, 0), HAIRNET_OK);
  std::uint32_t me = 0;
  ASSERT_EQ(hairnet_add_character(room, groom, nullptr, &me, nullptr, 0), HAIRNET_OK);
  hairnet_groom_free(groom);
  const std::array<std::uint64_t, 2> friends{4, 9};
  ASSERT_EQ(hairnet_set_touch(room, me, HAIRNET_CHOSEN, friends.data(), 2, error.data(), error.size()), HAIRNET_OK);
  const auto rules = sent<wire::SetTouch>();
  ASSERT_THAT(rules, SizeIs(1));
  EXPECT_EQ(rules[0].audience, hairnet::TouchAudience::chosen);
  EXPECT_THAT(rules[0].chosen, ::testing::ElementsAre(4u, 9u));
  EXPECT_EQ(hairnet_set_touch(room, me + 1, HAIRNET_NOBODY, nullptr, 0, nullptr, 0), HAIRNET_NOT_THERE);
}

TEST_F(HairnetHRoomTouch, props_are_set_and_come_back) {
  EXPECT_EQ(hairnet_may_set_props(room), 1);
  const std::uint8_t gone = 7;
  const std::array<hairnet_touch_body, 2> props{box(3), box(4)};
  ASSERT_EQ(hairnet_set_props(room, props.data(), 2, &gone, 1, error.data(), error.size()), HAIRNET_OK) << error.data();
  const auto set = sent<wire::SetProps>();
  ASSERT_THAT(set, SizeIs(1));
  EXPECT_THAT(set[0].removed, ::testing::ElementsAre(7));
  std::vector<wire::Prop> all = set[0].props;
  all.push_back({5, hairnet::sphere(0.25), {}, false});
  all.push_back({6, hairnet::capsule(0.5, 0.25), {}, true});
  send(wire::RoomProps{all, {}, true});
  hairnet_advance(room);
  ASSERT_THAT(events(), SizeIs(1));
  EXPECT_EQ(hairnet_get_props(room, nullptr, 0), 4u);
  std::array<hairnet_touch_body, 4> announced{};
  ASSERT_EQ(hairnet_get_props(room, announced.data(), announced.size()), 4u);
  EXPECT_EQ(announced[0].number, 3u);
  EXPECT_EQ(announced[0].shape, static_cast<std::uint32_t>(HAIRNET_BOX));
  EXPECT_EQ(announced[0].half_size_m[1], 0.5f);
  EXPECT_EQ(announced[0].position[1], 2);
  EXPECT_EQ(announced[2].shape, static_cast<std::uint32_t>(HAIRNET_SPHERE));
  EXPECT_EQ(announced[2].radius_m, 0.25f);
  EXPECT_EQ(announced[3].shape, static_cast<std::uint32_t>(HAIRNET_CAPSULE));
  EXPECT_EQ(announced[3].half_size_m[1], 0.5f);
  EXPECT_EQ(announced[3].has_jumped, 1u);

  // The numbers of props are below kPropsMax.
  hairnet_touch_body beyond = box(wire::kPropsMax);
  EXPECT_EQ(hairnet_set_props(room, &beyond, 1, nullptr, 0, error.data(), error.size()), HAIRNET_INVALID);
  EXPECT_THAT(error.data(), HasSubstr(std::to_string(wire::kPropsMax)));
  beyond = box(1);
  beyond.rotation[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(hairnet_set_props(room, &beyond, 1, nullptr, 0, error.data(), error.size()), HAIRNET_INVALID);
  EXPECT_EQ(inputs_dropped(), 2u);
  EXPECT_THAT(sent<wire::SetProps>(), ::testing::IsEmpty());
}

}  // namespace
