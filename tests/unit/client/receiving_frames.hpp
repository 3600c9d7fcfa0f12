#pragma once

#include <gmock/gmock.h>

#include <cmath>

#include "schema/wire/groom_file.hpp"
#include "tests/unit/client/link_core_driver.hpp"
#include "tests/unit/client/small_basis.hpp"

namespace hairnet::link {

// Members are numbers that the server gives to all characters of a room; a character's number is its client's own.
constexpr std::uint32_t kOwnMember = 31, kOther = 40;
constexpr std::uint32_t kOwnCharacter = 7;

inline std::vector<std::uint8_t> basis_file(const wire::HairBasis& hair = small_basis()) {
  return wire::encode_basis(hair.geometry, hair.basis, hair.skin);
}
inline wire::GroomHash basis_hash() {
  return wire::hash_groom(basis_file());
}

// Return the pose and the coefficients of a member at a tick. The turn, x and every coefficient change from tick to
// tick, so that a frame cannot be taken for its neighbour.
inline Pose pose_at(std::uint64_t tick, std::uint32_t member) {
  const double t = 0.1 * static_cast<double>(tick) + member;
  return rigid_pose({Quat(Eigen::AngleAxisd(t, Vec3::UnitY())), Vec3(t, 1, 2)});
}
inline std::vector<float> coefficients_at(std::uint64_t tick, std::uint32_t member) {
  std::vector<float> c;
  for (int k = 0; k < 12; ++k)
    c.push_back(0.1f / static_cast<float>(k + 1) *
                std::sin(0.1f * static_cast<float>(tick + member) + static_cast<float>(k)));
  return c;
}
// Returns the encoded content of a frame: the pose, and the first `count` coefficients. Without the others the frame
// is valid but coarser.
inline std::vector<std::uint8_t> content_at(std::uint64_t tick, std::uint32_t member, bool is_rigid = false,
                                            std::size_t count = 12) {
  const codec::CoefficientCode code(small_basis().basis.deviation_m);
  codec::EncodedFrame coded;
  const std::vector<float> c = is_rigid ? std::vector<float>() : coefficients_at(tick, member);
  codec::encode_frame(pose_at(tick, member), &code, c, 0, coded);
  const std::span<const std::uint8_t> content = coded.prefix(count);
  return {content.begin(), content.end()};
}
// A decoded coefficient differs from the sent one by at most half of the finest quantization step.
constexpr float kRounding = codec::kFinestStep_m / 2 + 1e-6f;

// Starts every test with a client in session 5 that has an own character (hairstyle 1) and sees one other member
// (hairstyle 2). Both hairstyles have the same basis, which has been downloaded, and all events are taken.
class Receiving : public ::testing::Test {
 protected:
  explicit Receiving(LinkCoreOptions options = {}) : d(std::move(options)) { settle(5); }
  void settle(std::uint64_t session) {
    d.connect(welcome_to(session));
    d.core.send(wire::AddCharacter{kOwnCharacter, hash_of(1), LevelIndex::low});
    tell_members();
    // The first frame of a member makes the client ask for its basis.
    send_frame(1, kOther);
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
  // What differs from a plain frame. `damaged` content has 3 bytes, too few for a pose.
  struct Coded {
    bool discontinuous = false, damaged = false, asleep = false;
    // The number of coefficients in the frame; small_basis() has 12.
    std::size_t count = 12;
    // Set for a frame that comes as by datagram, where the generation tells apart members that have had the same
    // number.
    std::optional<std::uint8_t> generation = std::nullopt;
  };
  void send_frame(std::uint64_t tick, std::uint32_t member) { send_frame(tick, member, Coded()); }
  void send_frame(std::uint64_t tick, std::uint32_t member, Coded coded) {
    std::vector<std::uint8_t> content = content_at(tick, member, false, coded.count);
    if (coded.damaged) content.resize(3);
    wire::FrameBatch batch;
    batch.tick = tick;
    // Frames of neighbouring ticks are 33 ms apart, about a tick at 30 Hz.
    batch.sample_time_ns = static_cast<std::int64_t>(tick) * 33 * kMs;
    wire::Frame frame;
    frame.member = member;
    frame.level = LevelIndex::low;
    frame.discontinuous = coded.discontinuous;
    frame.asleep = coded.asleep;
    // The character is simulated in every second tick.
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
  // Returns the only frame of the next batch that the client has decoded, if there is one. All other events are
  // dropped.
  std::optional<Frame> received() {
    std::optional<FrameBatch> batch = d.event<FrameBatch>();
    if (!batch) return std::nullopt;
    EXPECT_EQ(batch->frames.size(), 1u);
    return batch->frames.at(0);
  }
  // Expects the displacement of all nodes at a tick, within 1 mm. The state is rounded to 0.25 mm, on top of the
  // rounding of coefficients.
  static void expect_state(const wire::HairState& state, std::uint64_t tick) {
    std::vector<Vec3f> shown(kSmallBasisNodes);
    hairnet::displacements_of(small_basis().basis, coefficients_at(tick, kOwnMember), shown);
    ASSERT_EQ(state.displacements.size(), kSmallBasisCoordinates);
    for (std::size_t i = 0; i < kSmallBasisCoordinates; ++i)
      EXPECT_NEAR(static_cast<float>(state.displacements[i]) * state.step_m,
                  shown[i / 3][static_cast<Eigen::Index>(i % 3)], 1e-3f);
  }
  static void expect_near(const std::vector<float>& got, const std::vector<float>& wanted) {
    ASSERT_EQ(got.size(), wanted.size());
    for (std::size_t k = 0; k < got.size(); ++k) EXPECT_NEAR(got[k], wanted[k], kRounding);
  }
  LinkCoreDriver d;
};

}  // namespace hairnet::link
