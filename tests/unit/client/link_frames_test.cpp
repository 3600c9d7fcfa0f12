#include <gmock/gmock.h>

#include <cmath>

#include "schema/wire/groom_file.hpp"
#include "tests/unit/client/link_core_driver.hpp"

namespace hairnet::link {
namespace {

constexpr std::uint32_t kOwnMember = 31, kOther = 40;
constexpr std::uint32_t kOwnCharacter = 7;

LevelGeometry small_grid() {
  LevelGeometry geometry;
  geometry.lattice.dims = {3, 3, 3};
  for (std::uint32_t node = 0; node < 27; ++node) geometry.active_nodes.push_back(node);
  geometry.trimmed_begin = {0};
  return geometry;
}

// A character's frame at a tick: smooth, and every integer of it changes.
codec::FrameIntegers moving(std::uint64_t tick, std::uint32_t member, bool velocities = false) {
  codec::FrameIntegers integers;
  const double t = 0.1 * static_cast<double>(tick) + member;
  codec::quantise_pose(rigid_pose({Quat(Eigen::AngleAxisd(t, Vec3::UnitY())), Vec3(t, 1, 2)}), nullptr, integers);
  for (int i = 0; i < 81; ++i) {
    integers.nodes.push_back(static_cast<std::int16_t>(std::lround(100 * std::sin(t + i))));
    if (velocities) integers.velocities.push_back(static_cast<std::int16_t>(std::lround(9 * std::cos(t + i))));
  }
  return integers;
}

class Receiving : public ::testing::Test {
 protected:
  explicit Receiving(LinkCoreOptions options = {}) : d(std::move(options)) { settle(5); }
  void settle(std::uint64_t session) {
    d.connect(welcome_to(session));
    d.core.send(wire::AddCharacter{kOwnCharacter, hash_of(1), LevelIndex::low});
    tell_members();
    d.take_all();
    d.core.take_events();
  }
  void tell_members() {
    d.send(wire::CharacterAdded{kOwnCharacter, hash_of(1), LevelIndex::low, kOwnMember});
    d.send(wire::MemberJoined{kOther, 9, 1, hash_of(2)});
    for (const std::uint8_t groom : {std::uint8_t{1}, std::uint8_t{2}})
      d.send(wire::LevelRecord{hash_of(groom), LevelIndex::low, small_grid()});
  }
  struct Coded {
    int order = 0;
    int stride = 1;
    bool discontinuous = false, velocities = false;
    bool damaged = false;
  };
  void send_frame(std::uint64_t tick, std::uint32_t member, Coded coded) {
    std::vector<codec::FrameIntegers> past;
    std::vector<const codec::FrameIntegers*> history;
    for (int k = 1; k <= coded.order; ++k)
      past.push_back(moving(tick - static_cast<std::uint64_t>(k * coded.stride), member, coded.velocities));
    for (const codec::FrameIntegers& p : past) history.push_back(&p);
    const codec::Neighbours neighbours(small_grid());
    std::vector<std::uint8_t> content;
    codec::encode_frame(moving(tick, member, coded.velocities), history, &neighbours, content);
    if (coded.damaged) content.resize(content.size() / 2);
    wire::FrameBatch batch;
    batch.tick = tick;
    batch.sample_time_ns = static_cast<std::int64_t>(tick) * 33 * kMs;
    wire::Frame frame;
    frame.member = member;
    frame.level = LevelIndex::low;
    frame.discontinuous = coded.discontinuous;
    frame.velocities = coded.velocities;
    frame.order = static_cast<std::uint8_t>(coded.order);
    frame.stride = static_cast<std::uint8_t>(coded.stride);
    frame.step_stride = 2;
    frame.content = content;
    batch.frames.push_back(frame);
    d.send(batch);
  }
  // Sends the frame of a character whose groom is not ready, or which is at its coarsest level.
  void send_rigid_frame(std::uint64_t tick, std::uint32_t member) {
    codec::FrameIntegers integers = moving(tick, member);
    integers.nodes.clear();
    wire::FrameBatch batch;
    batch.tick = tick;
    wire::Frame& frame = batch.frames.emplace_back();
    frame.member = member;
    frame.level = LevelIndex::rigid;
    std::vector<std::uint8_t> content;
    codec::encode_frame(integers, {}, nullptr, content);
    frame.content = content;
    d.send(batch);
  }
  std::optional<Frame> received() {
    std::optional<FrameBatch> batch = d.event<FrameBatch>();
    if (!batch) return std::nullopt;
    EXPECT_EQ(batch->frames.size(), 1u);
    return batch->frames.at(0);
  }
  LinkCoreDriver d;
};

TEST_F(Receiving, frames_decode_to_the_same_for_any_references) {
  for (const int stride : {1, 2, 4}) {
    const std::uint64_t first = static_cast<std::uint64_t>(1000 * stride);
    for (int i = 0; i < 6; ++i) {
      const std::uint64_t tick = first + static_cast<std::uint64_t>(i * stride);
      send_frame(tick, kOther, {std::min(i, 3), stride});
      const std::optional<Frame> frame = received();
      ASSERT_TRUE(frame);
      EXPECT_EQ(frame->member, kOther);
      EXPECT_EQ(frame->character, 0u);
      EXPECT_EQ(frame->level, LevelIndex::low);
      EXPECT_EQ(frame->displacements, moving(tick, kOther).nodes);
      EXPECT_TRUE(frame->velocities.empty());
      EXPECT_FLOAT_EQ(frame->step_s, 2.0f / 30);
      EXPECT_NEAR(frame->pose.head().position.x(), 0.1 * static_cast<double>(tick) + kOther, 1e-4);
      ASSERT_TRUE(frame->geometry);
      EXPECT_EQ(frame->geometry->active_nodes.size(), 27u);
    }
  }
  EXPECT_EQ(d.core.counters().frames_undecodable, 0u);
  EXPECT_EQ(d.core.counters().frames_received, 18u);
}

TEST_F(Receiving, own_frames_carry_the_own_number) {
  send_frame(10, kOwnMember, {});
  const std::optional<Frame> frame = received();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->character, kOwnCharacter);
  EXPECT_EQ(frame->member, kOwnMember);
}

TEST_F(Receiving, velocities_come_along) {
  send_frame(10, kOther, {0, 1, false, true});
  send_frame(11, kOther, {1, 1, false, true});
  const std::vector<FrameBatch> batches = d.events<FrameBatch>();
  ASSERT_EQ(batches.size(), 2u);
  EXPECT_EQ(batches[1].frames[0].velocities, moving(11, kOther, true).velocities);
}

TEST_F(Receiving, a_frame_that_refers_to_one_that_never_came_is_counted_and_a_keyframe_asked_for_once) {
  send_frame(10, kOther, {});
  send_frame(12, kOther, {1, 1});  // 11 is missing
  EXPECT_EQ(d.core.counters().frames_undecodable, 1u);
  EXPECT_THAT(d.expect<wire::RequestKeyframes>().members, ::testing::ElementsAre(kOther));
  send_frame(13, kOther, {1, 1});
  EXPECT_FALSE(d.take());
  d.pass(500 * kMs);
  send_frame(14, kOther, {1, 1});  // the answer must have been lost
  d.expect<wire::RequestKeyframes>();
  EXPECT_EQ(d.events<FrameBatch>().size(), 1u);
  send_frame(15, kOther, {});
  send_frame(16, kOther, {1, 1});
  EXPECT_EQ(d.events<FrameBatch>().size(), 2u);
  EXPECT_EQ(d.core.counters().frames_undecodable, 3u);
  send_frame(18, kOther, {1, 1});
  d.expect<wire::RequestKeyframes>();  // another fault, another request
  EXPECT_TRUE(d.core.active());
}

TEST_F(Receiving, the_stride_must_be_that_of_the_frames_before) {
  for (const std::uint64_t tick : {10u, 12u, 14u}) send_frame(tick, kOther, {});
  send_frame(15, kOther, {1, 1});
  send_frame(16, kOther, {2, 2});  // 14 and 12
  EXPECT_EQ(d.core.counters().frames_undecodable, 1u);
  EXPECT_EQ(d.events<FrameBatch>().size(), 4u);
}

TEST_F(Receiving, damaged_content_is_no_reason_to_leave) {
  send_frame(10, kOther, {0, 1, false, false, true});
  EXPECT_EQ(d.core.counters().frames_undecodable, 1u);
  EXPECT_TRUE(d.core.active());
  d.expect<wire::RequestKeyframes>();
}

TEST_F(Receiving, a_jump_that_could_not_be_decoded_parts_the_frames_around_it) {
  send_frame(10, kOther, {});
  send_frame(11, kOther, {0, 1, true, false, true});
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

TEST_F(Receiving, a_level_without_its_record_cannot_be_decoded) {
  d.send(wire::MemberJoined{41, 9, 2, hash_of(3)});
  send_frame(10, 41, {});
  EXPECT_EQ(d.core.counters().frames_undecodable, 1u);
  d.send(wire::LevelRecord{hash_of(3), LevelIndex::low, small_grid()});
  send_frame(11, 41, {});
  EXPECT_EQ(d.core.counters().frames_undecodable, 1u);
}

TEST_F(Receiving, after_a_resume_the_first_frame_must_stand_alone) {
  send_frame(10, kOther, {});
  d.core.on_closed("the cable", d.now_ns);
  d.open();
  d.expect<wire::Hello>();
  d.send(welcome_to(5, true));
  tell_members();
  d.core.take_events();
  send_frame(11, kOther, {1, 1});
  EXPECT_EQ(d.core.counters().frames_undecodable, 1u);
  send_frame(12, kOther, {});
  EXPECT_EQ(d.events<FrameBatch>().size(), 1u);
}

TEST_F(Receiving, hair_continues_from_its_last_lattice_on_a_new_server) {
  send_frame(10, kOwnMember, {0, 1, false, true});
  send_frame(11, kOwnMember, {1, 1, false, true});
  d.core.on_closed("the cable", d.now_ns);
  d.open();
  d.expect<wire::Hello>();
  d.send(welcome_to(6));
  const auto added = d.expect<wire::AddCharacter>();
  ASSERT_TRUE(added.state);
  EXPECT_EQ(added.state->level, LevelIndex::low);
  EXPECT_FLOAT_EQ(added.state->step_m, 0.5e-3f);
  EXPECT_EQ(added.state->displacements, moving(11, kOwnMember).nodes);
  EXPECT_EQ(added.state->velocities, moving(11, kOwnMember, true).velocities);
}

TEST_F(Receiving, hair_of_a_level_whose_geometry_has_changed_since_is_not_kept) {
  send_frame(10, kOwnMember, {});
  LevelGeometry larger = small_grid();
  larger.lattice.dims = {3, 3, 4};
  for (std::uint32_t node = 27; node < 36; ++node) larger.active_nodes.push_back(node);
  d.send(wire::LevelRecord{hash_of(1), LevelIndex::low, larger});
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
  EXPECT_TRUE(frame->displacements.empty());
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
  bool keeps_hair(std::uint64_t tick) {
    send_rigid_frame(tick, kOwnMember);
    const std::optional<Frame> frame = received();
    EXPECT_TRUE(frame);
    if (!frame) return false;
    EXPECT_EQ(frame->last_known, frame->level != LevelIndex::rigid);
    EXPECT_EQ(frame->last_known, !frame->displacements.empty());
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
  EXPECT_EQ(frame->level, LevelIndex::low);
  EXPECT_EQ(frame->displacements, moving(10, kOwnMember).nodes);
  ASSERT_TRUE(frame->geometry);
  EXPECT_EQ(frame->geometry->active_nodes, small_grid().active_nodes);
  const Pose expected = codec::dequantise_pose(moving(3, kOwnMember));
  EXPECT_EQ(frame->pose.head().position, expected.head().position);

  send_frame(4, kOwnMember, {});
  const std::optional<Frame> stepped = received();
  ASSERT_TRUE(stepped);
  EXPECT_FALSE(stepped->last_known);
  EXPECT_EQ(stepped->displacements, moving(4, kOwnMember).nodes);
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
  EXPECT_TRUE(keeps_hair(4));
  d.pass(1'000 * kMs);
  EXPECT_FALSE(keeps_hair(5));
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
  d.core.on_closed("the cable", d.now_ns);
  d.open();
  d.expect<wire::Hello>();
  d.send(welcome_to(7));
  EXPECT_FALSE(d.expect<wire::AddCharacter>().state);
}

TEST_F(Restarted, a_shape_that_was_not_gone_on_from_is_brought_to_the_next_server) {
  send_rigid_frame(5, kOwnMember);
  d.core.on_closed("the cable", d.now_ns);
  d.open();
  d.expect<wire::Hello>();
  d.send(welcome_to(7));
  const auto added = d.expect<wire::AddCharacter>();
  ASSERT_TRUE(added.state);
  EXPECT_EQ(added.state->displacements, moving(10, kOwnMember).nodes);
}

TEST_F(Resumed, a_server_that_still_has_the_session_is_believed_at_once) {
  EXPECT_FALSE(keeps_hair(12));
}

TEST_F(Resumed, hair_that_swung_on_leaves_no_shape_to_bring) {
  send_frame(11, kOwnMember, {});
  send_rigid_frame(12, kOwnMember);
  d.core.on_closed("the cable", d.now_ns);
  d.open();
  d.expect<wire::Hello>();
  d.send(welcome_to(7));
  EXPECT_FALSE(d.expect<wire::AddCharacter>().state);
}

class CountingSink : public FrameSink {
 public:
  void on_frame(const ReceivedFrame& frame) override {
    ++frames;
    decoded += frame.decoded.integers != nullptr;
    bytes += frame.frame.content.size();
    undecodable += frame.decoded.outcome == Members::Outcome::undecodable;
    if (!frame.decoded.integers) return;
    EXPECT_EQ(frame.decoded.integers->nodes, moving(frame.tick, frame.frame.member).nodes);
  }
  std::size_t frames = 0, decoded = 0, bytes = 0, undecodable = 0;
};

TEST_F(Receiving, a_sink_takes_frames_in_place_of_events) {
  CountingSink sink;
  d.core.set_frame_sink(&sink);
  send_frame(10, kOther, {});
  send_frame(12, kOther, {1, 1});
  EXPECT_EQ(sink.frames, 2u);
  EXPECT_EQ(sink.decoded, 1u);
  EXPECT_EQ(sink.undecodable, 1u);
  EXPECT_GT(sink.bytes, 50u);
  EXPECT_TRUE(d.core.take_events().empty());
}

TEST(LinkCoreShare, only_a_share_of_the_members_is_decoded_and_all_are_counted) {
  LinkCoreOptions options;
  options.decode_share = 0.25;
  LinkCoreDriver d(options);
  d.connect();
  CountingSink sink;
  d.core.set_frame_sink(&sink);
  const codec::Neighbours neighbours(small_grid());
  d.send(wire::LevelRecord{hash_of(2), LevelIndex::low, small_grid()});
  wire::FrameBatch batch;
  batch.tick = 10;
  std::vector<std::vector<std::uint8_t>> contents(1000);
  for (std::uint32_t member = 1; member <= 1000; ++member) {
    d.send(wire::MemberJoined{member, 9, member, hash_of(2)});
    codec::encode_frame(moving(10, member), {}, &neighbours, contents[member - 1]);
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

// A basis of 12 modes over the small grid.
wire::HairBasis small_basis() {
  wire::HairBasis hair;
  hair.geometry = small_grid();
  hair.basis.node_count = 27;
  for (int mode = 0; mode < 12; ++mode) {
    hair.basis.deviation_m.push_back(0.1f / static_cast<float>(1 + mode));
    hair.basis.unit.push_back(1e-3f);
    for (int i = 0; i < 81; ++i)
      hair.basis.modes.push_back(static_cast<std::int16_t>(std::lround(1000 * std::sin(0.1 * (mode + 1) * i))));
  }
  return hair;
}

class ReceivingCoefficients : public Receiving {
 protected:
  ReceivingCoefficients() { file_ = wire::encode_basis(hair_.geometry, hair_.basis), hash_ = wire::hash_groom(file_); }
  void announce() { d.send(wire::GroomBasis{hash_of(2), hash_}); }
  void send_basis(std::size_t offset = 0) {
    d.send(wire::GroomData{
        hash_, file_.size(), offset, {file_.begin() + static_cast<std::ptrdiff_t>(offset), file_.end()}});
  }
  // Announces the basis, lets a frame ask for it, and sends it.
  void fetch() {
    announce();
    send_coefficients(10, c_);
    d.take_all();
    d.events<FrameBatch>();
    send_basis();
  }
  void send_coefficients(std::uint64_t tick, const std::vector<float>& c, std::size_t count = 12) {
    const codec::CoefficientCode code(hair_.basis.deviation_m);
    codec::EncodedFrame coded;
    codec::encode_frame(rigid_pose({Quat::Identity(), Vec3(1, 2, 3)}), &code, c, 1, coded);
    const std::span<const std::uint8_t> content = coded.prefix(count);
    wire::FrameBatch batch;
    batch.tick = tick;
    batch.frames.resize(1);
    batch.frames[0].member = kOther;
    batch.frames[0].level = LevelIndex::low;
    batch.frames[0].coefficients = true;
    batch.frames[0].content = content;
    d.send(batch);
  }
  Frame only_frame() {
    const std::vector<FrameBatch> batches = d.events<FrameBatch>();
    EXPECT_EQ(batches.size(), 1u);
    return batches.empty() || batches[0].frames.empty() ? Frame{} : batches[0].frames[0];
  }
  const wire::HairBasis hair_ = small_basis();
  const std::vector<float> c_ = {0.1f, -0.05f, 0.02f, 0, 0, 0.01f, 0, 0, 0, 0, 0, 0.003f};
  std::vector<std::uint8_t> file_;
  wire::GroomHash hash_{};
};

TEST_F(ReceivingCoefficients, move_the_nodes_of_the_basis_once_it_is_here) {
  announce();
  send_coefficients(10, c_);
  Frame frame = only_frame();  // until then hair is at rest
  EXPECT_EQ(d.expect<wire::GroomRequest>().hash, hash_);
  EXPECT_EQ(frame.level, LevelIndex::rigid);
  EXPECT_NEAR(frame.pose.head().position.y(), 2, 1e-4);
  send_basis();
  send_coefficients(11, c_);
  frame = only_frame();
  EXPECT_EQ(frame.level, LevelIndex::high);
  ASSERT_TRUE(frame.geometry);
  std::vector<Vec3f> expected(27), got;
  displacements_of(hair_.basis, c_, expected);
  codec::dequantise_nodes(frame.displacements, frame.error_class, got);
  ASSERT_EQ(got.size(), expected.size());
  for (std::size_t n = 0; n < got.size(); ++n) EXPECT_LT((got[n] - expected[n]).norm(), 2e-3f);
}

TEST_F(ReceivingCoefficients, that_were_cut_off_are_a_coarser_hair) {
  fetch();
  send_coefficients(11, c_, 3);
  EXPECT_EQ(only_frame().level, LevelIndex::high);
}

TEST_F(ReceivingCoefficients, of_a_basis_that_is_announced_again_need_no_second_copy) {
  fetch();
  announce();
  send_coefficients(11, c_);
  EXPECT_THAT(d.take_all(), testing::IsEmpty());
  EXPECT_EQ(only_frame().level, LevelIndex::high);
}

TEST_F(ReceivingCoefficients, ask_again_for_a_basis_that_was_refused_but_not_at_once) {
  announce();
  send_coefficients(10, c_);
  d.take_all();
  d.send(wire::Error{wire::ErrorReason::limit_exceeded, 0, hash_, "too many grooms are asked for at once"});
  EXPECT_THAT(d.events<wire::Error>(), testing::IsEmpty());
  send_coefficients(11, c_);
  EXPECT_THAT(d.take_all(), testing::IsEmpty());
  d.pass(2500 * kMs);
  d.take_all();
  send_coefficients(12, c_);
  EXPECT_EQ(d.expect<wire::GroomRequest>().hash, hash_);
}

TEST_F(ReceivingCoefficients, are_not_decoded_with_an_older_basis) {
  fetch();
  d.send(wire::GroomBasis{hash_of(2), hash_of(77)});
  send_coefficients(11, c_);
  EXPECT_EQ(only_frame().level, LevelIndex::rigid);
  EXPECT_EQ(d.expect<wire::GroomRequest>().hash, hash_of(77));
}

TEST_F(ReceivingCoefficients, whose_basis_cannot_be_used_leave_the_hair_at_rest_and_say_why_once) {
  file_[file_.size() / 2] ^= 0x55;
  hash_ = wire::hash_groom(file_);
  fetch();
  const std::vector<wire::Error> errors = d.events<wire::Error>();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].groom, hash_of(2));
  EXPECT_THAT(errors[0].detail, testing::HasSubstr("its basis cannot be used"));
  d.pass(5000 * kMs);
  d.take_all();
  send_coefficients(11, c_);
  EXPECT_EQ(only_frame().level, LevelIndex::rigid);
  EXPECT_THAT(d.take_all(), testing::IsEmpty());
}

TEST(LevelCatalog, cores_that_receive_the_same_record_share_one_copy) {
  LevelCatalog catalog;
  const auto a = catalog.keep({hash_of(1), LevelIndex::low, small_grid()});
  const auto b = catalog.keep({hash_of(1), LevelIndex::low, small_grid()});
  EXPECT_EQ(a, b);
  LevelGeometry other = small_grid();
  other.lattice.spacing *= 2;
  EXPECT_NE(catalog.keep({hash_of(1), LevelIndex::low, other}), a);
}

}  // namespace
}  // namespace hairnet::link
