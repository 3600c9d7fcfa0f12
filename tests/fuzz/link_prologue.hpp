#pragma once

#include <memory>
#include <vector>

#include "schema/codec/frame.hpp"
#include "schema/wire/basis_file.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/learnt_file.hpp"
#include "schema/wire/messages.hpp"
#include "tests/support/learnt.hpp"

// The first packets of a server in the client's fuzzer: a welcome, one own character and one other member with the same
// groom, a frame, the groom's basis, for which the frame has asked,
// and its learnt hair, likewise.
namespace hairnet::fuzz {

inline constexpr std::uint32_t kOwnMember = 1, kOtherMember = 2, kOwnCharacter = 5;
inline constexpr std::uint64_t kFirstTick = 100;

inline wire::GroomHash link_groom() {
  return {1};
}

inline wire::HairBasis link_basis() {
  wire::HairBasis hair;
  hair.geometry.lattice.dims = {2, 2, 2};
  for (std::uint32_t node = 0; node < 8; ++node) hair.geometry.active_nodes.push_back(node);
  hair.geometry.trimmed_begin = {0};
  hair.basis.node_count = 8;
  for (int k = 0; k < 6; ++k) {
    hair.basis.deviation_m.push_back(0.1f / static_cast<float>(1 + k));
    hair.basis.unit.push_back(1e-3f);
    for (int i = 0; i < 24; ++i) hair.basis.modes.push_back(static_cast<std::int16_t>(37 * (i + k) % 401 - 200));
  }
  return hair;
}

inline std::vector<std::uint8_t> link_learnt() {
  return wire::encode_learnt(support::random_learnt_hair(9, 4, 4));
}

// The frames of a tick, one for each of both members.
inline wire::Message link_frames(std::uint64_t tick) {
  const codec::CoefficientCode code(link_basis().basis.deviation_m);
  const std::vector<float> coefficients{0.1f, -0.03f, 0.02f, 0, 0.01f, 0.001f * static_cast<float>(tick % 10)};
  codec::EncodedFrame coded;
  codec::encode_frame(rigid_pose({Quat::Identity(), {0, 1.6, 0}}), &code, coefficients, 1, coded);
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

// The same on the learnt level.
inline wire::Message link_learnt_frames(std::uint64_t tick, bool evaluated) {
  wire::Message message = link_frames(tick);
  for (wire::Frame& frame : std::get<wire::FrameBatch>(message).frames) {
    frame.level = LevelIndex::learnt;
    frame.evaluated = evaluated;
  }
  return message;
}

inline std::vector<wire::Message> link_prologue(std::uint64_t session, bool resumed) {
  wire::Welcome welcome;
  welcome.session = session;
  welcome.resumed = resumed;
  const wire::HairBasis hair = link_basis();
  const std::vector<std::uint8_t> file = wire::encode_basis(hair.geometry, hair.basis, hair.skin);
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
