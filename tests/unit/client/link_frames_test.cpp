#include <gmock/gmock.h>

#include <cmath>

#include "schema/wire/frame_datagram.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/unit/client/link_core_driver.hpp"
#include "tests/unit/client/small_basis.hpp"

namespace hairnet::link {
namespace {

constexpr std::uint32_t kOwnMember = 31, kOther = 40;
constexpr std::uint32_t kOwnCharacter = 7;

std::vector<std::uint8_t> basis_file(const wire::HairBasis& hair = small_basis()) {
  return wire::encode_basis(hair.geometry, hair.basis, hair.skin);
}
wire::GroomHash basis_hash() {
  return wire::hash_groom(basis_file());
}

// A character at a tick: smooth, and all of it changes.
Pose pose_at(std::uint64_t tick, std::uint32_t member) {
  const double t = 0.1 * static_cast<double>(tick) + member;
  return rigid_pose({Quat(Eigen::AngleAxisd(t, Vec3::UnitY())), Vec3(t, 1, 2)});
}
std::vector<float> coefficients_at(std::uint64_t tick, std::uint32_t member) {
  std::vector<float> c;
  for (int k = 0; k < 12; ++k)
    c.push_back(0.1f / static_cast<float>(k + 1) *
                std::sin(0.1f * static_cast<float>(tick + member) + static_cast<float>(k)));
  return c;
}
std::vector<std::uint8_t> content_at(std::uint64_t tick, std::uint32_t member, bool is_rigid = false,
                                     std::size_t count = 12) {
  const codec::CoefficientCode code(small_basis().basis.deviation_m);
  codec::EncodedFrame coded;
  const std::vector<float> c = is_rigid ? std::vector<float>() : coefficients_at(tick, member);
  codec::encode_frame(pose_at(tick, member), &code, c, 0, coded);
  const std::span<const std::uint8_t> content = coded.prefix(count);
  return {content.begin(), content.end()};
}
constexpr float kRounding = codec::kFinestStep_m / 2 + 1e-6f;

class Receiving : public ::testing::Test {
 protected:
  explicit Receiving(LinkCoreOptions options = {}) : d(std::move(options)) { settle(5); }
  void settle(std::uint64_t session) {
    d.connect(welcome_to(session));
    d.core.send(wire::AddCharacter{kOwnCharacter, hash_of(1), LevelIndex::low});
    tell_members();
    send_frame(1, kOther);  // asks for the basis
    send_basis();
    d.take_all();
    d.core.take_events();
  }
  void tell_members() {
    d.send(wire::CharacterAdded{kOwnCharacter, hash_of(1), LevelIndex::low, kOwnMember});
    d.send(wire::MemberJoined{kOther, 9, 1, hash_of(2)});
    for (const std::uint8_t groom : {std::uint8_t{1}, std::uint8_t{2}})
      d.send(wire::GroomBasis{hash_of(groom), basis_hash()});
  }
  void send_basis() { d.send(wire::GroomData{basis_hash(), basis_file().size(), 0, basis_file()}); }
  struct Coded {
    bool discontinuous = false, damaged = false, asleep = false;
    // Counts coefficients.
    std::size_t count = 12;
    std::optional<std::uint8_t> generation = std::nullopt;
  };
  void send_frame(std::uint64_t tick, std::uint32_t member) { send_frame(tick, member, Coded()); }
  void send_frame(std::uint64_t tick, std::uint32_t member, Coded coded) {
    std::vector<std::uint8_t> content = content_at(tick, member, false, coded.count);
    if (coded.damaged) content.resize(3);
    wire::FrameBatch batch;
    batch.tick = tick;
    batch.sample_time_ns = static_cast<std::int64_t>(tick) * 33 * kMs;
    wire::Frame frame;
    frame.member = member;
    frame.level = LevelIndex::low;
    frame.discontinuous = coded.discontinuous;
    frame.asleep = coded.asleep;
    frame.step_stride = 2;
    frame.content = content;
    batch.frames.push_back(frame);
    if (coded.generation) batch.generations.push_back(*coded.generation);
    d.send(batch);
  }
  // Sends the frame of a character whose groom is not ready, or which is at its coarsest level.
  void send_rigid_frame(std::uint64_t tick, std::uint32_t member) {
    wire::FrameBatch batch;
    batch.tick = tick;
    wire::Frame& frame = batch.frames.emplace_back();
    frame.member = member;
    frame.level = LevelIndex::rigid;
    const std::vector<std::uint8_t> content = content_at(tick, member, true);
    frame.content = content;
    d.send(batch);
  }
  std::optional<Frame> received() {
    std::optional<FrameBatch> batch = d.event<FrameBatch>();
    if (!batch) return std::nullopt;
    EXPECT_EQ(batch->frames.size(), 1u);
    return batch->frames.at(0);
  }
  static void expect_state(const wire::HairState& state, std::uint64_t tick) {
    std::vector<Vec3f> shown(27);
    hairnet::displacements_of(small_basis().basis, coefficients_at(tick, kOwnMember), shown);
    ASSERT_EQ(state.displacements.size(), 81u);
    for (std::size_t i = 0; i < 81; ++i)
      EXPECT_NEAR(static_cast<float>(state.displacements[i]) * state.step_m,
                  shown[i / 3][static_cast<Eigen::Index>(i % 3)], 1e-3f);
  }
  static void expect_near(const std::vector<float>& got, const std::vector<float>& wanted) {
    ASSERT_EQ(got.size(), wanted.size());
    for (std::size_t k = 0; k < got.size(); ++k) EXPECT_NEAR(got[k], wanted[k], kRounding);
  }
  LinkCoreDriver d;
};

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
    EXPECT_FLOAT_EQ(frame->step_s, 2.0f / 30);
    EXPECT_NEAR(frame->pose.head().position.x(), 0.1 * static_cast<double>(tick) + kOther, 1e-3);
    ASSERT_TRUE(frame->basis);
    std::vector<Vec3f> shown, wanted(27);
    displacements_of(*frame, shown);
    hairnet::displacements_of(small_basis().basis, coefficients_at(tick, kOther), wanted);
    ASSERT_EQ(shown.size(), wanted.size());
    for (std::size_t n = 0; n < shown.size(); ++n) EXPECT_LT((shown[n] - wanted[n]).norm(), 2e-3f);
  }
  EXPECT_EQ(d.core.counters().frames_undecodable, 0u);
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

// As datagrams may overtake MemberJoined, or come after it.
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
  // The velocity of a node in the world, in the axes of the head, over the last step.
  const auto world_at = [](std::uint64_t tick, std::size_t node) {
    std::vector<Vec3f> shown(27);
    hairnet::displacements_of(small_basis().basis, coefficients_at(tick, kOwnMember), shown);
    const Vec3f rest = small_basis().geometry.lattice.node(static_cast<std::uint32_t>(node));
    return pose_at(tick, kOwnMember).head().point((rest + shown[node]).cast<double>());
  };
  ASSERT_EQ(added.state->velocities.size(), 81u);
  for (std::size_t node = 0; node < 27; ++node) {
    const Vec3 velocity =
        pose_at(11, kOwnMember).head().rotation.conjugate() * (world_at(11, node) - world_at(10, node)) / 0.033;
    for (std::size_t c = 0; c < 3; ++c) {
      const double sent =
          static_cast<double>(added.state->velocities[3 * node + c] * wire::kVelocityStepsPer_s * added.state->step_m);
      EXPECT_NEAR(sent, velocity[static_cast<Eigen::Index>(c)], 0.06);
    }
  }
}

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

