#include "schema/wire/frame_datagram.hpp"
#include "tests/unit/client/receiving_frames.hpp"

namespace hairnet::link {
namespace {

TEST_F(Receiving, any_frame_decodes_without_those_before) {
  for (const std::uint64_t tick : {1000u, 1001u, 1003u, 1010u, 5000u}) {
    send_frame(tick, kOther);
    const std::optional<Frame> frame = received();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->member, kOther);
    EXPECT_EQ(frame->character, 0u);
    EXPECT_EQ(frame->level, LevelIndex::low);
    EXPECT_FALSE(frame->discontinuous);
    expect_near(frame->coefficients, coefficients_at(tick, kOther));
    // Two ticks of the 30 Hz that a Welcome has by default (send_frame() sets a stride of 2).
    EXPECT_FLOAT_EQ(frame->step_s, 2.0f / 30);
    EXPECT_NEAR(frame->pose.head().position.x(), 0.1 * static_cast<double>(tick) + kOther, 1e-3);
    ASSERT_TRUE(frame->basis);
    std::vector<Vec3f> shown, wanted(kSmallBasisNodes);
    displacements_of(*frame, shown);
    hairnet::displacements_of(small_basis().basis, coefficients_at(tick, kOther), wanted);
    ASSERT_EQ(shown.size(), wanted.size());
    // Twelve rounded coefficients may differ by 2 mm in sum.
    for (std::size_t n = 0; n < shown.size(); ++n) EXPECT_LT((shown[n] - wanted[n]).norm(), 2e-3f);
  }
  EXPECT_EQ(d.core.counters().frames_undecodable, 0u);
  // The set-up has sent one frame before these five.
  EXPECT_EQ(d.core.counters().frames_received, 6u);
}

TEST_F(Receiving, a_frame_that_was_cut_off_is_a_coarser_hair) {
  send_frame(10, kOther, {.count = 3});
  const std::optional<Frame> frame = received();
  ASSERT_TRUE(frame);
  const std::vector<float> wanted = coefficients_at(10, kOther);
  for (std::size_t k = 0; k < frame->coefficients.size(); ++k)
    EXPECT_NEAR(frame->coefficients[k], k < 3 ? wanted[k] : 0, kRounding);
}

TEST_F(Receiving, own_frames_carry_the_own_number) {
  send_frame(10, kOwnMember, {});
  const std::optional<Frame> frame = received();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->character, kOwnCharacter);
  EXPECT_EQ(frame->member, kOwnMember);
}

TEST_F(Receiving, damaged_content_is_no_reason_to_leave) {
  send_frame(10, kOther, {.damaged = true});
  EXPECT_EQ(d.core.counters().frames_undecodable, 1u);
  EXPECT_TRUE(d.core.active());
}

TEST_F(Receiving, hair_that_is_brought_to_a_new_server_is_that_of_the_last_frame_that_could_be_decoded) {
  send_frame(10, kOwnMember);
  send_frame(11, kOwnMember, {.damaged = true});
  d.core.on_closed("the cable", d.now_ns);
  d.open();
  d.expect<wire::Hello>();
  d.send(welcome_to(6));
  const auto added = d.expect<wire::AddCharacter>();
  ASSERT_TRUE(added.state);
  expect_state(*added.state, 10);
}

TEST_F(Receiving, a_jump_that_could_not_be_decoded_parts_the_frames_around_it) {
  send_frame(10, kOther, {});
  send_frame(11, kOther, {.discontinuous = true, .damaged = true});
  send_frame(12, kOther, {});
  send_frame(13, kOther, {});
  const std::vector<FrameBatch> batches = d.events<FrameBatch>();
  ASSERT_EQ(batches.size(), 3u);
  EXPECT_FALSE(batches[0].frames[0].discontinuous);
  EXPECT_TRUE(batches[1].frames[0].discontinuous);
  EXPECT_FALSE(batches[2].frames[0].discontinuous);
}

