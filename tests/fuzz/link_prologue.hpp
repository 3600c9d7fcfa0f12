#pragma once

#include <memory>
#include <vector>

#include "schema/codec/frame.hpp"
#include "schema/wire/basis_file.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/learnt_file.hpp"
#include "schema/wire/messages.hpp"
#include "tests/support/learnt.hpp"

// A valid beginning of a conversation, as a server sends it to a client in the fuzzers link_core and write_seeds.
// Random bytes alone hardly ever make a valid welcome, so without it a fuzzer would never reach the code for frames.
// The prologue is a welcome, one own character and one other member with the same groom, and a frame. The frame makes
// the client ask for the groom's basis, and a frame of level `learnt` makes it ask for the learnt hair; both files
// follow.
namespace hairnet::fuzz {

// The numbers are arbitrary but differ, so that a mix-up of a member (the server's number) with a character (the
// client's) is seen.
inline constexpr std::uint32_t kOwnMember = 1, kOtherMember = 2, kOwnCharacter = 5;
inline constexpr std::uint64_t kFirstTick = 100;

// The hash of the groom of both characters. It is made up: nothing in this conversation checks a groom's bytes against
// it.
inline wire::GroomHash link_groom() {
  return {1};
}

// The smallest useful basis: a lattice of 2 x 2 x 2 nodes, all of them active, with 6 modes. 24 is the number of
// coordinates of the 8 nodes.
inline wire::HairBasis link_basis() {
  wire::HairBasis hair;
  hair.geometry.lattice.dims = {2, 2, 2};
  for (std::uint32_t node = 0; node < 8; ++node) hair.geometry.active_nodes.push_back(node);
  hair.geometry.trimmed_begin = {0};
  hair.basis.node_count = 8;
  // Six modes of falling deviation. The modes' numbers from -200 to 200 only have to differ from each other.
  for (int k = 0; k < 6; ++k) {
    hair.basis.deviation_m.push_back(0.1f / static_cast<float>(1 + k));
    hair.basis.unit.push_back(1e-3f);
    for (int i = 0; i < 24; ++i) hair.basis.modes.push_back(static_cast<std::int16_t>(37 * (i + k) % 401 - 200));
  }
  return hair;
}

// The file of a small learnt hair with random weights: seed 9, 4 hidden units and 4 modes, where the basis has 6.
inline std::vector<std::uint8_t> link_learnt() {
  return wire::encode_learnt(support::random_learnt_hair(9, 4, 4));
}

// The frames of a tick, one for each of both members.
inline wire::Message link_frames(std::uint64_t tick) {
  const codec::CoefficientCode code(link_basis().basis.deviation_m);
  // One coefficient for each mode of link_basis(), m. The last one changes from tick to tick.
  const std::vector<float> coefficients{0.1f, -0.03f, 0.02f, 0, 0.01f, 0.001f * static_cast<float>(tick % 10)};
  codec::EncodedFrame coded;
  // The head stands 1.6 m high. The 1 is the step of the errors: twice the finest one.
  codec::encode_frame(rigid_pose({Quat::Identity(), {0, 1.6, 0}}), &code, coefficients, 1, coded);
  // Frames are views into the batch's storage, which the message carries along.
  auto storage = std::make_shared<std::vector<std::uint8_t>>(coded.bytes);
  wire::FrameBatch batch;
  batch.tick = tick;
  for (const std::uint32_t member : {kOwnMember, kOtherMember}) {
    wire::Frame& frame = batch.frames.emplace_back();
    frame.member = member;
    frame.level = LevelIndex::low;
    frame.content = *storage;
  }
  batch.storage = std::move(storage);
  return batch;
}

// The same frames on the learnt level. `evaluated`: the client computes the hair itself, by its learnt hair.
inline wire::Message link_learnt_frames(std::uint64_t tick, bool evaluated) {
  wire::Message message = link_frames(tick);
  for (wire::Frame& frame : std::get<wire::FrameBatch>(message).frames) {
    frame.level = LevelIndex::learnt;
    frame.evaluated = evaluated;
  }
  return message;
}

// The whole prologue, in the order in which a server sends it. `session` is the number of the session; `resumed` says
// that the welcome is that of a session that goes on after a broken connection.
inline std::vector<wire::Message> link_prologue(std::uint64_t session, bool resumed) {
  wire::Welcome welcome;
  welcome.session = session;
  welcome.resumed = resumed;
  const wire::HairBasis hair = link_basis();
  const std::vector<std::uint8_t> file = wire::encode_basis(hair.geometry, hair.basis, hair.skin);
  // A basis and a learnt hair are files like grooms: the server announces their hashes (GroomBasis, GroomLearnt), and
  // sends their bytes as GroomData, here in one piece from byte 0.
  return {welcome,
          wire::CharacterAdded{kOwnCharacter, link_groom(), LevelIndex::low, kOwnMember},
          wire::MemberJoined{kOtherMember, session + 1, 1, link_groom(), "Ann", wire::Appearance{}},
          wire::MemberChanged{kOtherMember, "Anna", {}},
          wire::RoomWind{{}, session},
          wire::GroomBasis{link_groom(), wire::hash_groom(file)},
          link_frames(kFirstTick),
          wire::GroomData{wire::hash_groom(file), file.size(), 0, file},
          wire::GroomLearnt{link_groom(), wire::hash_groom(link_learnt())},
          link_learnt_frames(kFirstTick + 1, false),
          wire::GroomData{wire::hash_groom(link_learnt()), link_learnt().size(), 0, link_learnt()},
          link_learnt_frames(kFirstTick + 2, false)};
}

}  // namespace hairnet::fuzz