// Hair that swung when its server was lost; another server has the character, and no lattice of it yet.
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
  EXPECT_FALSE(d.expect<wire::AddCharacter>().state);
}

TEST_F(Restarted, a_shape_that_was_not_gone_on_from_is_brought_to_the_next_server) {
  send_rigid_frame(5, kOwnMember);
  come_to_next_server();
  const auto added = d.expect<wire::AddCharacter>();
  ASSERT_TRUE(added.state);
  expect_state(*added.state, 10);
}

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
  EXPECT_NEAR(static_cast<double>(sink.decoded), 250, 25);
  EXPECT_EQ(sink.undecodable, 0u);
  EXPECT_EQ(d.core.counters().frames_received, 1000u);
}

// The basis of its member is not here yet.
class ReceivingBasis : public Receiving {
 protected:
  static constexpr std::uint32_t kNew = 41;
  ReceivingBasis() {
    hair_.basis.unit[0] *= 2;  // not the basis of the other members
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
  bool asked = false;
  for (int i = 0; i < 10 && !asked; ++i) {
    d.pass(500 * kMs);
    d.send(wire::RoomWind{});  // the server is still there
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
  file_.resize(file_.size() / 2);
  hash_ = wire::hash_groom(file_);
  fetch();
  const std::vector<wire::Error> errors = d.events<wire::Error>();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].groom, hash_of(3));
  EXPECT_THAT(errors[0].detail, testing::HasSubstr("its basis cannot be used"));
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