TEST_F(Receiving, frames_of_unknown_members_and_old_ticks_are_counted) {
  send_frame(10, 99, {});
  send_frame(10, kOther, {});
  send_frame(10, kOther, {});
  send_frame(9, kOther, {});
  d.send(wire::MemberLeft{kOther});
  send_frame(11, kOther, {});
  EXPECT_EQ(d.core.counters().frames_unknown, 4u);
  EXPECT_EQ(d.events<FrameBatch>().size(), 1u);
  EXPECT_FALSE(d.take());
}

// Datagrams may overtake a MemberJoined, or come after a number has passed to another member. Such a frame carries
// another generation than the member, and would show one person's hair on another.
TEST_F(Receiving, frames_of_an_earlier_or_later_member_of_the_same_number_are_counted_and_dropped) {
  send_frame(2, kOther, {.generation = 0});
  EXPECT_TRUE(received());
  send_frame(5, kOther, {.generation = 1});
  EXPECT_FALSE(received()) << "of the next member, which is not announced yet";
  d.send(wire::MemberLeft{kOther});
  d.send(wire::MemberJoined{kOther, 9, 1, hash_of(2), "", {}, 1});
  send_frame(4, kOther, {.generation = 0});
  EXPECT_FALSE(received()) << "of the member before";
  send_frame(6, kOther, {.generation = 1});
  EXPECT_TRUE(received());
  send_frame(7, kOther);
  EXPECT_TRUE(received()) << "on the channel nothing is overtaken";
  EXPECT_EQ(d.core.counters().frames_unknown, 2u);
  d.send(wire::CharacterAdded{kOwnCharacter, hash_of(1), LevelIndex::low, kOwnMember, 255});
  send_frame(8, kOwnMember, {.generation = 255});
  EXPECT_TRUE(received());
}

// A frame datagram is a shorter form of the same batch, with which the server saves bytes.
TEST_F(Receiving, frames_of_a_frame_datagram_are_those_of_a_packet) {
  const std::vector<std::uint8_t> content = content_at(5, kOther);
  wire::FrameBatch batch{5, 165 * kMs, {}};
  batch.frames.emplace_back().member = kOther;
  batch.frames.back().content = content;
  batch.generations = {0};
  d.core.on_packet(wire::encode_frame_datagram(d.now_ns, batch), d.now_ns);
  const std::optional<FrameBatch> got = d.event<FrameBatch>();
  ASSERT_TRUE(got);
  EXPECT_EQ(got->tick, 5u);
  EXPECT_EQ(got->sample_time_ns, 165 * kMs);
  ASSERT_EQ(got->frames.size(), 1u);
  EXPECT_EQ(got->frames[0].member, kOther);
  batch.generations = {1};
  batch.tick = 6;
  d.core.on_packet(wire::encode_frame_datagram(d.now_ns, batch), d.now_ns);
  EXPECT_FALSE(received()) << "of the next member, which is not announced yet";
  EXPECT_EQ(d.core.counters().frames_unknown, 1u);
}

TEST_F(Receiving, a_damaged_frame_datagram_ends_the_connection) {
  d.core.on_packet(std::vector<std::uint8_t>{'F', 'B', 0, 0}, d.now_ns);
  EXPECT_TRUE(d.core.wants_close());
}

// Datagrams and the channel have no common order, so frames may come before the client knows any member. This is no
// error of the server.
TEST(LinkFrames, of_a_datagram_that_overtakes_the_welcome_are_dropped) {
  LinkCoreDriver d;
  d.core.start();
  d.open();
  EXPECT_EQ(d.expect<wire::Hello>().datagram_layout, wire::kFrameDatagramLayout);
  const std::vector<std::uint8_t> content = content_at(1, kOther);
  wire::FrameBatch batch;
  batch.frames.emplace_back().member = kOther;
  batch.frames.back().content = content;
  batch.generations = {1};
  d.send(batch);
  d.core.on_packet(wire::encode_frame_datagram(d.now_ns, batch), d.now_ns);
  EXPECT_EQ(d.core.counters().frames_unknown, 2u);
  EXPECT_FALSE(d.core.wants_close());
  d.send(welcome_to(5));
  EXPECT_TRUE(d.core.active());
}

