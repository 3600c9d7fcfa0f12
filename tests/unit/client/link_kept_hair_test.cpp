#include "tests/unit/client/receiving_frames.hpp"

namespace hairnet::link {
namespace {

// Hair moves when the connection to its server is lost. The next server has the character, but sends no lattice of it
// yet, so the client may show the last known hair. `resumed` says that the server continued the session.
class Restarted : public Receiving {
 protected:
  explicit Restarted(bool resumed = false) {
    send_frame(10, kOwnMember, {});
    send_frame(10, kOther, {});
    d.core.on_closed("the cable", d.now_ns);
    d.open();
    d.expect<wire::Hello>();
    d.send(welcome_to(6, resumed));
    tell_members();
    d.take_all();
    d.core.take_events();
  }
  void come_to_next_server() {
    d.core.on_closed("the cable", d.now_ns);
    d.open();
    d.expect<wire::Hello>();
    d.send(welcome_to(7));
  }
  // Sends a frame without hair, and returns whether the client shows it with the last known hair.
  bool keeps_hair(std::uint64_t tick) {
    send_rigid_frame(tick, kOwnMember);
    const std::optional<Frame> frame = received();
    EXPECT_TRUE(frame);
    if (!frame) return false;
    EXPECT_EQ(frame->last_known, frame->basis != nullptr);
    return frame->last_known;
  }
};
class Resumed : public Restarted {
 protected:
  Resumed() : Restarted(true) {}
};

// Without the last known hair, all hair would jump to its rest shape when a server is replaced, and swing again from
// there.
TEST_F(Restarted, own_hair_keeps_its_shape_until_the_new_server_has_a_lattice) {
  send_rigid_frame(3, kOwnMember);
  const std::optional<Frame> frame = received();
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->last_known);
  ASSERT_TRUE(frame->basis);
  expect_near(frame->coefficients, coefficients_at(10, kOwnMember));
  EXPECT_LT((frame->pose.head().position - pose_at(3, kOwnMember).head().position).norm(), 1e-3);

  send_frame(4, kOwnMember, {});
  const std::optional<Frame> stepped = received();
  ASSERT_TRUE(stepped);
  EXPECT_FALSE(stepped->last_known);
  expect_near(stepped->coefficients, coefficients_at(4, kOwnMember));
  EXPECT_FALSE(keeps_hair(5));
}

TEST_F(Restarted, nothing_of_other_clients_is_kept) {
  send_rigid_frame(3, kOther);
  const std::optional<Frame> frame = received();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->level, LevelIndex::rigid);
}

TEST_F(Restarted, a_server_that_has_the_groom_and_gives_no_lattice_is_believed_after_a_while) {
  d.send(wire::GroomStatus{hash_of(1), wire::GroomState::building});
  // A build of levels may take any time. Only when it is ready, the server has kLatticeWait_ns, 1 s
  // (last_known_hair.cpp), from its next frame on.
  d.pass(60'000 * kMs);
  EXPECT_TRUE(keeps_hair(3));
  d.send(wire::GroomStatus{hash_of(1), wire::GroomState::ready});
  d.pass(60'000 * kMs);
  EXPECT_TRUE(keeps_hair(4)) << "no frame has come since";
  d.pass(1'000 * kMs);
  EXPECT_FALSE(keeps_hair(5));
}

TEST_F(Restarted, own_hair_keeps_its_shape_until_a_slow_line_has_brought_its_basis) {
  d.send(wire::GroomStatus{hash_of(1), wire::GroomState::ready});
  d.send(wire::GroomBasis{hash_of(1), hash_of(77)});
  // The basis hash_of(77) does not arrive, so the lattice of the frame below cannot be shown.
  d.pass(5'000 * kMs);
  send_frame(4, kOwnMember, {});
  const std::optional<Frame> frame = received();
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->last_known);
  expect_near(frame->coefficients, coefficients_at(10, kOwnMember));
}

TEST_F(Restarted, the_next_server_gets_as_long_again_for_its_lattice) {
  d.send(wire::GroomStatus{hash_of(1), wire::GroomState::ready});
  EXPECT_TRUE(keeps_hair(2));
  // The first server has used 0.9 s of its second. The next server must get a whole one.
  d.pass(900 * kMs);
  EXPECT_TRUE(keeps_hair(3));
  come_to_next_server();
  d.pass(60'000 * kMs);
  tell_members();
  d.core.take_events();
  EXPECT_TRUE(keeps_hair(4));
  d.send(wire::GroomStatus{hash_of(1), wire::GroomState::ready});
  EXPECT_TRUE(keeps_hair(5));
  d.pass(1'000 * kMs);
  EXPECT_FALSE(keeps_hair(6));
}

TEST_F(Restarted, hair_that_is_not_shown_any_more_does_not_come_back_with_the_next_server) {
  d.send(wire::GroomStatus{hash_of(1), wire::GroomState::ready});
  EXPECT_TRUE(keeps_hair(2));
  d.pass(1'000 * kMs);
  EXPECT_FALSE(keeps_hair(3));
  d.send(wire::GroomBasis{hash_of(1), hash_of(77)});
  send_frame(4, kOwnMember, {});
  const std::optional<Frame> frame = received();
  ASSERT_TRUE(frame);
  EXPECT_FALSE(frame->last_known);
  come_to_next_server();
  tell_members();
  d.core.take_events();
  EXPECT_FALSE(keeps_hair(4));
}

TEST_F(Restarted, hair_is_rigid_at_once_when_its_owner_wants_it_so) {
  EXPECT_TRUE(keeps_hair(3));
  d.core.send(wire::SetLevel{kOwnCharacter, LevelIndex::rigid});
  EXPECT_FALSE(keeps_hair(4));
}

TEST_F(Restarted, a_refused_groom_keeps_no_hair) {
  d.send(wire::GroomStatus{hash_of(1), wire::GroomState::refused});
  EXPECT_FALSE(keeps_hair(3));
}

TEST_F(Restarted, a_shape_that_was_gone_on_from_is_not_brought_to_the_next_server) {
  send_frame(4, kOwnMember, {});
  send_rigid_frame(5, kOwnMember);
  come_to_next_server();
  // The new server has moved the hair on and then made it rigid, so the shape from before is outdated.
  EXPECT_FALSE(d.expect<wire::AddCharacter>().state);
}

TEST_F(Restarted, a_shape_that_was_not_gone_on_from_is_brought_to_the_next_server) {
  send_rigid_frame(5, kOwnMember);
  come_to_next_server();
  const auto added = d.expect<wire::AddCharacter>();
  ASSERT_TRUE(added.state);
  expect_state(*added.state, 10);
}

// A server that resumes has simulated the hair all along. When it sends rigid hair, the hair is rigid.
TEST_F(Resumed, a_server_that_still_has_the_session_is_believed_at_once) {
  EXPECT_FALSE(keeps_hair(12));
}

TEST_F(Resumed, hair_is_kept_for_the_next_server_where_the_resumed_session_has_brought_no_frame) {
  come_to_next_server();
  EXPECT_TRUE(d.expect<wire::AddCharacter>().state);
  tell_members();
  d.core.take_events();
  EXPECT_TRUE(keeps_hair(3));
}

TEST_F(Resumed, hair_that_swung_on_leaves_no_shape_to_bring) {
  send_frame(11, kOwnMember, {});
  send_rigid_frame(12, kOwnMember);
  come_to_next_server();
  EXPECT_FALSE(d.expect<wire::AddCharacter>().state);
}

}  // namespace
}  // namespace hairnet::link
