#pragma once

#include <vector>

#include "schema/wire/messages.hpp"
#include "tests/fuzz/frame_codec.hpp"

// The first packets of a server in the client's fuzzer: a welcome, one own character and one other member with the same
// groom, one level, and a frame to which the next may refer.
namespace hairnet::fuzz {

inline constexpr std::uint32_t kOwnMember = 1, kOtherMember = 2, kOwnCharacter = 5;
inline constexpr std::uint64_t kFirstTick = 100;

inline wire::GroomHash link_groom() {
  return {1};
}

// Of both members; `age` as in codec_frames, and so is the history.
inline wire::Message link_frames(std::size_t age, std::size_t order) {
  const codec::Neighbours neighbours(codec_geometry(false));
  const std::vector<codec::FrameIntegers> all = codec_frames(neighbours.node_count());
  std::vector<const codec::FrameIntegers*> history;
  for (std::size_t n = 1; n <= order; ++n) history.push_back(&all[age + n]);
  auto storage = std::make_shared<std::vector<std::uint8_t>>();
  codec::encode_frame(all[age], history, &neighbours, *storage);
  wire::FrameBatch batch;
  batch.tick = kFirstTick + codec::kHistoryMax - age;
  for (const std::uint32_t member : {kOwnMember, kOtherMember}) {
    wire::Frame& frame = batch.frames.emplace_back();
    frame.member = member;
    frame.level = LevelIndex::low;
    frame.velocities = true;
    frame.order = static_cast<std::uint8_t>(order);
    frame.content = *storage;
  }
  batch.storage = std::move(storage);
  return batch;
}

inline std::vector<wire::Message> link_prologue(std::uint64_t session, bool resumed) {
  wire::Welcome welcome;
  welcome.session = session;
  welcome.resumed = resumed;
  LevelGeometry geometry = codec_geometry(false);
  for (std::uint32_t node = 0; node < geometry.lattice.node_count(); ++node) {
    if (node % 5 == 4) geometry.trimmed_nodes.push_back(node);
  }
  geometry.trimmed_begin.assign(geometry.trimmed_nodes.size() + 1, 0);
  return {welcome,
          wire::CharacterAdded{kOwnCharacter, link_groom(), LevelIndex::low, kOwnMember},
          wire::MemberJoined{kOtherMember, session + 1, 1, link_groom(), "Ann", wire::Appearance{}},
          wire::MemberChanged{kOtherMember, "Anna", {}},
          wire::RoomWind{{}, session},
          wire::LevelRecord{link_groom(), LevelIndex::low, std::move(geometry)},
          link_frames(codec::kHistoryMax, 0)};
}

}  // namespace hairnet::fuzz
