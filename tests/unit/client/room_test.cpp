#include <gmock/gmock.h>

#include "schema/wire/basis_file.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/support/build_grooms.hpp"
#include "tests/unit/client/room_on_core.hpp"
#include "tests/unit/client/small_basis.hpp"

namespace hairnet::room {
namespace {

using link::kMs;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::uint32_t kOther = 40;

Groom groom_named(const char* name) {
  Groom groom = support::make_head_of_hair(20);
  groom.name = name;
  return groom;
}
link::RequestedState::Bytes file_of(const Groom& groom) {
  return std::make_shared<const std::vector<std::uint8_t>>(wire::encode_groom(groom));
}
Pose pose_at(double x) {
  return rigid_pose({Quat::Identity(), Vec3(x, 1, 2)});
}
std::vector<std::uint8_t> content(double x, std::span<const float> coefficients) {
  const codec::CoefficientCode code(link::small_basis().basis.deviation_m);
  codec::EncodedFrame coded;
  codec::encode_frame(pose_at(x), &code, coefficients, 0, coded);
  const std::span<const std::uint8_t> bytes = coded.prefix(coefficients.size());
  return {bytes.begin(), bytes.end()};
}

// Adds another member, "Ada", to a room on a core. Frames show every member with the basis of small_basis() and 0.01 m
// for each coefficient.
class RoomTest : public RoomOnCore {
 protected:
  void join() {
    d.connect(link::welcome_to(5));
    advance();
    d.take_all();
    events<Error>();
  }
  void tell_of_other(std::uint32_t number = kOther, std::uint8_t generation = 0) {
    d.send(wire::MemberJoined{number, 9, 1, wire::hash_groom(*others_file), "Ada", std::nullopt, generation});
  }
  void send_others_groom() {
    d.send(wire::GroomData{wire::hash_groom(*others_file), others_file->size(), 0, *others_file});
  }
  static std::vector<std::uint8_t> basis_file() {
    const wire::HairBasis hair = link::small_basis();
    return wire::encode_basis(hair.geometry, hair.basis, hair.skin);
  }
  void announce_basis(const wire::GroomHash& groom) { d.send(wire::GroomBasis{groom, wire::hash_groom(basis_file())}); }
  void send_basis() {
    const std::vector<std::uint8_t> file = basis_file();
    d.send(wire::GroomData{wire::hash_groom(file), file.size(), 0, file});
  }
  std::vector<std::uint8_t> frame_packet(std::uint64_t tick, std::uint32_t member, double x) {
    const std::vector<float> coefficients(12, 0.01f);
    const std::vector<std::uint8_t> bytes = content(x, coefficients);
    wire::FrameBatch batch;
    batch.tick = tick;
    batch.sample_time_ns = link::kServerClock_ns + d.now_ns;
    wire::Frame frame;
    frame.member = member;
    frame.level = LevelIndex::low;
    frame.content = bytes;
    batch.frames.push_back(frame);
    return d.packet(batch);
  }
  void send_frame(std::uint64_t tick, std::uint32_t member, double x) {
    d.core.on_bytes(frame_packet(tick, member, x), d.now_ns);
  }
  link::RequestedState::Bytes others_file = file_of(groom_named("others"));
};

TEST_F(RoomTest, fetches_the_hairstyle_of_another_and_shows_its_hair) {
  join();
  tell_of_other();
  for (int i = 0; i < 10; ++i) advance(100);
  // The room waits for reports of sizes before it fetches a first hairstyle, for up to 0.6 s and four calls
  // (groom_queue.cpp). One second is enough.
  ASSERT_THAT(sent<wire::GroomRequest>(), ::testing::SizeIs(1));
  const auto joined = events<Joined>();
  ASSERT_EQ(joined.size(), 1u);
  EXPECT_EQ(joined[0].member->tag, "Ada");
  EXPECT_EQ(joined[0].member->groom, nullptr);
  EXPECT_FALSE(joined[0].member->pose);

  send_others_groom();
  announce_basis(wire::hash_groom(*others_file));
  // The first frame makes the client ask for the basis.
  send_frame(1, kOther, 0.5);
  send_basis();
  for (std::uint64_t tick = 2; tick < 30; ++tick) {
    send_frame(tick, kOther, 0.5);
    advance(33);
  }
  const Member& member = *room->members().at(kOther);
  ASSERT_TRUE(member.groom);
  EXPECT_EQ(member.groom->name, "others");
  EXPECT_EQ(*member.groom_file, *others_file);
  ASSERT_TRUE(member.pose);
  EXPECT_NEAR(member.pose->head().position.x(), 0.5, 1e-3);
  ASSERT_NE(member.sample.lattice().geometry, nullptr);
  EXPECT_NEAR(member.sample.coefficients[0], 0.01f, 1e-3f);
  EXPECT_NE(member.skin, nullptr);

  d.send(wire::MemberLeft{kOther});
  advance(33);
  EXPECT_THAT(room->members(), IsEmpty());
  EXPECT_EQ(events<Left>().size(), 1u);
  // Nobody in the room has the hairstyle any more, so its file is forgotten, and fetched again for the next member who
  // has it.
  sent<wire::GroomRequest>();
  tell_of_other(kOther + 1);
  for (int i = 0; i < 10; ++i) advance(100);
  EXPECT_EQ(sent<wire::GroomRequest>().size(), 1u);
}

TEST_F(RoomTest, fetches_nothing_of_others_that_it_does_not_observe) {
  wire::Observe nobody;
  nobody.mode = wire::ObserveMode::list;
  make_room(nobody);
  join();
  tell_of_other();
  for (int i = 0; i < 20; ++i) advance(100);
  EXPECT_THAT(sent<wire::GroomRequest>(), IsEmpty());
}

TEST_F(RoomTest, shows_an_own_character_where_it_was_pushed_last_also_after_a_change_of_the_server) {
  const auto mine = file_of(groom_named("mine"));
  const std::uint32_t me = *room->add_character(mine, {LevelIndex::low, "Bea", std::nullopt});
  join();
  EXPECT_EQ(room->member_of(me), nullptr);
  d.send(wire::CharacterAdded{me, wire::hash_groom(*mine), LevelIndex::low, 31});
  ASSERT_TRUE(room->push(me, pose_at(1)));
  advance(10);
  const auto member = room->member_of(me);
  ASSERT_TRUE(member);
  EXPECT_EQ(member->number, 31u);
  EXPECT_EQ(member->tag, "Bea");
  EXPECT_EQ(member->groom->name, "mine");
  EXPECT_EQ(member->pose->head().position.x(), 1) << "without a frame";
  ASSERT_TRUE(room->push(me, pose_at(2)));
  advance();
  EXPECT_EQ(member->pose->head().position.x(), 2);

  // The next server gives the character another session and another number, but the room must go on with the same
  // object.
  d.core.on_closed("the cable", d.now_ns);
  advance();
  EXPECT_EQ(room->state(), State::reconnecting);
  d.open();
  d.send(link::welcome_to(6));
  d.send(wire::CharacterAdded{me, wire::hash_groom(*mine), LevelIndex::low, 3});
  advance(10);
  EXPECT_EQ(room->state(), State::connected);
  EXPECT_EQ(room->member_of(me), member);
  std::vector<std::uint32_t> numbers;
  for (const Event& event : room->take_events()) {
    if (const auto* joined = std::get_if<Joined>(&event)) numbers.push_back(joined->number);
    // A departure counts as 100 plus the number, to tell it from an arrival.
    if (const auto* left = std::get_if<Left>(&event)) numbers.push_back(100 + left->number);
  }
  EXPECT_THAT(numbers, ::testing::ElementsAre(31, 131, 3));
  EXPECT_EQ(member->number, 3u);
  EXPECT_EQ(member->session, 6u);
  EXPECT_EQ(room->members().size(), 1u);

  room->remove_character(me);
  advance();
  EXPECT_THAT(room->members(), IsEmpty());
  EXPECT_EQ(room->member_of(me), nullptr);
  EXPECT_EQ(sent<wire::RemoveCharacter>().size(), 1u);
}

// A program pushes all of its characters in each image. One wrong pose must not cost the poses of the others.
TEST_F(RoomTest, many_poses_of_one_call_are_one_packet_and_wrong_ones_are_dropped_and_counted) {
  const auto mine = file_of(groom_named("mine"));
  const std::uint32_t a = *room->add_character(mine), b = *room->add_character(mine);
  join();
  for (const std::uint32_t own : {a, b})
    d.send(wire::CharacterAdded{own, wire::hash_groom(*mine), LevelIndex::high, 30 + own});
  advance();
  d.take_all();
  EXPECT_TRUE(room->push(std::vector<OwnPose>{{a, pose_at(1), false}, {b, pose_at(2), true}}));
  std::vector<wire::PoseBatch> batches = sent<wire::PoseBatch>();
  ASSERT_EQ(batches.size(), 1u);
  EXPECT_EQ(batches[0].poses.size(), 2u);

  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Result<void> pushed = room->push(std::vector<OwnPose>{{a, pose_at(nan), false}, {b, pose_at(3), false}});
  ASSERT_FALSE(pushed);
  EXPECT_THAT(pushed.error(), HasSubstr("character " + std::to_string(a)));
  batches = sent<wire::PoseBatch>();
  ASSERT_EQ(batches.size(), 1u);
  EXPECT_EQ(batches[0].poses.size(), 1u);
  advance();
  EXPECT_EQ(room->member_of(a)->pose->head().position.x(), 1) << "where it was";
  EXPECT_EQ(room->inputs_dropped(), 1u);
  EXPECT_FALSE(room->set_material(a, {-1}));
  EXPECT_FALSE(room->set_appearance(a, std::string(wire::kTagBytesMax + 1, 'x'), {}));
  EXPECT_FALSE(room->add_character(mine, {LevelIndex::high, std::string(wire::kTagBytesMax + 1, 'x'), {}}));
  Wind storm;
  storm.mean_m_per_s.x() = nan;
  EXPECT_FALSE(room->set_wind(storm));
  EXPECT_EQ(room->inputs_dropped(), 5u);
}

// A stranger's file may be broken by intent. The room must go on without that person's hair.
TEST_F(RoomTest, a_damaged_file_adds_nobody_and_that_of_another_is_told_once) {
  std::vector<std::uint8_t> damaged = *others_file;
  damaged[damaged.size() / 2] ^= 0x55;
  damaged.resize(damaged.size() - 10);
  const auto bytes = std::make_shared<const std::vector<std::uint8_t>>(damaged);
  EXPECT_FALSE(room->add_character(bytes));
  join();
  d.send(wire::MemberJoined{kOther, 9, 1, wire::hash_groom(damaged)});
  for (int i = 0; i < 10; ++i) advance(100);
  d.send(wire::GroomData{wire::hash_groom(damaged), damaged.size(), 0, damaged});
  advance(10);
  EXPECT_THAT(room->members().at(kOther)->error, ::testing::Not(IsEmpty()));
  const auto errors = events<Error>();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_THAT(errors[0].detail, HasSubstr("cannot be shown"));
}

TEST_F(RoomTest, asks_again_for_a_hairstyle_that_nobody_could_give) {
  join();
  tell_of_other();
  for (int i = 0; i < 10; ++i) advance(100);
  ASSERT_EQ(sent<wire::GroomRequest>().size(), 1u);
  d.send(wire::Error{wire::ErrorReason::groom_unavailable, 0, wire::hash_groom(*others_file), "its owner has left"});
  // A hairstyle that was not available is asked for again after 3 s (kAskAgain_ns in room.cpp): not in the first 2 s,
  // but in the next 2.
  for (int i = 0; i < 20; ++i) advance(100);
  EXPECT_THAT(sent<wire::GroomRequest>(), IsEmpty());
  EXPECT_THAT(events<Error>(), IsEmpty());
  for (int i = 0; i < 20; ++i) advance(100);
  EXPECT_EQ(sent<wire::GroomRequest>().size(), 1u);
}

TEST_F(RoomTest, is_empty_and_stays_closed_after_close) {
  join();
  tell_of_other();
  advance();
  events<Joined>();
  // This announcement is on its way while the room is closed.
  tell_of_other(kOther + 1);
  room->close();
  EXPECT_THAT(room->members(), IsEmpty());
  advance();
  room->close();
  EXPECT_EQ(room->state(), State::closed);
  EXPECT_THAT(room->members(), IsEmpty());
  EXPECT_EQ(events<StateChanged>().size(), 1u);
}

TEST_F(RoomTest, a_caller_that_was_busy_gets_its_frames_as_if_it_had_not_been) {
  join();
  tell_of_other();
  announce_basis(wire::hash_groom(*others_file));
  send_frame(1, kOther, 0.5);
  send_basis();
  std::uint64_t tick = 2;
  for (; tick < 40; ++tick) {
    send_frame(tick, kOther, 0.5);
    advance(33);
  }
  const auto delay_ms = [&] { return 1e-6 * static_cast<double>(room->members().at(kOther)->playout.delay_ns()); };
  const double before_ms = delay_ms();
  // The caller reads nothing for half a second, and then all packets at once.
  std::vector<std::vector<std::uint8_t>> packets;
  for (int i = 0; i < 15; ++i, ++tick) {
    d.now_ns += 33 * kMs;
    packets.push_back(frame_packet(tick, kOther, 0.5));
  }
  for (const std::vector<std::uint8_t>& packet : packets) d.core.on_bytes(packet, d.now_ns);
  for (int i = 0; i < 30; ++i, ++tick) {
    advance(33);
    send_frame(tick, kOther, 0.5);
  }
  // Frames that the caller reads late are not late frames: the play-out delay must not grow by the half second of its
  // pause.
  EXPECT_NEAR(delay_ms(), before_ms, 40);
}

// A negative height counts as 0. A NaN would make the whole message invalid.
TEST_F(RoomTest, heights_on_the_screen_that_no_message_may_say_corrupt_no_report) {
  join();
  tell_of_other();
  tell_of_other(kOther + 1);
  advance();
  d.take_all();
  room->report_importance({{kOther, -0.1f, true}, {kOther + 1, std::numeric_limits<float>::quiet_NaN(), true}});
  advance(300);
  const auto reports = sent<wire::ReportImportance>();
  ASSERT_EQ(reports.size(), 1u);
  ASSERT_EQ(reports[0].members.size(), 1u);
  EXPECT_EQ(reports[0].members[0].screen_height, 0);
  EXPECT_EQ(room->inputs_dropped(), 1u);
}

// A program that reconnected at once after being removed would fight the moderator.
TEST_F(RoomTest, the_end_is_told_with_its_reason_and_whether_to_try_again) {
  join();
  tell_of_other();
  advance();
  events<Joined>();
  d.send(wire::Goodbye{wire::GoodbyeReason::removed, "by a moderator"});
  advance();
  const auto states = events<StateChanged>();
  ASSERT_EQ(states.size(), 1u);
  EXPECT_EQ(states[0].state, State::closed);
  EXPECT_TRUE(states[0].is_refused);
  EXPECT_THAT(states[0].detail, HasSubstr("moderator"));
  EXPECT_THAT(room->members(), IsEmpty());
}

}  // namespace
}  // namespace hairnet::room