TEST_F(Receiving, hair_continues_from_its_last_lattice_on_a_new_server) {
  send_frame(10, kOwnMember);
  send_frame(11, kOwnMember);
  d.core.on_closed("the cable", d.now_ns);
  d.open();
  d.expect<wire::Hello>();
  d.send(welcome_to(6));
  const auto added = d.expect<wire::AddCharacter>();
  ASSERT_TRUE(added.state);
  expect_state(*added.state, 11);
  // The velocity of a node is that in the world, in the axes of the head, from the last two frames. Their sample times
  // are 33 ms apart (send_frame()).
  const auto world_at = [](std::uint64_t tick, std::size_t node) {
    std::vector<Vec3f> shown(kSmallBasisNodes);
    hairnet::displacements_of(small_basis().basis, coefficients_at(tick, kOwnMember), shown);
    const Vec3f rest = small_basis().geometry.lattice.node(static_cast<std::uint32_t>(node));
    return pose_at(tick, kOwnMember).head().point((rest + shown[node]).cast<double>());
  };
  ASSERT_EQ(added.state->velocities.size(), kSmallBasisCoordinates);
  for (std::size_t node = 0; node < kSmallBasisNodes; ++node) {
    const Vec3 velocity =
        pose_at(11, kOwnMember).head().rotation.conjugate() * (world_at(11, node) - world_at(10, node)) / 0.033;
    for (std::size_t c = 0; c < 3; ++c) {
      const double sent =
          static_cast<double>(added.state->velocities[3 * node + c] * wire::kVelocityStepsPer_s * added.state->step_m);
      // A velocity of the state has steps of 8 mm/s (kVelocityStepsPer_s * 0.25 mm). The rest of the 6 cm/s comes
      // from coefficients, which are rounded before the difference over 33 ms.
      EXPECT_NEAR(sent, velocity[static_cast<Eigen::Index>(c)], 0.06);
    }
  }
}

// Coefficients belong to their basis. With another basis they would be a wrong shape of the hair.
TEST_F(Receiving, hair_of_a_basis_that_has_changed_since_is_not_kept) {
  send_frame(10, kOwnMember);
  d.send(wire::GroomBasis{hash_of(1), hash_of(77)});
  d.core.on_closed("the cable", d.now_ns);
  d.open();
  d.expect<wire::Hello>();
  d.send(welcome_to(6));
  EXPECT_FALSE(d.expect<wire::AddCharacter>().state);
  tell_members();
  d.core.take_events();
  send_rigid_frame(3, kOwnMember);
  const std::optional<Frame> frame = received();
  ASSERT_TRUE(frame);
  EXPECT_FALSE(frame->last_known);
  EXPECT_FALSE(frame->basis);
}

// Counts what a load test would measure: frames, decoded ones, bytes and damage.
class CountingSink : public FrameSink {
 public:
  void on_frame(const ReceivedFrame& frame) override {
    ++frames;
    decoded += frame.decoded.pose != nullptr;
    bytes += frame.frame.content.size();
    undecodable += frame.decoded.outcome == Members::Outcome::undecodable;
  }
  std::size_t frames = 0, decoded = 0, bytes = 0, undecodable = 0;
};

TEST_F(Receiving, a_sink_takes_frames_in_place_of_events) {
  CountingSink sink;
  d.core.set_frame_sink(&sink);
  send_frame(10, kOther, {});
  send_frame(12, kOther, {.damaged = true});
  EXPECT_EQ(sink.frames, 2u);
  EXPECT_EQ(sink.decoded, 1u);
  EXPECT_EQ(sink.undecodable, 1u);
  EXPECT_GT(sink.bytes, 20u);
  EXPECT_TRUE(d.core.take_events().empty());
}

TEST(LinkCoreShare, only_a_share_of_the_members_is_decoded_and_all_are_counted) {
  LinkCoreOptions options;
  options.decode_share = 0.25;
  LinkCoreDriver d(options);
  d.connect();
  CountingSink sink;
  d.core.set_frame_sink(&sink);
  wire::FrameBatch batch;
  batch.tick = 10;
  std::vector<std::vector<std::uint8_t>> contents(1000);
  for (std::uint32_t member = 1; member <= 1000; ++member) {
    d.send(wire::MemberJoined{member, 9, member, hash_of(2)});
    contents[member - 1] = content_at(10, member);
    wire::Frame frame;
    frame.member = member;
    frame.level = LevelIndex::low;
    frame.content = contents[member - 1];
    batch.frames.push_back(frame);
  }
  d.send(batch);
  EXPECT_EQ(sink.frames, 1000u);
  // A hash of the number chooses the members, so a quarter of 1000 is met only about.
  EXPECT_NEAR(static_cast<double>(sink.decoded), 250, 25);
  EXPECT_EQ(sink.undecodable, 0u);
  EXPECT_EQ(d.core.counters().frames_received, 1000u);
}

// Adds a member kNew, whose basis the client does not have.
class ReceivingBasis : public Receiving {
 protected:
  static constexpr std::uint32_t kNew = 41;
  ReceivingBasis() {
    // With another unit, this basis has another hash than that of the members of the set-up.
    hair_.basis.unit[0] *= 2;
    file_ = basis_file(hair_), hash_ = wire::hash_groom(file_);
    d.send(wire::MemberJoined{kNew, 9, 2, hash_of(3)});
    d.core.take_events();
  }
  void announce() { d.send(wire::GroomBasis{hash_of(3), hash_}); }
  void send_file() { d.send(wire::GroomData{hash_, file_.size(), 0, file_}); }
  // Announces the basis, lets a frame ask for it, and sends it.
  void fetch() {
    announce();
    send_frame(10, kNew);
    d.take_all();
    d.events<FrameBatch>();
    send_file();
  }
  wire::HairBasis hair_ = small_basis();
  std::vector<std::uint8_t> file_;
  wire::GroomHash hash_{};
};

// Frames may come before the file of their basis. The head must move at once, with its hair at rest.
TEST_F(ReceivingBasis, hair_is_at_rest_until_it_is_here) {
  announce();
  send_frame(10, kNew);
  std::optional<Frame> frame = received();
  EXPECT_EQ(d.expect<wire::GroomRequest>().hash, hash_);
  ASSERT_TRUE(frame);
  EXPECT_FALSE(frame->basis);
  EXPECT_NEAR(frame->pose.head().position.y(), 1, 1e-3);
  send_file();
  send_frame(11, kNew);
  frame = received();
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->basis);
  expect_near(frame->coefficients, coefficients_at(11, kNew));
}

// A sleeping character sends no frames, so the client must keep its last one until the basis is there. Otherwise its
// hair would stay at rest until it wakes.
TEST_F(ReceivingBasis, shows_a_sleeping_character_of_which_no_other_frame_comes) {
  announce();
  send_frame(10, kNew, {.asleep = true});
  const std::optional<Frame> lacking = received();
  ASSERT_TRUE(lacking);
  EXPECT_FALSE(lacking->basis);
  EXPECT_FALSE(lacking->repeated);
  send_file();
  const std::optional<FrameBatch> again = d.event<FrameBatch>();
  ASSERT_TRUE(again);
  EXPECT_EQ(again->tick, 10u);
  EXPECT_EQ(again->sample_time_ns, 330 * kMs);
  ASSERT_EQ(again->frames.size(), 1u);
  EXPECT_TRUE(again->frames[0].repeated);
  EXPECT_TRUE(again->frames[0].asleep);
  EXPECT_EQ(again->frames[0].member, kNew);
  expect_near(again->frames[0].coefficients, coefficients_at(10, kNew));
  EXPECT_EQ(d.core.counters().frames_received, 2u);
}

TEST_F(ReceivingBasis, shows_only_the_newest_frame_again) {
  announce();
  send_frame(10, kNew, {.asleep = true});
  send_frame(11, kNew);
  d.take_all();
  d.events<FrameBatch>();
  send_file();
  EXPECT_THAT(d.events<FrameBatch>(), testing::IsEmpty());
}

TEST_F(ReceivingBasis, of_a_sleeping_character_is_asked_for_again) {
  announce();
  send_frame(10, kNew, {.asleep = true});
  EXPECT_EQ(d.expect<wire::GroomRequest>().hash, hash_);
  d.send(wire::Error{wire::ErrorReason::limit_exceeded, 0, hash_, "too many grooms are asked for at once"});
  // The client asks for a file again after GroomFiles::kAskAgain_ns, 2 s, and looks every kAskAgain_ns of
  // link_core.cpp, 1 s. Ten steps of 0.5 s leave time for it.
  bool asked = false;
  for (int i = 0; i < 10 && !asked; ++i) {
    d.pass(500 * kMs);
    // This message stands for a server that is alive.
    d.send(wire::RoomWind{});
    for (const wire::Message& message : d.take_all())
      asked = asked || std::holds_alternative<wire::GroomRequest>(message);
  }
  EXPECT_TRUE(asked);
}

TEST_F(ReceivingBasis, brings_the_skin_of_the_body) {
  EXPECT_EQ(d.core.skin_of(hash_of(3)), nullptr);
  fetch();
  const std::shared_ptr<const Skin> skin = d.core.skin_of(hash_of(3));
  ASSERT_NE(skin, nullptr);
  ASSERT_EQ(skin->size(), 1u);
  EXPECT_EQ(skin->front().bone, Bone::neck);
}

TEST_F(ReceivingBasis, of_a_basis_that_is_announced_again_need_no_second_copy) {
  fetch();
  announce();
  send_frame(11, kNew);
  EXPECT_THAT(d.take_all(), testing::IsEmpty());
  EXPECT_TRUE(received()->basis);
}

TEST_F(ReceivingBasis, ask_again_for_a_basis_that_was_refused_but_not_at_once) {
  announce();
  send_frame(10, kNew);
  d.take_all();
  d.send(wire::Error{wire::ErrorReason::limit_exceeded, 0, hash_, "too many grooms are asked for at once"});
  EXPECT_THAT(d.events<wire::Error>(), testing::IsEmpty());
  send_frame(11, kNew);
  EXPECT_THAT(d.take_all(), testing::IsEmpty());
  // A refused basis may be asked for again after GroomFiles::kAskAgain_ns, 2 s.
  d.pass(2500 * kMs);
  d.take_all();
  send_frame(12, kNew);
  EXPECT_EQ(d.expect<wire::GroomRequest>().hash, hash_);
}

TEST_F(ReceivingBasis, are_not_decoded_with_an_older_basis) {
  fetch();
  d.send(wire::GroomBasis{hash_of(3), hash_of(77)});
  send_frame(11, kNew);
  EXPECT_FALSE(received()->basis);
  EXPECT_EQ(d.expect<wire::GroomRequest>().hash, hash_of(77));
}

TEST_F(ReceivingBasis, whose_basis_cannot_be_used_leave_the_hair_at_rest_and_say_why_once) {
  // The client gets half of a basis file whose hash fits, so only decoding can find the damage.
  file_.resize(file_.size() / 2);
  hash_ = wire::hash_groom(file_);
  fetch();
  const std::vector<wire::Error> errors = d.events<wire::Error>();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].groom, hash_of(3));
  EXPECT_THAT(errors[0].detail, testing::HasSubstr("its basis cannot be used"));
  // This is longer than GroomFiles::kAskAgain_ns, 2 s, so a file that might be good would be asked for again.
  d.pass(5000 * kMs);
  d.take_all();
  send_frame(11, kNew);
  EXPECT_FALSE(received()->basis);
  EXPECT_THAT(d.take_all(), testing::IsEmpty());
}

TEST(FileCatalog, cores_that_need_the_same_file_share_one_copy) {
  KnownFiles<KnownBasis> catalog;
  EXPECT_FALSE(catalog.find(hash_of(1)));
  auto a = catalog.keep(hash_of(1), KnownBasis(small_basis()));
  EXPECT_EQ(catalog.keep(hash_of(1), KnownBasis(small_basis())), a);
  EXPECT_EQ(catalog.find(hash_of(1)), a);
  EXPECT_NE(catalog.keep(hash_of(2), KnownBasis(small_basis())), a);
  a.reset();
  EXPECT_FALSE(catalog.find(hash_of(1))) << "nobody needs it any more";
}

}  // namespace
}  // namespace hairnet::link
